"""Recoveries begin without progress, have an end, and leave a valid plan alone."""

from __future__ import annotations

import functools
import itertools
import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np
import pytest
from conftest import make_robot, make_u_maze

from pushplan.control import (
    MpcTracker,
    PathFollower,
    PoseProgressChecker,
    Recovery,
    SimulatedExecutor,
)
from pushplan.core import motion as core
from pushplan.envs import make
from pushplan.interaction import QuasiStatic
from pushplan.motion.collision import footprint, obstacles
from pushplan.planners import make_planner, policy_for
from pushplan.planners.following.plan_follower import PlanFollower, RecoveryRule
from pushplan.scenarios import Scenario
from pushplan.world import (
    MaxIterations,
    Plan,
    PlanResult,
    PlanStats,
    PlanStatus,
    RobotModel,
    Twist,
    World,
)

MODEL = QuasiStatic()
DRIVES = [
    (0.15, 1, 1.0),
    (0.15, 0, 0.2),
    *((0.02, delay, effect) for effect in (1.0, 0.2) for delay in (0, 8)),
]
"""Period [s], delay in periods, and the part of a command that has an effect."""
QUICK = [(0, 0.15, 0, 0.2), (5017, 0.15, 1, 1.0)]
REVERSING = {"drive": "differential", "min_speed": -0.1}


@functools.cache
def maze_testbed(seed: int, boxes: int = 6) -> World:
    """The start of an episode in the maze of the testbed."""
    scenario = Scenario("maze", "pymunk", "testbed", {"boxes": boxes}, seed)
    env = make(scenario, observation="state", action="velocity")
    env.reset(seed=seed)
    return env.world


@dataclass
class Unicycle:
    """An ideal robot among quasi-static boxes, which walls stop, with commands that act late."""

    world: World
    period: float
    delay: int = 0
    effect: float = 1.0  # of what it is told that it drives
    sent: deque = field(default_factory=deque)

    def drive(self, twist: Twist) -> None:
        self.sent.append(twist)
        now = self.sent.popleft() if len(self.sent) > self.delay else Twist(0.0, 0.0)
        x, y, theta = self.world.robot_pose
        length, turn = self.period * self.effect * np.array([now.linear, now.angular])
        middle = theta + 0.5 * turn
        there = np.array([x + length * np.cos(middle), y + length * np.sin(middle), theta + turn])
        swept = MODEL.sweep(self.world, [self.world.robot_pose, there])
        poses = swept.object_poses[-1]
        if swept.jammed_at >= 0:
            there, poses = self.world.robot_pose, self.world.movables.poses
        self.world = self.world.moved(
            robot_pose=there, movable_poses=poses, time=self.world.time + self.period
        )

    @property
    def arrived(self) -> bool:
        return self.world.goal.distance(*self.world.robot_pose[:2]) == 0.0


class Failing:
    """A planner that finds nothing in its first calls."""

    def __init__(self, calls: float) -> None:
        self.left, self.planner = calls, make_planner("push-aware")
        self.config = self.planner.config

    def plan(self, world, *, stop=None, rng=None):
        self.left -= 1
        if self.left >= 0:
            return PlanResult(PlanStatus.TIMED_OUT, None, PlanStats(0.0))
        return self.planner.plan(world, stop=stop, rng=rng)


def follower(failures: float = 0, controller=None) -> PlanFollower:
    return PlanFollower(Failing(failures), controller, stop=MaxIterations(3000))


def episode(policy: PlanFollower, robot: Unicycle, seconds: float) -> list[tuple[str, float]]:
    """Drive until the goal; what the robot did, and for how long in a row [s]."""
    policy.reset(robot.world, np.random.default_rng(0))
    doing = []
    while not robot.arrived and robot.world.time < seconds:
        before = robot.world.robot_pose
        twist = policy.act(robot.world)
        has_plan = policy.current_plan is not None
        robot.drive(twist)
        moved = np.abs(robot.world.robot_pose - before).max() > 1e-6
        doing.append(
            "recovers" if policy._recovery.is_on else "moves" if moved or not has_plan else "stands"
        )
    return [(what, robot.period * len(list(part))) for what, part in itertools.groupby(doing)]


