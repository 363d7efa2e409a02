"""Rolling, floating, and leaving out what cannot move: physics of the planar simulator."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pushplan.envs.simulators.base import Materials, Water
from pushplan.envs.simulators.pymunk_simulator import PymunkOptions, PymunkSimulator
from pushplan.geometry import convex_distance
from pushplan.world import (
    Drive,
    GoalLine,
    Movables,
    RobotModel,
    StaticMap,
    Twist,
    World,
)
from pushplan.world.outline import transform

SQUARE = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
ROBOT = RobotModel.from_outline(
    [(0.7, -0.5), (0.7, 0.5), (-0.7, 0.5), (-0.7, -0.5)],
    mass=1.0,
    drive=Drive.DIFFERENTIAL,
    max_speed=0.3,
    min_speed=-0.3,
    max_turn_rate=0.3,
)
WATER = Water(density=1000.0, object_draught=0.1, object_form_drag=1.0)
FREE = Water(object_form_drag=0.0, object_skin_drag=0.0)


def make_world(poses, twists=None, masses=None, robot_pose=(-20.0, 0.0, 0.0)):
    movables = Movables.from_outlines([SQUARE] * len(poses), poses, masses=masses, twists=twists)
    empty = StaticMap.build(bounds=(-30.0, -30.0, 30.0, 30.0))
    return World(ROBOT, np.array(robot_pose), empty, movables, GoalLine((0, 29), (0, 1)))


def afloat(world, water, **materials):
    simulator = PymunkSimulator()
    simulator.build(world, Materials(water=water, **materials))
    return simulator


def momentum(world):
    movables = world.movables
    spin = movables.masses / 6.0  # a square of side 1
    velocity, x = movables.twists[:, :2], movables.poses[:, :2]
    angular = spin @ movables.twists[:, 2] + movables.masses @ (
        x[:, 0] * velocity[:, 1] - x[:, 1] * velocity[:, 0]
    )
    return np.array([*(movables.masses @ velocity), angular])


def energy(world):
    movables = world.movables
    speed = (movables.twists[:, :2] ** 2).sum(axis=1)
    return 0.5 * movables.masses @ (speed + movables.twists[:, 2] ** 2 / 6.0)


def test_a_floating_object_coasts_as_drag_says():
    world = make_world([(0.0, 0.0, 0.0)], twists=[(0.4, 0.3, 0.2)], masses=[50.0])
    simulator = afloat(world, WATER)
    b, c, _, _ = WATER.coefficients(world)[1] / 50.0
    t = 8.0
    simulator.step(Twist(0.0, 0.0), t)
    decay = np.exp(-b * t)
    expected = 0.5 * decay / (1.0 + c * 0.5 * (1.0 - decay) / b)
    after = simulator.world().movables
    assert np.hypot(*after.twists[0, :2]) == pytest.approx(expected, rel=1e-3)
    travelled = np.log1p(c * 0.5 * (1.0 - decay) / b) / c
    assert np.hypot(*after.poses[0, :2]) == pytest.approx(travelled, rel=0.03)
    assert after.twists[0, 1] / after.twists[0, 0] == pytest.approx(0.75)


@settings(max_examples=25)
@given(
    offset=st.floats(-0.9, 0.9),
    turn=st.floats(-1.0, 1.0),
    speed=st.floats(0.4, 2.0),
    mass=st.floats(0.2, 5.0),
    grip=st.floats(0.0, 1.0),
)
def test_momentum_is_kept_without_drag_and_energy_never_grows(offset, turn, speed, mass, grip):
    world = make_world(
        [(-2.0, offset, turn), (0.0, 0.0, 0.0)],
        twists=[(speed, 0.0, 0.1), (0.0, 0.0, 0.0)],
        masses=[1.0, mass],
    )
    simulator = afloat(world, FREE, object_object=grip)
    energies = [energy(world)]
    for _ in range(20):
        simulator.step(Twist(0.0, 0.0), 0.25)
        energies.append(energy(simulator.world()))
    after = simulator.world()
    assert np.abs(after.movables.twists[1]).max() > 0.0  # it was hit
    np.testing.assert_allclose(momentum(after), momentum(world), atol=0.02 * speed * (1 + mass))
    assert np.diff(energies).max() <= 1e-6 * energies[0]


def test_a_pushed_floe_keeps_ahead_of_a_robot_that_stops():
    world = make_world([(0.0, 0.0, 0.0)], robot_pose=(-1.25, 0.0, 0.0))
    simulator = afloat(world, FREE)
    simulator.step(Twist(0.3, 0.0), 2.0)
    assert simulator.world().movables.twists[0, 0] == pytest.approx(0.3, rel=1e-3)
    x = simulator.object_poses[0, 0]
    simulator.step(Twist(0.0, 0.0), 2.0)
    assert simulator.object_poses[0, 0] - x == pytest.approx(0.6, rel=0.02)


def test_plain_boxes_stop_at_once_whatever_comes_next():
    for following in (Twist(0.0, 0.0), Twist(-0.3, 0.0)):
        simulator = PymunkSimulator()
        simulator.build(make_world([(0.0, 0.0, 0.0)], robot_pose=(-1.25, 0.0, 0.0)), Materials())
        simulator.step(Twist(0.3, 0.0), 2.0)
        x = simulator.object_poses[0, 0]
        for _ in range(3):
            simulator.step(following, 2.0)
        assert simulator.object_poses[0, 0] == pytest.approx(x, abs=0.012)


@pytest.mark.parametrize("holds", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_driving_freely_up_to_the_first_contact_changes_nothing(seed, holds):
    """The same drive with every step simulated from its beginning ends at the same places."""
    rng = np.random.default_rng(seed)
    poses = np.column_stack([rng.uniform(-3.0, 3.0, (4, 2)), rng.uniform(-3.0, 3.0, 4)])
    world = make_world(poses, robot_pose=(-6.0, 0.0, 0.0))
    options = PymunkOptions(holds_direction=holds)
    some, everything = PymunkSimulator(options), PymunkSimulator(options)
    for simulator in (some, everything):
        simulator.build(world, Materials())
    everything.clear_for = lambda command, limit: 0.0
    for _ in range(12):
        to = -some.robot_pose[:2]
        error = np.remainder(np.arctan2(*to[::-1]) - some.robot_pose[2] + np.pi, 2 * np.pi) - np.pi
        command = Twist(0.3, float(np.clip(error + rng.normal(0.0, 0.3), -0.3, 0.3)))
        traces = [simulator.step(command, 3.0) for simulator in (some, everything)]
        np.testing.assert_allclose(traces[0].robot_poses[-1], traces[1].robot_poses[-1], atol=1e-9)
        # a contact that ends a substep earlier by rounding makes a millimetre
        np.testing.assert_allclose(some.object_poses, everything.object_poses, atol=4e-3)
    assert np.abs(some.object_poses - poses).max() > 0.3


@settings(max_examples=25)
@given(
    turn=st.floats(-0.3, 0.3),
    speed=st.floats(-0.3, 0.3),
    at=st.floats(0.0, 6.3),
    away=st.floats(1.4, 4.0),
)
def test_a_robot_touches_nothing_before_it_may_and_something_soon_after(turn, speed, at, away):
    box = (away * np.cos(at), away * np.sin(at), 0.3)
    world = make_world([box], robot_pose=(0.0, 0.0, 0.0))
    simulator = PymunkSimulator()
    simulator.build(world, Materials())
    limit = 5.0
    clear = simulator.clear_for(Twist(speed, turn), limit)
    times = np.linspace(0.0, limit, 1001)
    half = 0.5 * turn * times
    chord = speed * times * np.sinc(half / np.pi)
    placed = world.movables.outline_world(0)
    robot = np.column_stack([chord * np.cos(half), chord * np.sin(half), 2.0 * half])
    outlines = [transform(pose, world.robot.parts[0]) for pose in robot]
    touched = [convex_distance(outline, placed) == 0.0 for outline in outlines]
    first = times[np.argmax(touched)] if any(touched) else np.inf
    assert clear <= first
    if clear < limit:  # it stops within a substep of what it comes near
        pose = robot[np.searchsorted(times, clear)]
        gap = convex_distance(transform(pose, world.robot.parts[0]), placed)
        assert gap < 0.01


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("water", [None, WATER])
@pytest.mark.slow
def test_leaving_out_what_is_far_changes_nothing(seed, water):
    """The same drive with every object simulated all the time ends at the same places."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.arange(6), np.arange(6)), axis=-1).reshape(-1, 2) * 1.35
    poses = np.column_stack([grid + rng.uniform(-0.1, 0.1, grid.shape), np.zeros(len(grid))])
    world = make_world(poses, robot_pose=(-1.5, 3.0, 0.0))
    some, everything = afloat(world, water), afloat(world, water)
    everything._core.loads_all = True
    few = []
    for _ in range(25):
        command = Twist(0.3, rng.uniform(-0.2, 0.2))
        some.step(command, 0.8)
        few.append(some._core.loaded)
        everything.step(command, 0.8)
        assert everything._core.loaded in (0, len(poses))
    assert np.mean(few) < 0.8 * len(poses)
    moved = np.hypot(*(everything.object_poses - poses)[:, :2].T)
    assert moved.max() > 1.0
    gaps = np.hypot(*(some.object_poses - everything.object_poses)[:, :2].T)
    assert np.quantile(gaps, 0.9) < 0.02
    total = moved.sum()
    assert np.hypot(*(some.object_poses - poses)[:, :2].T).sum() == pytest.approx(total, rel=0.03)
