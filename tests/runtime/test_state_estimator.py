"""`StateEstimator`: noise is smoothed by what cannot have moved, and wrong predictions are left."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from conftest import make_boxes, make_robot
from hypothesis import given, settings
from hypothesis import strategies as st

from pushplan.geometry.transforms import arc_step
from pushplan.runtime import StateEstimator
from pushplan.world import ClearanceArea, Drive, GoalDisc, StaticMap, Twist, World
from pushplan.world.checks import FloatArray

PERIOD = 0.05
GAIN = 0.3
NOISE = np.array([0.02, 0.02, math.radians(3.0)])
FIXED = math.sqrt(GAIN / (2.0 - GAIN)) * NOISE  # what a filter of fixed gain leaves
ROBOT = make_robot(drive=Drive.DIFFERENTIAL, max_speed=0.5, min_speed=-0.3, max_turn_rate=1.0)
AREA = np.array([[1.0, 1.0], [29.0, 1.0], [29.0, 29.0], [1.0, 29.0]])
ROOM = World(
    robot=ROBOT,
    robot_pose=[3.0, 15.0, 0.0],
    static=StaticMap.build(bounds=[0, 0, 30, 30]),
    movables=make_boxes([[15.0, 20.0, 0.4], [22.0, 9.0, 1.0]]),
    goal=ClearanceArea(AREA, np.ones(4, dtype=bool)),
)


def seen(world: World, rng: np.random.Generator, noise: FloatArray = NOISE) -> World:
    return world.moved(
        robot_pose=world.robot_pose + noise * rng.normal(size=3),
        movable_poses=world.movables.poses + noise * rng.normal(size=(len(world.movables), 3)),
    )


def errors(
    seconds: float,
    *,
    seed: int = 0,
    told: Callable[[float], Twist] = lambda time: Twist(0.0, 0.0),
    slip: float = 0.0,
    moves: Callable[[float], float] = lambda time: 0.0,
    period: float = PERIOD,
) -> FloatArray:
    """(N, 1 + K, 3) errors of the estimates of robot and boxes.

    The robot drives what it is told but for a slip, somebody moves the last box along x by
    ``moves``.
    """
    rng = np.random.default_rng(seed)
    estimator = StateEstimator(0.0, GAIN, NOISE, 1.0)
    world = ROOM
    found = []
    for _ in range(round(seconds / period)):
        believed = estimator.observe(seen(world, rng))
        away = np.vstack([believed.robot_pose, believed.movables.poses])
        away -= np.vstack([world.robot_pose, world.movables.poses])
        away[:, 2] = np.remainder(away[:, 2] + math.pi, math.tau) - math.pi
        found.append(away)
        twist = told(world.time)
        estimator.sent(world.time, twist)
        pose = np.empty(3)
        driven = (1.0 - slip) * period
        arc_step(np.array(world.robot_pose), twist.linear * driven, twist.angular * driven, pose)
        boxes = np.array(ROOM.movables.poses)
        boxes[-1, 0] += moves(world.time + period)
        world = world.moved(robot_pose=pose, movable_poses=boxes, time=world.time + period)
    return np.array(found)


def wandering(time: float) -> Twist:
    return Twist(0.4 if time % 4.0 < 3.0 else -0.2, 0.6 * math.sin(time))


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.02, 0.05, 0.1]))
def test_a_box_that_nothing_touches_keeps_next_to_no_noise(seed: int, period: float) -> None:
    away = errors(200 * period, seed=seed, told=wandering, period=period)[100:, 1:] / NOISE
    assert np.sqrt((away**2).mean()) < 0.2


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))]
)
def test_a_robot_that_drives_as_told_keeps_less_noise_than_a_fixed_gain_leaves(seed: int) -> None:
    estimator = StateEstimator(0.0, GAIN, NOISE, 1.0)
    left = estimator.remaining_noise(ROBOT, PERIOD)
    assert (left <= FIXED).all()
    away = errors(40.0, seed=seed, told=wandering)[100:, 0]
    assert (np.sqrt((away**2).mean(axis=0)) < 1.3 * left).all()


def test_a_box_that_somebody_moves_is_followed() -> None:
    away = errors(8.0, moves=lambda time: 0.5 * (time > 5.0))[:, -1]
    assert np.abs(away[99]).max() < 0.01
    assert np.abs(away[130:, 0]).max() < 3.0 * FIXED[0]


def test_a_robot_that_slips_is_followed_almost_as_by_a_fixed_gain() -> None:
    stuck = errors(10.0, told=lambda time: Twist(0.3, 0.0), slip=1.0)[60:, 0, 0]
    behind = 0.3 * PERIOD / GAIN  # of a fixed gain in the mean
    assert np.abs(stuck).max() < behind + 5.0 * FIXED[0]


def test_without_known_noise_the_gain_is_fixed() -> None:
    estimator = StateEstimator(0.0, GAIN, np.zeros(3), 1.0)
    estimator.observe(ROOM)
    believed = ROOM.movables.poses
    rng = np.random.default_rng(1)
    for n in range(1, 30):
        world = seen(ROOM.moved(time=n * PERIOD), rng)
        believed = believed + GAIN * (world.movables.poses - believed)
        got = estimator.observe(world).movables.poses
        assert got == pytest.approx(believed, abs=1e-12)
    assert not estimator.remaining_noise(ROBOT, PERIOD).any()
    assert estimator.is_settled(np.zeros(3), ROOM.goal)


def test_an_estimate_is_ready_when_no_more_noise_is_left_than_in_the_end() -> None:
    rng = np.random.default_rng(2)
    estimator = StateEstimator(0.0, GAIN, NOISE, 1.0)
    left = estimator.remaining_noise(ROBOT, PERIOD)
    ready = []
    for n in range(100):
        estimator.observe(seen(ROOM.moved(time=n * PERIOD), rng))
        ready.append(estimator.is_settled(left, ROOM.goal))
    assert not any(ready[:3])
    assert np.mean(ready[50:]) > 0.8  # an outlier is looked at again


def test_what_nobody_sees_becomes_no_surer() -> None:
    rng = np.random.default_rng(3)
    estimator = StateEstimator(0.0, GAIN, NOISE, 1.0)
    left = estimator.remaining_noise(ROBOT, PERIOD)
    world = estimator.observe(seen(ROOM, rng))
    for n in range(1, 100):
        now = seen(ROOM.moved(time=n * PERIOD), rng)
        hidden = now.movables.moved_to(
            np.vstack([now.movables.poses[:1], world.movables.poses[1:]])
        )
        world = estimator.observe(now.moved(movable_poses=hidden.poses))
    assert estimator.is_settled(left, GoalDisc((0.0, 0.0), 1.0))
    assert not estimator.is_settled(left, ROOM.goal)