@pytest.mark.parametrize("controller", [PathFollower, MpcTracker])
@pytest.mark.parametrize("failures", [6, pytest.param(40, marks=pytest.mark.slow)])
def test_a_plan_is_driven_however_many_were_not_found_before(failures, controller):
    robot = Unicycle(maze_testbed(5017), 0.15)
    episode(follower(failures, controller()), robot, 120.0)
    assert robot.arrived


@pytest.mark.parametrize(
    ("seed", "period", "delay", "effect"),
    [
        pytest.param(*case, marks=() if case in QUICK else pytest.mark.slow)
        for seed in (0, 5017, 1, 2)
        for case in [(seed, *rest) for rest in DRIVES]
    ],
)
def test_no_policy_stands_for_good_with_a_plan(seed, period, delay, effect):
    robot = Unicycle(maze_testbed(seed), period, delay, effect)
    policy = follower()
    done = episode(policy, robot, 60.0 / effect)
    assert robot.arrived
    assert max((t for what, t in done if what == "stands"), default=0.0) < 5.0
    assert max((t for what, t in done if what == "recovers"), default=0.0) < 10.0 / effect


def test_a_robot_recovers_although_fruitless_calls_follow_one_another():
    """It stands at a wall; from there no plan is found, and each call begins as the last ends."""
    robot, policy = Unicycle(maze_testbed(5017), 0.05), follower(12)
    policy.reset(robot.world, np.random.default_rng(0))
    ticks = itertools.count(step=0.5)  # a call takes so long
    policy.plan_with(SimulatedExecutor(1.0, lambda: next(ticks)))
    recovered = False
    while not robot.arrived and robot.world.time < 60.0:
        robot.drive(policy.act(robot.world))
        recovered = recovered or policy._recovery.is_on
    assert recovered and robot.arrived


def test_time_in_which_nobody_asks_is_no_lack_of_progress():
    world = maze_testbed(5017)
    rule = RecoveryRule(world)
    for step in range(40):  # it is told to stand for so long by somebody else
        assert rule.command(world.moved(time=0.05 * step), 0.05) is None
        if 0.05 * step > 0.5 * rule.patience:
            break
    assert rule.command(world.moved(time=60.0), 60.0) is None
    assert rule.idle < rule.patience


@pytest.mark.parametrize("seed", range(5010, 5020))
def test_a_recovery_ends_where_the_robot_cannot_move_and_where_it_can(seed):
    world = maze_testbed(seed)
    for effect in (0.0, 1.0):
        robot = Unicycle(world, 0.05, 0, effect)
        recovery = Recovery(world, world.robot.circumscribed_radius)
        while (twist := recovery.command(robot.world, robot.period)) is not None:
            robot.drive(twist)
            assert robot.world.time - world.time < 15.0


def test_a_recovery_drives_into_no_wall():
    shape, walls = footprint(maze_testbed(0).robot), obstacles(maze_testbed(0).static)
    checker = core.CollisionChecker(shape, walls)
    rng = np.random.default_rng(0)
    room, tried = maze_testbed(0).static.bounds, 0
    while tried < 40:
        pose = np.array([*rng.uniform(room[:2], room[2:]), rng.uniform(-np.pi, np.pi)])
        if checker.depth(pose) > 0.0:
            continue
        tried += 1
        robot = Unicycle(maze_testbed(0, 0).moved(robot_pose=pose), 0.1)
        recovery = Recovery(robot.world, robot.world.robot.circumscribed_radius)
        while (twist := recovery.command(robot.world, 0.1)) is not None:
            robot.drive(twist)
            here = np.array(robot.world.robot_pose)
            assert checker.depth(here) < 0.01 * shape.radius
        assert np.abs(robot.world.robot_pose - pose).max() > 0.5 * shape.radius


@pytest.mark.slow
def test_without_a_plan_it_recovers_a_few_times_and_is_stuck():
    robot = Unicycle(maze_testbed(5017), 0.1, effect=0.0)
    policy = follower(np.inf)
    policy.reset(robot.world, np.random.default_rng(0))
    began = []
    while robot.world.time < 120.0:
        was_on = policy._recovery.is_on
        twist = policy.act(robot.world)
        began += [robot.world.time] if policy._recovery.is_on and not was_on else []
        robot.drive(twist)
    assert policy.stuck and twist == Twist(0.0, 0.0)
    assert 1 <= len(began) <= 6 and began[-1] < 100.0
    assert len(policy.plan_log) < 120  # it goes on to look for a plan, ever less often
    policy.planner.left = 0
    robot.effect = 1.0
    while robot.world.time < 240.0 and not robot.arrived:
        robot.drive(policy.act(robot.world))
    assert robot.arrived and not policy.stuck


