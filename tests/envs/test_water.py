"""How water brakes ships and floes, against the literature, brute force and the simulator."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from benchmarks.accuracy import water_coasting
from benchmarks.accuracy.water_coasting import coasting
from pushplan.core import envs as core
from pushplan.envs.simulators.base import Materials, Water
from pushplan.envs.simulators.pymunk_simulator import PymunkSimulator
from pushplan.envs.tasks.ship_ice import PRESETS, ShipIceTask
from pushplan.world import Movables, Twist, World, stream

FULL_SCALE = PRESETS["full_scale"]
ROOT = Path(__file__).parents[2]


def open_water():
    task = ShipIceTask(preset="full_scale", variations={"concentration": 0.0})
    return task.start(stream(0, "layout"))


def test_the_ship_slows_down_as_the_cited_vessel():
    """Fossen, Sagatun and Sørensen (1996): surge and yaw of the supply vessel, bis system."""
    per_second = math.sqrt(9.8 / 76.2)
    surge = 1.1274 / (0.0358 * per_second)
    yaw = 0.1278 / (0.0308 * per_second)
    water = FULL_SCALE.materials.water
    assert water.robot_surge_time == pytest.approx(surge, rel=0.01)
    assert water.robot_yaw_time == pytest.approx(yaw, rel=0.01)
    world = open_water()
    linear, quadratic, turning, _ = water.coefficients(world)[0]
    assert quadratic == 0.0
    time, way = coasting(linear, quadratic, world.robot.mass, 2.0, 1.0)
    assert time == pytest.approx(surge * math.log(2.0), rel=0.01)
    assert way == pytest.approx(surge, rel=0.01)
    # a plate of the ship's length and beam, without a pointed bow, has a little more
    plate = 6.0e6 * (76.2**2 + 18.0**2) / 12.0
    assert 0.75 * plate < turning * water.robot_yaw_time < plate


def test_the_documented_figures_of_coasting_are_what_the_command_prints(capsys, monkeypatch):
    monkeypatch.setattr("sys.argv", ["water_coasting"])
    water_coasting.main()
    printed = capsys.readouterr().out
    page = (ROOT / "docs" / "tasks.md").read_text(encoding="utf-8")
    times = re.findall(r"\b(\d+) s\b", re.findall(r"From 2 to 0\.1 m/s .*", page)[0])
    assert len(times) == 2 and all(
        re.search(rf"\b{time} s, \d+ m \|$", printed, re.M) for time in times
    )


def test_what_the_flow_meets():
    angles = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    disc = 10.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    plate = np.array([[-3.0, -1e-6], [3.0, -1e-6], [3.0, 1e-6], [-3.0, 1e-6]])
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    shapes = core.flow_shapes(np.concatenate([disc, plate, square]), np.array([0, 200, 204, 208]))
    np.testing.assert_allclose(shapes[0, [0, 1]], (20.0, np.pi * 100.0), rtol=1e-3)
    assert shapes[0, 2] < 0.1  # a disc turns without pushing water aside
    assert shapes[0, 3] == pytest.approx(2.0 * np.pi * 1e5 / 5.0, rel=1e-3)
    assert shapes[1, 2] == pytest.approx(3.0**4 / 2.0, rel=1e-5)
    grid = (np.arange(400) + 0.5) / 200.0 - 1.0
    cubed = np.hypot(*np.meshgrid(grid, grid)) ** 3
    assert shapes[2, 3] == pytest.approx(4.0 * cubed.mean(), rel=2e-3)
    widths = np.ptp(square @ np.stack([np.cos(angles), np.sin(angles)]), axis=0)
    assert shapes[2, 0] == pytest.approx(widths.mean(), rel=1e-3)  # Cauchy


@pytest.mark.parametrize(("b", "c"), [(0.0, 3.0), (2.0, 0.0), (0.7, 1.9), (1e-9, 1.0)])
def test_coasting_solves_its_equation(b, c):
    mass, start, end = 5.0, 2.0, 0.4
    time, way = coasting(b, c, mass, start, end)
    v = x = 0.0
    v, h = start, time / 20000
    for _ in range(20000):
        middle = v - 0.5 * h * (b + c * v) * v / mass
        x += h * middle
        v -= h * (b + c * middle) * middle / mass
    assert v == pytest.approx(end, rel=1e-5) and x == pytest.approx(way, rel=1e-5)


def floating(twist, materials):
    """A floe of about 10 m radius with a velocity, and the ship far away."""
    angles = np.arange(8) * np.pi / 4.0 + 0.2
    outline = 10.5 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    start = open_water()
    objects = Movables.from_polygons(
        [np.add(outline, (100.0, 600.0))], density=FULL_SCALE.floe_density
    )
    world = World(
        robot=start.robot,
        robot_pose=start.robot_pose,
        static=start.static,
        movables=objects.moved_to(objects.poses, [twist]),
        goal=start.goal,
    )
    simulator = PymunkSimulator()
    simulator.build(world, materials)
    return world, simulator


def test_a_floe_coasts_as_computed():
    world, simulator = floating((1.2, -0.9, 0.0), FULL_SCALE.materials)
    linear, quadratic, *_ = FULL_SCALE.materials.water.coefficients(world)[1]
    mass = float(world.movables.masses[0])
    time, way = coasting(linear, quadratic, mass, 1.5, 0.3)
    assert 10.0 < way < 100.0  # a few diameters
    poses = [simulator.step(Twist(0.0, 0.0), time / 10).object_poses[-1, 0] for _ in range(10)]
    moved = np.hypot(*(poses[-1] - world.movables.poses[0])[:2])
    assert moved == pytest.approx(way, rel=0.01)
    assert np.hypot(*simulator.world().movables.twists[0, :2]) == pytest.approx(0.3, rel=0.01)


def test_rotation_decays_and_energy_never_grows():
    _, simulator = floating((0.4, 0.0, 0.1), FULL_SCALE.materials)
    last = math.inf
    for _ in range(20):
        simulator.step(Twist(0.0, 0.0), 10.0)
        vx, vy, w = simulator.world().movables.twists[0]
        energy = vx * vx + vy * vy + 40.0 * w * w
        assert energy < last
        last = energy
    assert abs(w) < 0.06 and math.hypot(vx, vy) < 0.08


def test_without_water_a_floe_stops():
    _, simulator = floating((1.2, -0.9, 0.1), Materials())
    trace = simulator.step(Twist(0.0, 0.0), 4.0)
    assert np.ptp(trace.object_poses[:, 0], axis=0).max() < 1e-9


@pytest.mark.parametrize(
    "bad",
    [{"density": 0.0}, {"ambient_speed": -1.0}, {"robot_surge_time": 0.0}, {"object_draught": "1"}],
)
def test_bad_water_is_refused(bad):
    with pytest.raises(ValueError, match=f"water {next(iter(bad))}"):
        Water(**bad)
