"""Plans to a pose end at its place and heading, each drive in its own way."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from conftest import SQUARE
from plan_checks import check_plan

from pushplan.core import motion as core
from pushplan.motion.collision import footprint, obstacles
from pushplan.planners import make_planner, make_policy
from pushplan.world import (
    Drive,
    GoalPose,
    InvalidInputError,
    MaxIterations,
    Movables,
    PlanStatus,
    RobotModel,
    StaticMap,
    World,
)

TOLERANCES = 0.02, math.radians(3.0)
OUTLINE = [[0.25, 0.2], [-0.25, 0.2], [-0.25, -0.2], [0.25, -0.2]]
DRIVES = {
    "differential": {},
    "constant_speed": {},
    "car": {"min_turning_radius": 0.5},
}
NEVER = 10**6


def robot(drive="differential", **other):
    limits = {"mass": 10.0, "max_speed": 0.5, "max_turn_rate": 1.5, **DRIVES[drive]}
    return RobotModel.from_outline(OUTLINE, drive=drive, **limits | other)


def room(heading, drive="differential", walls=(), **other):
    """A room of 8 by 8 m with a wall in the middle, and a goal behind it."""
    middle = np.array([[2.0, 3.9], [8.0, 3.9], [8.0, 4.1], [2.0, 4.1]])
    static = StaticMap.build(polygons=[middle, *walls], bounds=[0, 0, 8, 8])
    parts = {
        "movables": Movables.empty(),
        "goal": GoalPose([6, 6], TOLERANCES[0], heading, TOLERANCES[1]),
    }
    parts = {"robot": robot(drive), **parts}
    return World(static=static, **{"robot_pose": [6.0, 2.0, 0.3]} | parts | other)


def plan(world, planner="kinodynamic-rrt", iterations=3000):
    result = make_planner(planner).plan(
        world, stop=MaxIterations(iterations), rng=np.random.default_rng(0)
    )
    return result.status, result.plan


@pytest.mark.parametrize("heading", [0.0, 1.6, -2.5])
@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("planner", ["straight", "kinodynamic-rrt", "push-aware"])
def test_plans_end_at_the_pose_and_touch_nothing(planner, drive, heading):
    world = room(heading, drive)
    status, found = plan(world, planner, NEVER if planner == "straight" else 3000)
    drivable = planner != "straight" or drive == "car"
    assert status is (PlanStatus.SOLVED if drivable else PlanStatus.PATH_ONLY)
    assert world.goal.reached_by(found.poses[-1])
    if drivable:
        checker = core.CollisionChecker(footprint(world.robot), obstacles(world.static))
        assert checker.first_blocked(found.poses) == len(found.poses)
    kinds = [stage.direction for stage in found.stages]
    assert kinds[-1] == (0 if drive == "differential" else 1)
    if drive != "differential" and drivable:
        bends = np.abs(found.turn_rates) / found.speeds
        assert bends.max() <= 1.0 / world.robot.turning_radius + 1e-9


@pytest.mark.parametrize("planner", ["straight", "kinodynamic-rrt", "push-aware"])
def test_without_room_to_turn_a_curve_leads_into_the_pose(planner):
    dock = [np.array([[5.0, y], [7.0, y], [7.0, y + 0.1], [5.0, y + 0.1]]) for y in (5.68, 6.22)]
    world = room(0.0, walls=dock)
    status, found = plan(world, planner, NEVER if planner == "straight" else 6000)
    assert status.has_plan and status is not PlanStatus.APPROXIMATE
    assert world.goal.reached_by(found.poses[-1])
    last = found.stages[-1]
    turned = np.abs(np.diff(found.poses[last.first : last.last + 1, 2])).sum()
    assert last.direction == 1 or turned < 0.1


@pytest.mark.parametrize("drive", ["differential", "car"])
@pytest.mark.parametrize("planner", ["kinodynamic-rrt", "push-aware"])
def test_a_robot_that_may_reverse_backs_into_a_dock(planner, drive):
    closed = [[6.35, 5.6], [6.45, 5.6], [6.45, 6.4], [6.35, 6.4]]
    dock = [
        [[5.3, 5.66], [6.4, 5.66], [6.4, 5.76], [5.3, 5.76]],
        [[5.3, 6.24], [6.4, 6.24], [6.4, 6.34], [5.3, 6.34]],
    ]
    world = room(math.pi, walls=[closed, *dock], robot=robot(drive, min_speed=-0.3))
    status, found = plan(world, planner, 6000)
    assert status is PlanStatus.SOLVED
    assert world.goal.reached_by(found.poses[-1])
    assert found.stages[-1].direction == -1
    checker = core.CollisionChecker(footprint(world.robot), obstacles(world.static))
    assert checker.first_blocked(found.poses) == len(found.poses)


@pytest.mark.parametrize("planner", ["straight", "kinodynamic-rrt", "push-aware"])
def test_a_robot_in_its_place_only_turns(planner):
    world = room(2.5, robot_pose=[6.0, 6.005, -3.0])
    status, found = plan(world, planner)
    assert status is PlanStatus.SOLVED
    assert found.length == 0.0
    assert world.goal.reached_by(found.poses[-1])
    turned = np.abs(np.diff(found.poses[:, 2])).sum()
    assert turned == pytest.approx(2.0 * math.pi - 5.5)  # the shorter way


@pytest.mark.parametrize("planner", ["kinodynamic-rrt", "push-aware"])
def test_a_pose_in_a_wall_cannot_be_reached(planner):
    wall = np.array([[5.9, 6.22], [6.1, 6.22], [6.1, 6.4], [5.9, 6.4]])
    assert plan(room(0.0, walls=[wall]), planner)[0] is PlanStatus.SOLVED
    assert plan(room(1.5, walls=[wall]), planner)[0] is PlanStatus.GOAL_UNREACHABLE


@pytest.mark.parametrize("planner", ["kinodynamic-rrt", "push-aware"])
def test_a_robot_at_its_place_has_no_plan_that_begins_at_another_heading(planner):
    tractor = RobotModel.from_outline(
        0.5 * SQUARE + [0.6, 0.0],
        mass=1.0,
        max_speed=0.15,
        max_turn_rate=0.5,
        drive=Drive.OMNIDIRECTIONAL,
    )
    goal = GoalPose([4.0, 7.98], 0.3, -1.7, 0.02)
    world = room(0.0, robot=tractor, robot_pose=[4.0, 7.98, 0.2], goal=goal)
    status, found = plan(world, planner)
    assert (found is None) is not status.has_plan
    if found is not None:
        check_plan(world, found, status)


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("planner", ["kinodynamic-rrt", "push-aware"])
def test_a_robot_that_does_not_fit_in_the_middle_ends_beside_it(planner, drive):
    post = np.array([[6.1, 6.05], [6.4, 6.05], [6.4, 6.4], [6.1, 6.4]])
    goal = GoalPose([6.0, 6.0], 0.4, 0.0, 0.5)
    world = room(0.0, drive, walls=[post], goal=goal)
    status, found = plan(world, planner)
    assert status is PlanStatus.SOLVED
    check_plan(world, found, status)
    narrow = GoalPose([6.0, 6.0], 0.1, 0.0, 0.1)
    assert plan(replace(world, goal=narrow), planner)[0] is PlanStatus.GOAL_UNREACHABLE


def test_a_box_beside_the_goal_is_predicted_to_be_turned_away():
    box = Movables.from_outlines([0.08 * SQUARE], [[6.32, 6.0, 0.0]])
    status, found = plan(room(3.0, movables=box))
    assert status is PlanStatus.SOLVED
    assert found.interaction_cost > 0.0
    assert not np.allclose(found.object_poses[-1], found.object_poses[0])


@pytest.mark.parametrize("name", ["ship-lattice", "ship-predictive"])
def test_a_planner_of_places_says_so(name):
    with pytest.raises(InvalidInputError, match="GoalPose"):
        plan(room(0.0, "constant_speed"), name, 10)


def test_a_policy_of_places_says_so():
    with pytest.raises(InvalidInputError, match="GoalPose"):
        make_policy("mppi", samples=8).act(room(0.0))