def test_a_new_place_is_a_new_start():
    world = make_u_maze(robot=make_robot(**REVERSING))
    rule, time = RecoveryRule(world), 0.0
    while not rule.stuck:
        rule.command(world.moved(time=(time := time + 1.0)), 1.0)
        assert time < 1000.0
    there = world.robot_pose + np.array([0.0, 3.0, 0.0])
    rule.command(world.moved(robot_pose=there, time=time + 1.0), 1.0)
    assert not rule.stuck and rule.idle == 0.0


def test_a_plan_is_driven_where_all_recoveries_are_used_up():
    world = make_u_maze(robot=make_robot(**REVERSING))

    class AheadOnly:
        def plan(self, world, *, stop=None, rng=None):
            x = np.linspace(0.0, 3.0, 31)
            poses = world.robot_pose + np.column_stack([0.0 * x, x, 0.0 * x])
            speeds = np.full(31, world.robot.max_speed)
            plan = Plan(
                times=x / speeds,
                poses=poses,
                speeds=speeds,
                turn_rates=0.0 * x,
                travel_cost=3.0,
                interaction_cost=0.0,
                object_poses=None,
            )
            return PlanResult(PlanStatus.SOLVED, plan, PlanStats(0.0))

    policy, time = PlanFollower(AheadOnly()), 0.0
    policy.reset(world, np.random.default_rng(0))
    seen = [policy.act(world.moved(time=(time := time + 0.5))).linear for _ in range(1200)]
    assert policy.stuck
    assert min(seen) < 0.0 and seen[-1] == world.robot.max_speed


@pytest.mark.parametrize("turn_rate", [0.05, 1.5])
def test_getting_on_is_told_from_swaying(turn_rate):
    robot: RobotModel = make_robot(**REVERSING, max_turn_rate=turn_rate)
    turning, swaying = PoseProgressChecker(robot), PoseProgressChecker(robot)
    swayed = True
    for step in range(2000):
        time = 0.05 * step
        assert turning.update(np.array([0.0, 0.0, turn_rate * time]), time)
        swayed &= swaying.update(0.1 * np.array([np.sin(time), 0.0, np.cos(time)]), time)
    assert not swayed and swaying.idle > 50.0


def test_a_robot_without_a_plan_does_not_run_away():
    class NoPlan:
        def plan(self, world, *, stop=None, rng=None):
            return PlanResult(PlanStatus.TIMED_OUT, None, PlanStats(0.0))

    for pose, backwards in (((1.3, 5.0, 0.0), False), ((11.25, 3.75, 0.5 * np.pi), True)):
        robot = Unicycle(make_u_maze(robot=make_robot(**REVERSING), robot_pose=pose), 0.2)
        policy, first = policy_for(NoPlan()), None
        while robot.world.time < 400.0:
            twist = policy.act(robot.world)
            first = first or (twist if twist != Twist(0.0, 0.0) else None)
            robot.drive(twist)
        assert first is not None and (first.linear < 0.0) == backwards
        assert policy.stuck and twist == Twist(0.0, 0.0)
        assert np.hypot(*(robot.world.robot_pose[:2] - pose[:2])) < 6.0


def test_without_a_plan_the_robot_asks_less_often_until_it_has_moved():
    asked = []

    class NoPlan:
        def plan(self, world, *, stop=None, rng=None):
            asked.append(world.time)
            return PlanResult(PlanStatus.TIMED_OUT, None, PlanStats(0.0))

    robot = make_robot(**REVERSING, max_speed=2.0)
    scene = Unicycle(make_u_maze(robot=robot, robot_pose=(1.3, 5.0, 0.0)), 0.05)
    policy = policy_for(NoPlan())
    recovered = math.inf
    while scene.world.time < recovered + 3.0:
        scene.drive(policy.act(scene.world))
        if policy._recovery.is_on:
            recovered = min(recovered, scene.world.time)
    first = asked[1] - asked[0]
    before = np.array([time for time in asked if time < recovered])
    after = [time for time in asked if time > recovered]
    assert len(before) > 3
    np.testing.assert_allclose(np.diff(before), first * 2.0 ** np.arange(len(before) - 1), atol=0.1)
    assert after[1] - after[0] == pytest.approx(first, abs=0.1)
