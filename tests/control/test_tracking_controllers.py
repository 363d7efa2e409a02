"""Controllers drive a plan to its end, within the robot's limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from conftest import make_robot, make_u_maze
from hypothesis import given, settings
from hypothesis import strategies as st

from pushplan.control import (
    MpcTracker,
    PathFollower,
    Progress,
    PurePursuit,
    TwistLimiter,
    clamp_twist,
)
from pushplan.core import motion as core
from pushplan.world import Controller, InvalidInputError, Plan, RobotModel, StaticMap, Twist, World

FLOOR = StaticMap.build(bounds=[-50, -50, 50, 50])


def arc_plan(world: World, arcs: list[tuple[float, float]], spacing: float = 0.1) -> Plan:
    """A plan of arcs (length, curvature) from the robot's pose."""
    poses, bends = [np.array(world.robot_pose)], []
    for length, curvature in arcs:
        steps = round(length / spacing)
        for _ in range(steps):
            here = np.empty(3)
            core.along_arc(poses[-1], length / steps, curvature, here)
            poses.append(here)
            bends.append(curvature)
    speed = world.robot.max_speed
    lengths = np.concatenate([[0.0], np.cumsum(np.full(len(bends), spacing))])
    return Plan(
        times=lengths / speed,
        poses=np.array(poses),
        speeds=np.full(len(poses), speed),
        turn_rates=np.array([*bends, 0.0]) * speed,
        travel_cost=lengths[-1],
    )


def drive(world: World, plan: Plan, controller: Controller, period: float, steps: int):
    """Follow the plan with exact motion; returns poses and commands."""
    poses, commands = [world.robot_pose], []
    for _ in range(steps):
        twist = controller.command(world, plan)
        commands.append(twist)
        x, y, theta = world.robot_pose
        half = 0.5 * twist.angular * period
        chord = twist.linear * period * (math.sin(half) / half if abs(half) > 1e-12 else 1.0)
        pose = [
            x + chord * math.cos(theta + half),
            y + chord * math.sin(theta + half),
            theta + twist.angular * period,
        ]
        world = world.moved(robot_pose=pose, time=world.time + period)
        poses.append(world.robot_pose)
    return np.array(poses), commands


def distance_to(plan: Plan, poses: np.ndarray) -> np.ndarray:
    gaps = plan.poses[None, :, :2] - poses[:, None, :2]
    return np.hypot(gaps[..., 0], gaps[..., 1]).min(axis=1)


S_CURVE = [(3.0, 0.0), (2.5, 0.6), (2.5, -0.6), (3.0, 0.0)]


def test_the_follower_stays_on_a_curved_plan():
    world = make_u_maze(static=FLOOR)
    plan = arc_plan(world, S_CURVE)
    poses, _ = drive(world, plan, PathFollower(), 0.8, 91)
    assert distance_to(plan, poses).max() < 0.06
    assert np.hypot(*(poses[-1] - plan.poses[-1])[:2]) < 0.2


@settings(max_examples=12)
@given(st.floats(-0.6, 0.6), st.floats(-0.5, 0.5))
def test_the_follower_comes_back_to_the_plan(offset, turn):
    start = make_u_maze(static=FLOOR, robot_pose=[0, 0, 0])
    plan = arc_plan(start, [(12.0, 0.0)])
    poses, commands = drive(
        start.moved(robot_pose=[0, offset, turn]), plan, PathFollower(), 0.8, 95
    )
    assert distance_to(plan, poses)[-5:].max() < 0.06
    assert abs(poses[-1][2]) < 0.05
    assert max(abs(c.angular) for c in commands) <= start.robot.max_turn_rate + 1e-12


def test_pure_pursuit_gets_round_a_corner():
    world = make_u_maze(static=FLOOR, robot_pose=[0, 0, 0])
    corner = arc_plan(world, [(5.0, 0.0), (math.pi / 4, 2.0), (5.0, 0.0)], spacing=0.05)
    poses, _ = drive(world, corner, PurePursuit(), 0.8, 88)
    assert distance_to(corner, poses).max() < 0.6
    assert distance_to(corner, poses)[-10:].max() < 0.1


@pytest.mark.parametrize("controller", [PathFollower, PurePursuit])
def test_a_differential_drive_turns_towards_the_plan_first(controller):
    robot = make_robot(drive="differential", max_speed=0.3, max_turn_rate=1.0)
    world = make_u_maze(static=FLOOR, robot=robot, robot_pose=[0, 0, 0])
    plan = arc_plan(world, [(3.0, 0.0)])
    turned = world.moved(robot_pose=[0, 0, 2.5])
    first = controller().command(turned, plan)
    assert first.linear == 0.0
    assert first.angular < 0.0
    poses, _ = drive(turned, plan, controller(), 0.1, 140)
    assert np.hypot(*(poses[-1] - plan.poses[-1])[:2]) < 0.25


