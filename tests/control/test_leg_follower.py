import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pushplan.control import LegFollower, Legs, Recovery, StallChecker
from pushplan.control.limits import arc_twist
from pushplan.world import (
    Drive,
    GoalDisc,
    InvalidInputError,
    Movables,
    RobotModel,
    StaticMap,
    Twist,
    World,
)

SQUARE = [(0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1)]
places = st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
rates = st.sampled_from([(period, turn) for period in (0.01, 0.2) for turn in (0.05, 0.5, 1.5)])


def robot(turn_rate=1.5, min_speed=-0.2):
    return RobotModel.from_outline(
        SQUARE,
        mass=1.0,
        drive=Drive.DIFFERENTIAL,
        max_speed=0.2,
        min_speed=min_speed,
        max_turn_rate=turn_rate,
    )


def driven(pose, twist, seconds):
    x, y, theta = pose
    v, w = twist.linear * seconds, twist.angular * seconds
    return np.array([x + v * np.cos(theta + w / 2), y + v * np.sin(theta + w / 2), theta + w])


def run(
    legs, pose=(0.0, 0.0, 0.0), *, follow=1.0, period=0.2, turn_rate=1.5, noise=None, **options
):
    """Poses of a robot whose speeds are ``follow`` times what it is told."""
    model = robot(turn_rate)
    follower, poses, time = LegFollower(model, legs, **options), [np.array(pose, dtype=float)], 0.0
    seen = poses[0]
    while (twist := follower.command(seen, time, period)) is not None:
        assert abs(twist.linear) <= model.max_speed and abs(twist.angular) <= turn_rate
        told = Twist(follow * twist.linear, follow * twist.angular)
        poses.append(driven(poses[-1], told, period))
        seen = poses[-1] if noise is None else poses[-1] + noise.normal(size=3) * (0.01, 0.01, 0.03)
        time += period
        assert time < 1000.0
    return follower, np.array(poses)


@settings(max_examples=40)
@given(points=st.lists(places, min_size=1, max_size=3), heading=st.floats(-3.0, 3.0), rate=rates)
@pytest.mark.slow
def test_it_arrives_by_every_point_at_any_rate(points, heading, rate):
    period, turn_rate = rate
    follower, poses = run(
        Legs.ahead(points, 1.0), (0.0, 0.0, heading), period=period, turn_rate=turn_rate
    )
    assert follower.arrived
    for point in points:
        assert np.hypot(*(poses[:, :2] - point).T).min() < 0.02
    assert abs(math.remainder(poses[-1, 2] - 1.0, math.tau)) < math.radians(2.1)
    length = np.hypot(*np.diff(poses[:, :2], axis=0).T).sum()
    way = np.hypot(*np.diff([(0.0, 0.0), *points], axis=0).T).sum()
    assert length <= way + 0.03 * len(points)


@given(point=places, follow=st.floats(0.7, 1.0))
def test_a_robot_that_lags_arrives_too(point, follow):
    follower, poses = run(Legs.ahead([point]), follow=follow)
    assert follower.arrived
    assert np.hypot(*(poses[-1, :2] - point)) < 0.02


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("period", [0.02, 0.2])
def test_noise_keeps_no_leg_from_ending(seed, period):
    points = [(1.0, 0.5), (-0.5, 1.0)]
    follower, poses = run(
        Legs.ahead(points, 0.0),
        period=period,
        noise=np.random.default_rng(seed),
        near=0.02,
        aligned=0.03,
    )
    assert follower.arrived
    assert np.hypot(*(poses[-1, :2] - points[-1])) < 0.08


def test_legs_are_driven_back_where_they_say_so():
    legs = Legs(np.array([[-1.0, 0.0]]), np.array([-1.0]), np.zeros(2), None)
    follower, poses = run(legs)
    assert follower.arrived and abs(poses[-1, 2]) < 1e-9 and poses[-1, 0] < -0.98


def test_a_turn_goes_round_the_way_that_is_said():
    legs = Legs(np.array([[0.0, 1.0]]), np.array([1.0]), np.array([-1.0, 0.0]), None)
    follower, poses = run(legs)
    assert follower.arrived and poses[:, 2].min() < -4.0


