"""Controllers written as C give the commands of those in Python."""

from __future__ import annotations

import math
import os
import subprocess
import sys

import numpy as np
import pytest
from generated_controller import Generated, needs_gcc, run_gcc

from pushplan.cli import main
from pushplan.codegen import write_pushing_mpc, write_tracking_mpc
from pushplan.codegen.program import Program
from pushplan.compiled import kernel
from pushplan.control import MpcConfig, MpcTracker
from pushplan.planners.pushing import (
    PushingConfig,
    PushingMpc,
    PushModel,
    PushParameters,
    PushPath,
    PushState,
)
from pushplan.world import (
    InvalidInputError,
    Movables,
    Receptacle,
    StaticMap,
    World,
    area_clearing_robot,
    jackal,
    maze_robot,
    turtlebot3_burger,
)

SQUARE = 0.5 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
S_CURVE = [(1.5, 0.0), (2.0, 0.25), (2.0, -0.25), (1.0, 0.0)]  # in robot sizes
AREA = area_clearing_robot()
BURGER = turtlebot3_burger("pusher", max_speed=0.2, max_turn_rate=0.785)
LIBM = {"sin", "cos", "sincos", "atan2", "sqrt", "rint", "ceil", "fabs", "floor"}


def make_world(robot, pose, side=1.0, boxes=((0.0, 0.0, 0.0),), walls=()):
    far = 100.0
    return World(
        robot=robot,
        robot_pose=np.array(pose),
        static=StaticMap.build(polygons=walls, bounds=[-far, -far, far, far]),
        movables=Movables.from_outlines([side * SQUARE] * len(boxes), boxes),
        goal=Receptacle(SQUARE + 90.0),
    )


def after(pose, twist, period):
    x, y, theta = pose
    middle = theta + 0.5 * twist.angular * period
    chord = twist.linear * period
    return np.array(
        [x + chord * math.cos(middle), y + chord * math.sin(middle), theta + twist.angular * period]
    )


def track(robot, config, noise, steps=150):
    """Worlds of a tracked S-curve, the plan, and the commands."""
    size, rng = robot.circumscribed_radius, np.random.default_rng(3)
    plan = PushPath.arcs(np.zeros(3), [(a * size, b / size) for a, b in S_CURVE]).plan(robot, 0)
    tracker, worlds, commands = MpcTracker(config), [], []
    pose = np.array([-0.1 * size, 0.2 * size, 0.4])
    for i in range(steps):
        jump = 1.0 if i == 60 else 0.0  # beside the path: it turns to it first
        seen = pose + noise * rng.standard_normal(3) * [size, size, 1.0] + [0.0, 0.0, 2.0 * jump]
        worlds.append(make_world(robot, seen).moved(time=config.period * i + 0.01 * (i % 3)))
        twist = tracker.command(worlds[-1], plan)
        commands.append((twist.linear, twist.angular))
        pose = after(pose, twist, config.period)
    return worlds, plan, np.array(commands), tracker


def push(robot, side, config, noise, steps, walls=(), friction=0.3):
    """The same of a box that moves as the contact model says; it is turned to another face once."""
    model = PushModel(robot, side * SQUARE, PushParameters(friction))
    length, rng = model.reach, np.random.default_rng(4)
    path = PushPath.arcs(np.zeros(3), [(a * length, b / length) for a, b in S_CURVE])
    plan, mpc, worlds, commands, slowed = path.plan(robot, 0), PushingMpc(config), [], [], []
    state = PushState([-1.05 * length, 0.05 * length, 0.0], 0.0, 0.05)
    walls = [length * np.array(wall) for wall in walls]
    turned = 0.0
    for i in range(steps):
        if i == 20:
            turned = math.pi / 2  # the next face of a square looks the same
        pose = state.robot_pose + noise * rng.standard_normal(3) * [length, length, 1.0]
        box = np.add(model.box_pose(state), [0.0, 0.0, turned])
        box += noise * rng.standard_normal(3) * [length, length, 1.0]
        world = make_world(robot, pose, side, [box], walls)
        worlds.append(world.moved(time=config.period * i))
        twist = mpc.command(worlds[-1], plan)
        commands.append((twist.linear, twist.angular))
        slowed.append(mpc.slowed)
        states, _ = model.rows(state, [commands[-1]], config.period)
        state = PushState.from_row(states[-1])
    return worlds, plan, np.array(commands), np.array(slowed)


def commands_in_c(folder, name, worlds, plan):
    generated = Generated(folder, name, 0 if name == "pushing_mpc" else None)
    return np.array([generated.command(world, plan) for world in worlds])


TRACKED = {
    "constant speed, delayed": (maze_robot(), MpcConfig(period=0.4, delay=0.8), 0.01),
    "speeds chosen": (BURGER, MpcConfig(horizon=12, optimise_speed=True), 0.02),
    "limited turn acceleration": (
        maze_robot(max_turn_acceleration=0.2),
        MpcConfig(period=0.4, smoothness=0.01),
        0.02,
    ),
    "the solver gives up": (
        maze_robot(max_turn_acceleration=0.2),
        MpcConfig(period=0.4, solver_iterations=6),
        0.05,
    ),
}


@needs_gcc
@pytest.mark.parametrize("name", TRACKED)
def test_tracking_is_the_same_in_c(name, tmp_path):
    robot, config, noise = TRACKED[name]
    worlds, plan, expected, tracker = track(robot, config, noise)
    write_tracking_mpc(tmp_path, robot, config)
    found = commands_in_c(tmp_path, "tracking_mpc", worlds, plan)
    assert found == pytest.approx(expected, abs=1e-6)
    assert np.ptp(expected[:, 1]) > 0.3 * robot.max_turn_rate
    assert (tracker.fallbacks > 0) == (name == "the solver gives up")