def test_a_differential_drive_stops_at_the_end():
    robot = make_robot(drive="differential")
    world = make_u_maze(static=FLOOR, robot=robot, robot_pose=[0, 0, 0])
    plan = arc_plan(world, [(1.0, 0.0)])
    assert PathFollower().command(world.moved(robot_pose=[1.2, 0, 0]), plan) == Twist(0.0, 0.0)


def test_the_same_controller_can_serve_another_episode():
    world = make_u_maze(
        static=FLOOR, robot=make_robot(max_acceleration=0.2, max_turn_acceleration=0.1)
    )
    plan = arc_plan(world, S_CURVE)
    used = PathFollower()
    drive(world, plan, used, 0.8, 30)
    used.reset(world)
    again, _ = drive(world, plan, used, 0.8, 30)
    fresh, _ = drive(world, plan, PathFollower(), 0.8, 30)
    assert again.tobytes() == fresh.tobytes()


def test_commands_stay_within_accelerations():
    robot = make_robot(
        drive="differential",
        max_speed=0.22,
        max_turn_rate=2.0,
        max_acceleration=0.5,
        max_turn_acceleration=3.0,
    )
    limiter = TwistLimiter(robot)
    rng = np.random.default_rng(0)
    last = np.zeros(2)
    for _ in range(200):
        wanted = Twist(rng.uniform(-0.3, 0.3), rng.uniform(-3, 3))
        now = limiter.step(wanted, 0.05)
        change = np.array([now.linear, now.angular]) - last
        assert abs(change[0]) <= 0.5 * 0.05 + 1e-9
        assert abs(change[1]) <= 3.0 * 0.05 + 1e-9
        last = np.array([now.linear, now.angular])
    for _ in range(60):
        now = limiter.step(Twist(0.2, 1.0), 0.05)
    assert (now.linear, now.angular) == (pytest.approx(0.2), pytest.approx(1.0))


@pytest.mark.parametrize("controller", [PathFollower, PurePursuit, MpcTracker])
@pytest.mark.parametrize("acceleration", [1.0, 3.0])
def test_a_robot_that_turns_lazily_does_not_swing_about_the_plan(controller, acceleration):
    quick = {"max_speed": 0.22, "max_turn_rate": 2.84, "max_acceleration": 0.5}
    outline = 0.1 * np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)])
    robot = RobotModel.from_outline(
        outline, mass=1.0, drive="differential", max_turn_acceleration=acceleration, **quick
    )
    world = make_u_maze(static=FLOOR, robot=robot, robot_pose=[0.0, 0.0, 0.0])
    plan = arc_plan(world, [(3.0, 0.0)], spacing=0.02)
    poses, commands = drive(
        world.moved(robot_pose=[0.0, 0.1, 1.0]), plan, controller(), period=0.05, steps=240
    )
    late = slice(100, 200)
    assert distance_to(plan, poses[late]).max() < 0.02
    assert max(abs(one.angular) for one in commands[late]) < 0.1


@pytest.mark.parametrize("heading", [2.0, 3.0, -3.1])
def test_a_robot_that_faces_away_turns_as_sharply_as_it_can(heading):
    world = make_u_maze(static=FLOOR)
    plan = arc_plan(world, [(3.0, 0.0)])
    x, y, theta = world.robot_pose
    turned = world.moved(robot_pose=[x, y, theta + heading])
    twist = PathFollower(period=0.8).command(turned, plan)
    assert twist.angular == pytest.approx(-math.copysign(world.robot.max_turn_rate, heading))


def test_limits_are_kept():
    car = make_robot()
    assert clamp_twist(car, -3.0, 9.0) == Twist(0.15, 0.105)
    diff = make_robot(drive="differential", min_speed=-0.05)
    assert clamp_twist(diff, -3.0, -9.0) == Twist(-0.05, -0.105)


def test_progress_does_not_jump_across_a_loop():
    world = make_u_maze(static=FLOOR, robot_pose=[0, 0, 0])
    loop = arc_plan(world, [(4.0, 0.0), (2 * math.pi, 1.0), (4.0, 0.0)])
    progress = Progress(window=1.0)
    seen = [progress.update(loop, pose) for pose in loop.poses]
    assert np.all(np.diff(seen) >= 0.0)
    assert np.abs(np.array(seen) - np.arange(len(seen)) * 0.1).max() < 0.15


@pytest.mark.parametrize(
    "build",
    [
        lambda: PathFollower(distance=0),
        lambda: PurePursuit(lookahead=-1),
        lambda: PathFollower(period=math.nan),
    ],
)
def test_bad_parameters(build):
    with pytest.raises(InvalidInputError):
        build()