@pytest.mark.parametrize("period", [0.02, 0.2])
@pytest.mark.parametrize("turn_rate", [0.05, 1.5])
@pytest.mark.parametrize("point", [(1.0, 0.0), (-1.0, 0.0)])
def test_it_gives_up_where_it_is_stopped(period, turn_rate, point):
    follower, poses = run(Legs.ahead([point]), follow=0.0, period=period, turn_rate=turn_rate)
    assert not follower.arrived
    assert len(poses) * period < 10.0


def test_it_makes_room_for_a_turn_that_is_stopped():
    follower, pose = LegFollower(robot(), Legs.ahead([(0.0, 1.0)]), escapes=2), np.zeros(3)
    assert follower.command(pose, 0.0, 0.2).angular > 0.0
    away = follower.command(pose, 0.2, 0.2, stopped=True)
    assert away.linear < 0.0 and away.angular == 0.0
    assert follower.command(pose, 0.4, 0.2, stopped=True).linear > 0.0  # not that way either


def test_bad_points_are_refused():
    for bad in ([], [(0.0, np.nan)], [(1.0,)], "ab"):
        with pytest.raises(InvalidInputError, match="points"):
            Legs.ahead(bad)
    follower = LegFollower(robot(), Legs.ahead([(1.0, 0.0)]))
    with pytest.raises(InvalidInputError, match="robot_pose"):
        follower.command(np.array([np.nan, 0.0, 0.0]), 0.0, 0.1)
    for name in ("near", "aligned", "response"):
        with pytest.raises(InvalidInputError, match=name):
            LegFollower(robot(), Legs.ahead([(1.0, 0.0)]), **{name: -1.0})


@pytest.mark.parametrize("period", [0.01, 0.2])
@pytest.mark.parametrize("fraction", [0.0, 0.05, 0.5, 1.0])
def test_a_stall_is_told_from_a_slow_robot(period, fraction):
    checker, pose, told = StallChecker(robot()), np.zeros(3), Twist(0.2, 0.0)
    stalled = False
    for step in range(round(3.0 / period)):
        stalled |= checker.update(pose, step * period)
        checker.send(told)
        pose = driven(pose, Twist(fraction * 0.2, 0.0), period)
    assert stalled == (fraction < 0.1)


def open_floor(**changes: object) -> World:
    goal = GoalDisc(np.array([4.0, 0.0]), 0.5)
    bounds = StaticMap.build(bounds=[-5, -5, 5, 5])
    return World(robot(**changes), np.zeros(3), bounds, Movables.empty(), goal)


@pytest.mark.parametrize("period", [0.02, 0.2])
def test_a_recovery_tries_one_way_after_another(period):
    """Only ahead is free."""
    world = open_floor()
    recovery = Recovery(world, 0.1, searches=False)
    while (twist := recovery.command(world, period)) is not None:
        pose = world.robot_pose
        if twist.linear > 0.0 and twist.angular == 0.0:
            pose = driven(pose, twist, period)
        world = world.moved(robot_pose=pose, time=world.time + period)
        assert world.time < 20.0
    assert world.robot_pose[0] >= 0.1
    world = open_floor()
    closed = Recovery(world, 0.1, searches=False)
    while closed.command(world, period) is not None:
        world = world.moved(time=world.time + period)
        assert world.time < 20.0


def test_a_robot_that_cannot_reverse_recovers_otherwise():
    world = open_floor(min_speed=0.0)
    assert Recovery(world, 0.1).command(world, 0.1) != Twist(0.0, 0.0)


@given(length=st.floats(-1.0, 1.0), turn=st.floats(-3.0, 3.0), rate=st.floats(0.05, 2.0))
def test_an_arc_keeps_its_curvature_within_the_limits(length, turn, rate):
    model = robot(rate)
    twist = arc_twist(model, length, turn)
    assert abs(twist.linear) <= model.max_speed and abs(twist.angular) <= rate
    assert twist.linear * turn == pytest.approx(twist.angular * length, abs=1e-9)