WALLS = [[(3.0, -3.0), (4.0, -3.0), (4.0, 3.0), (3.0, 3.0)], [(0, -2), (2, -2), (2, -1), (0, -1)]]
PUSHED = {
    "beside and before walls": (AREA, 1.0, PushingConfig(period=0.2, clearance=0.02), 0.0, WALLS),
    "noise and delay": (
        BURGER,
        0.08,
        PushingConfig(period=0.2, delay=0.2, observer_gain=0.4),
        0.01,
        (),
    ),
    "friction, short horizon": (
        jackal("pusher"),
        0.3,
        PushingConfig(horizon=8, moves=8, parameters=PushParameters(0.3)),
        0.005,
        (),
    ),
}


@needs_gcc
@pytest.mark.parametrize("name", PUSHED)
@pytest.mark.slow
def test_pushing_is_the_same_in_c(name, tmp_path):
    robot, side, config, noise, walls = PUSHED[name]
    worlds, plan, expected, slowed = push(robot, side, config, noise, 120, walls)
    write_pushing_mpc(tmp_path, robot, side * SQUARE, config)
    found = commands_in_c(tmp_path, "pushing_mpc", worlds, plan)
    assert found == pytest.approx(expected, abs=1e-6)
    assert expected[:, 0].max() > 0.5 * robot.max_speed and np.ptp(expected[:, 1]) > 0.02
    assert (slowed.min() < 0.5) == bool(walls)


@needs_gcc
@pytest.mark.parametrize("name", ["tracking_mpc", "pushing_mpc"])
@pytest.mark.slow
def test_it_needs_nothing_but_libm(name, tmp_path):
    if name == "tracking_mpc":
        write_tracking_mpc(tmp_path, AREA)
    else:
        write_pushing_mpc(tmp_path, AREA, SQUARE)
    run_gcc("-c", "-o", tmp_path / "controller.o", tmp_path / f"{name}.c")
    listed = subprocess.check_output(["nm", "-u", tmp_path / "controller.o"], text=True)
    needed = {line.split()[-1] for line in listed.splitlines()}
    assert "sin" in needed
    assert needed <= LIBM | {"memset", "memcpy", "memmove", "_GLOBAL_OFFSET_TABLE_"}
    run_gcc("-o", tmp_path / "example", tmp_path / "main.c", tmp_path / f"{name}.c", "-lm")
    told = subprocess.check_output([tmp_path / "example"], text=True).splitlines()
    assert len(told) == 100 and "speed 0.160 m/s" in told[-1]


@needs_gcc
def test_a_copy_goes_on_alike_and_an_instant_has_one_command(tmp_path):
    robot, config, noise = TRACKED["speeds chosen"]
    worlds, plan, expected, _ = track(robot, config, noise, 40)
    write_tracking_mpc(tmp_path, robot, config)
    one, other = (Generated(tmp_path, "tracking_mpc", None) for _ in range(2))
    for world in worlds[:20]:
        one.command(world, plan)
    other.command(worlds[0], plan)
    other._struct.raw = one._struct.raw
    assert other.command(worlds[20], plan) == pytest.approx(expected[20], abs=1e-6)
    assert (one.command(worlds[19].moved(robot_pose=[9, 9, 9]), plan) == expected[19]).all()


def test_the_same_bytes_each_time(tmp_path):
    code = (
        "import sys, numpy as np; from pushplan.codegen import *; "
        "from pushplan.world import area_clearing_robot as robot; "
        f"write_pushing_mpc(sys.argv[1], robot(), np.array({SQUARE.tolist()})); "
        "write_tracking_mpc(sys.argv[1] + '/tracking', robot())"
    )
    environment = {**os.environ, "PYTHONHASHSEED": "7"}
    subprocess.run([sys.executable, "-c", code, tmp_path / "1"], check=True, env=environment)
    write_pushing_mpc(tmp_path / "2", AREA, SQUARE)
    write_tracking_mpc(tmp_path / "2" / "tracking", AREA)
    names = sorted(p.relative_to(tmp_path / "1") for p in (tmp_path / "1").rglob("*.*"))
    assert len(names) == 8
    for name in names:
        first = (tmp_path / "1" / name).read_bytes()
        assert first == (tmp_path / "2" / name).read_bytes()
        assert b"@" not in first


def test_what_cannot_be_written_is_refused(tmp_path, capsys):
    with pytest.raises(InvalidInputError, match="differential drive"):
        write_pushing_mpc(tmp_path, maze_robot(), SQUARE)
    assert main(["codegen", "mpc", "--out", str(tmp_path)]) == 2
    assert "tracking-mpc" in capsys.readouterr().err
    assert main(["codegen", "tracking-mpc", "--out", str(tmp_path), "--set", "horizonn=3"]) == 2
    assert "horizon" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())

    @kernel
    def squares(count: int) -> float:
        """A list has no place in C."""
        return sum([i**2 for i in range(count)])

    with pytest.raises(InvalidInputError, match="no C for"):
        Program().add(squares, [3])


@needs_gcc
def test_the_command_writes_what_compiles(tmp_path, capsys):
    arguments = ["--set", "horizon=8", "--set", "moves=4", "--set", "friction=0.2"]
    assert main(["codegen", "pushing-mpc", "--out", str(tmp_path), *arguments]) == 0
    assert "pushing_mpc.h" in capsys.readouterr().out
    assert "/* 8 */" in (tmp_path / "pushing_mpc.h").read_text()
    run_gcc("-c", "-o", tmp_path / "controller.o", tmp_path / "pushing_mpc.c")
