"""The predictive tracker: how well it tracks, what it does when things go wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest
from conftest import make_robot, make_u_maze, quickest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_tracking_controllers import FLOOR, S_CURVE, arc_plan, distance_to, drive

from pushplan.control import MpcConfig, MpcTracker, PathFollower
from pushplan.control.mpc.tracker import track_of
from pushplan.world import Controller, InvalidInputError, Plan, Twist, World

SLOW_RUDDER = make_robot(max_turn_acceleration=0.02)


def start(**changes: object) -> World:
    return make_u_maze(static=FLOOR, **{"robot_pose": [0, 0, 0], **changes})


def drive_late(
    world: World, plan: Plan, controller: Controller, *, late: int, steps: int, period: float
) -> np.ndarray:
    """Follow the plan with commands that act some periods after they were given."""
    queue = [Twist(world.robot.max_speed, 0.0)] * late

    class Late:
        def command(self, world: World, plan: Plan) -> Twist:
            queue.append(controller.command(world, plan))
            return queue.pop(0)

    return drive(world, plan, Late(), period, steps)[0]


def test_it_is_a_controller():
    assert isinstance(MpcTracker(), Controller)


@pytest.mark.parametrize("period", [0.05, 0.2, 0.8])
def test_it_stays_on_a_curved_plan(period):
    world = start()
    plan = arc_plan(world, S_CURVE)
    poses, commands = drive(world, plan, MpcTracker(), period, round(72 / period))
    assert distance_to(plan, poses).max() < 0.055
    assert max(abs(c.angular) for c in commands) <= world.robot.max_turn_rate + 1e-12


@settings(max_examples=10)
@given(st.floats(-1.5, 1.5), st.floats(-1.4, 1.4))
def test_it_comes_back_to_the_plan(offset, turn):
    world = start()
    plan = arc_plan(world, [(14.0, 0.0)])
    tracker = MpcTracker()
    poses, _ = drive(world.moved(robot_pose=[0, offset, turn]), plan, tracker, 0.8, 110)
    assert np.abs(poses[-5:, 1]).max() < 0.02
    assert abs(poses[-1][2]) < 0.02
    assert tracker.fallbacks == 0


def test_a_robot_that_looks_the_wrong_way_turns_first():
    world = start(robot_pose=[0, 0, 3.0])
    plan = arc_plan(start(), [(6.0, 0.0)])
    assert MpcTracker().command(world, plan).angular == -world.robot.max_turn_rate


def test_it_begins_to_turn_before_the_bend():
    world = start(robot=SLOW_RUDDER)
    plan = arc_plan(world, [(3.0, 0.0), (3.0, 0.5), (3.0, 0.0)])
    errors = {}
    for controller in (MpcTracker(), PathFollower()):
        poses, commands = drive(world, plan, controller, 0.4, 145)
        errors[type(controller)] = distance_to(plan, poses).max()
        turns = np.diff([0.0, *(c.angular for c in commands)])
        assert np.abs(turns).max() <= 0.02 * 0.4 + 1e-6
    assert errors[MpcTracker] < 0.5 * errors[PathFollower]


def test_a_known_delay_is_made_up_for():
    world = start()
    plan = arc_plan(world, S_CURVE)
    known, unknown = (
        drive_late(world, plan, MpcTracker(MpcConfig(delay=delay)), late=4, steps=180, period=0.4)
        for delay in (1.6, 0.0)
    )
    assert distance_to(plan, known).max() < 0.5 * distance_to(plan, unknown).max()
    assert distance_to(plan, known).max() < 0.06


@pytest.mark.parametrize("optimise", [False, True])
def test_a_differential_drive_turns_first_and_stops_at_the_end(optimise):
    robot = make_robot(drive="differential", max_speed=0.3, max_turn_rate=1.0, max_acceleration=0.3)
    world = start(robot=robot)
    plan = arc_plan(world, S_CURVE)
    first = MpcTracker().command(world.moved(robot_pose=[0, 0, 2.5]), plan)
    assert first == Twist(0.0, -1.0)
    tracker = MpcTracker(MpcConfig(optimise_speed=optimise))
    poses, commands = drive(world, plan, tracker, 0.1, 420)
    assert distance_to(plan, poses).max() < 0.06
    assert np.hypot(*(poses[-1] - plan.poses[-1])[:2]) < 0.05
    assert commands[-1].linear == pytest.approx(0.0, abs=1e-3)
    speeds = np.diff([0.0, *(c.linear for c in commands)])
    assert np.abs(speeds).max() <= 0.3 * 0.1 + 1e-6
    assert tracker.fallbacks == 0


def test_lengths_in_metres_mean_nothing():
    """A robot of eighty times the size at eighty times the speed drives the same way."""
    small = start()
    robot = small.robot
    big_robot = type(robot)(
        parts=tuple(80.0 * part for part in robot.parts),
        mass=6e6,
        drive=robot.drive,
        max_speed=80.0 * robot.max_speed,
        max_turn_rate=robot.max_turn_rate,
    )
    big = start(robot=big_robot)
    curves = [(3.0, 0.0), (2.5, 0.6), (3.0, 0.0)]
    plan = arc_plan(small, curves)
    large = arc_plan(big, [(80 * a, b / 80) for a, b in curves], spacing=8.0)
    one, _ = drive(small.moved(robot_pose=[0, 0.4, 0]), plan, MpcTracker(), 0.4, 100)
    other, _ = drive(big.moved(robot_pose=[0, 32.0, 0]), large, MpcTracker(), 0.4, 100)
    assert other[:, :2] / 80.0 == pytest.approx(one[:, :2], abs=1e-4)


def test_the_same_tracker_can_serve_another_episode():
    world = start(robot=SLOW_RUDDER)
    plan = arc_plan(world, S_CURVE)
    used = MpcTracker()
    drive(world, plan, used, 0.8, 30)
    used.reset(world)
    again, _ = drive(world, plan, used, 0.8, 30)
    fresh, _ = drive(world, plan, MpcTracker(), 0.8, 30)
    assert again.tobytes() == fresh.tobytes()


def test_what_the_solver_does_not_call_solved_is_not_driven():
    world = start(robot=make_robot(max_turn_acceleration=0.2))
    plan = arc_plan(world, S_CURVE)
    tracker = MpcTracker(MpcConfig(solver_iterations=1))
    poses, commands = drive(world, plan, tracker, 0.4, 170)
    assert tracker.fallbacks > 80
    assert distance_to(plan, poses).max() < 0.5  # pure pursuit
    turns = np.diff([0.0, *(c.angular for c in commands)])
    assert np.abs(turns).max() <= 0.2 * 0.4 + 1e-9


@pytest.mark.parametrize("poses", [[[0, 0, 0]], [[0, 0, 0], [0, 0, 0], [0, 0, 0]]])
def test_a_plan_of_no_length(poses):
    still = np.array(poses, dtype=float)
    zeros = np.zeros(len(still))
    plan = Plan(times=zeros, poses=still, speeds=zeros, turn_rates=zeros, travel_cost=0.0)
    ahead = MpcTracker().command(start(), plan)
    assert (ahead.linear, ahead.angular) == (0.15, pytest.approx(0.0, abs=1e-9))
    wheels = make_robot(drive="differential")
    assert MpcTracker().command(start(robot=wheels), plan) == Twist(0.0, 0.0)


@pytest.mark.parametrize(("drive", "speed"), [("differential", 0.0), ("constant_speed", 0.15)])
def test_a_pose_that_is_not_finite_is_refused_and_the_core_stops(drive, speed):
    world = start(robot=make_robot(drive=drive))
    plan = arc_plan(world, S_CURVE)
    tracker = MpcTracker()
    tracker.command(world, plan)
    with pytest.raises(InvalidInputError, match="robot_pose"):
        world.moved(robot_pose=[math.nan, 0.0, 0.0])
    # a pose that no world would hold, as from a C++ localisation
    lost = tracker._tracker.follow(track_of(plan), np.full(3, math.nan), 0.1, 0.1)
    assert lost == (speed, 0.0)


def test_a_command_is_quick():
    world = start()
    plan = arc_plan(world, S_CURVE)
    tracker = MpcTracker()
    seen = [world.moved(robot_pose=plan.poses[n // 2], time=0.3 * n) for n in range(120)]
    steps = iter(seen)
    assert quickest(lambda: tracker.command(next(steps), plan), 120) < 1.5e-3


@pytest.mark.parametrize(
    "changes",
    [
        {"horizon": 1},
        {"horizon": 2.5},
        {"reach": 0.0},
        {"smoothness": 0.0},
        {"heading_weight": -1.0},
        {"delay": math.nan},
        {"delay": -0.1},
        {"terminal": 0.5},
        {"optimise_speed": "yes"},
        {"iterations": 0},
        {"tolerance": 0.0},
    ],
)
def test_bad_parameters(changes):
    with pytest.raises(InvalidInputError, match=next(iter(changes))):
        MpcConfig(**changes)
