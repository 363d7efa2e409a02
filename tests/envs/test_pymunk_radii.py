"""Contact radii and wheels in the planar simulator, against distances worked out by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pushplan.envs import PushEnv
from pushplan.envs.simulators.base import Materials
from pushplan.envs.simulators.pymunk_simulator import PymunkOptions, PymunkSimulator
from pushplan.world import Drive, GoalDisc, Movables, RobotModel, StaticMap, Twist, World

SQUARE = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
RADIUS = 0.05


def scene(x: float, *, wheels: bool = False) -> World:
    """A square robot at the origin and a box ahead of it; walls at y = ±0.62 with wheels."""
    parts = [SQUARE, *(0.2 * SQUARE + (0.0, y) for y in (0.5, -0.5))][: 3 if wheels else 1]
    robot = RobotModel(
        tuple(parts),
        mass=1.0,
        drive=Drive.DIFFERENTIAL,
        max_speed=0.5,
        max_turn_rate=1.0,
        contact_radius=RADIUS,
        wheel_parts=2 if wheels else 0,
    )
    walls = [(-5.0, y, 5.0, y) for y in (0.62, -0.62)] if wheels else []
    return World(
        robot=robot,
        robot_pose=np.zeros(3),
        static=StaticMap.build(segments=walls, bounds=(-5.0, -5.0, 5.0, 5.0)),
        movables=Movables.from_outlines([SQUARE], [(x, 0.0, 0.0)], contact_radii=RADIUS),
        goal=GoalDisc(np.array([4.0, 0.0]), 0.1),
    )


@pytest.mark.parametrize("gap", [0.0, 0.1, 0.3])
def test_a_push_begins_where_the_radii_touch(gap: float) -> None:
    simulator = PymunkSimulator()
    start = 1.0 + 2.0 * RADIUS + gap  # two half sides and two radii
    simulator.build(scene(start), Materials())
    trace = simulator.step(Twist(0.5, 0.0), 0.8)
    robot, box = trace.robot_poses[:, 0], trace.object_poses[:, 0, 0]
    np.testing.assert_allclose(box, np.maximum(start, robot + 1.0 + 2.0 * RADIUS), atol=4e-3)
    assert robot[-1] == pytest.approx(0.4)


def test_corners_are_round() -> None:
    """A box corner by corner with the robot's: they miss each other by less than two radii."""
    world = scene(1.0 + 1.5 * RADIUS)
    off = 1.0 + 1.5 * RADIUS  # along both axes: 2.12 radii from corner to corner
    pose = np.array([[1.0 + 1.5 * RADIUS + 0.3, off, 0.0]])
    simulator = PymunkSimulator()
    simulator.build(world.moved(movable_poses=pose), Materials())
    trace = simulator.step(Twist(0.5, 0.0), 0.6)
    np.testing.assert_array_equal(trace.object_poses[-1, 0], pose[0])
    lower = pose - (0.0, 0.5 * RADIUS, 0.0)  # 1.8 radii
    simulator.build(world.moved(movable_poses=lower), Materials())
    assert (simulator.step(Twist(0.5, 0.0), 0.6).object_poses[-1, 0] != lower[0]).any()


def test_wheels_push_and_do_not_count_at_walls() -> None:
    world = scene(3.0, wheels=True)  # wheels reach to 0.65 and the walls are at 0.62
    simulator = PymunkSimulator()
    simulator.build(world, Materials())
    simulator.step(Twist(0.5, 0.0), 1.0)
    assert not simulator.touched_static and not simulator.held
    body = replace(world, robot=replace(world.robot, wheel_parts=0))
    simulator.build(body, Materials())
    simulator.step(Twist(0.5, 0.0), 1.0)
    assert simulator.touched_static
    aside = np.array([[1.0, 1.12, 0.0]])  # only a wheel reaches so far
    free = replace(world, static=StaticMap.build(bounds=(-5.0, -5.0, 5.0, 5.0)))
    simulator.build(free.moved(movable_poses=aside), Materials())
    assert (simulator.step(Twist(0.5, 0.0), 1.5).object_poses[-1, 0] != aside[0]).any()


def test_a_direction_may_be_held_while_the_robot_turns() -> None:
    for ahead in (3.0, 1.2):  # nothing in reach, and a box that is pushed
        simulator = PymunkSimulator(PymunkOptions(holds_direction=True))
        simulator.build(scene(ahead), Materials())
        trace = simulator.step(Twist(0.5, 0.5), 0.8)
        np.testing.assert_allclose(trace.robot_poses[-1], (0.4, 0.0, 0.4), atol=1e-9)
    env = PushEnv(task="maze", simulator=PymunkSimulator(PymunkOptions(holds_direction=True)))
    env.reset(seed=0)
    before = env.world.robot_pose
    env.step(np.ones(1, np.float32))
    np.testing.assert_allclose(env.world.robot_pose[:2] - before[:2], (0.0, 0.12), atol=1e-9)
