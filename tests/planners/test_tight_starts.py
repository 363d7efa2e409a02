"""Starts from which no forward arc leads on: a plan out of them, or a true status at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plan_checks import check_plan

from pushplan.planners import make_planner
from pushplan.world import (
    Drive,
    FirstSolution,
    GoalDisc,
    GoalLine,
    MaxIterations,
    Movables,
    PlanStatus,
    RobotModel,
    StaticMap,
    World,
    jackal,
    turtlebot3_burger,
)

SOON = FirstSolution() | MaxIterations(8000)
PLANNERS = ("kinodynamic-rrt", "push-aware", "namo")
ROBOTS = {
    "burger": turtlebot3_burger(),
    "jackal": jackal(),
    "with a pusher": turtlebot3_burger("pusher", min_speed=-0.05),
}
GOALS = {
    "behind": GoalDisc([-12.0, 0.0], 0.5),
    "beside": GoalDisc([-2.0, 12.0], 0.5),
    "beyond": GoalDisc([7.0, 0.0], 0.6),
    "line": GoalLine([-14.0, 0.0], [-1.0, 0.0]),
}
WALLS = ("front", "corner", "pocket", "dead end", "aisle")


def unit_sized(robot: RobotModel) -> RobotModel:
    """The same robot with a circumscribed radius of 1 m."""
    scale = 1.0 / robot.circumscribed_radius
    parts = tuple(scale * part for part in robot.parts)
    return replace(
        robot,
        parts=parts,
        max_speed=scale * robot.max_speed,
        min_speed=scale * robot.min_speed,
        max_acceleration=scale * robot.max_acceleration,
    )


def box(x0: float, y0: float, x1: float, y1: float) -> np.ndarray:
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def boxed_in(robot: RobotModel, walls: str, part: float, goal: str) -> World:
    """A robot with its nose at a wall; gaps are a part of what it needs to turn."""
    robot = unit_sized(robot)
    low, high = robot.vertices.min(axis=0), robot.vertices.max(axis=0)
    gap, side = part * (1.0 - high[0]), part * (1.0 - high[1])
    near, left = high[0] + gap, high[1] + side
    polygons = [box(near, -10, near + 0.5, 10)]
    depth = {"pocket": 2.0, "dead end": 7.0}.get(walls, 10.0)
    if walls in ("corner", "pocket", "dead end"):
        polygons.append(box(-depth, left, near, left + 0.5))
    if walls in ("pocket", "dead end"):
        polygons.append(box(-depth, -left - 0.5, near, -left))
    if walls == "aisle":
        polygons.append(box(low[0] - 1.5 - gap, -10, low[0] - 1.0 - gap, 10))
    static = StaticMap.build(polygons=polygons, bounds=[-20, -20, 20, 20])
    return World(robot, [0.0, 0.0, 0.0], static, Movables.empty(), GOALS[goal])


CASES = [
    (robot, walls, part, goal)
    for i, robot in enumerate(ROBOTS)
    for j, walls in enumerate(WALLS)
    for k, part in enumerate((0.0, 0.1, 0.5, 0.9))
    for m, goal in enumerate(GOALS)
    if (i + j + k + m) % 4 == 0
]
FEW = [
    pytest.param(*case, marks=[] if n % 24 == 0 else pytest.mark.slow)
    for n, case in enumerate(CASES)
]


@pytest.mark.parametrize(("robot", "walls", "part", "goal"), FEW)
def test_a_differential_drive_backs_out_of_a_tight_start(robot, walls, part, goal):
    world = boxed_in(ROBOTS[robot], walls, part, goal)
    for name in PLANNERS:
        result = make_planner(name).plan(world, stop=SOON)
        assert result.status is PlanStatus.SOLVED, name
        check_plan(world, result.plan, result.status)


def test_it_backs_out_between_objects_and_moves_none_where_it_can():
    world = boxed_in(ROBOTS["burger"], "front", 0.0, "behind")
    size = 0.3 * box(-1, -1, 1, 1)
    places = [[-2.2, 0.0, 0.0], [0.0, 1.4, 0.0], [0.0, -1.4, 0.0]]
    world = replace(world, movables=Movables.from_outlines([size] * 3, places))
    for name in PLANNERS[:2]:
        result = make_planner(name).plan(world, stop=SOON)
        assert result.status is PlanStatus.SOLVED, name
        check_plan(world, result.plan, result.status)
        back = result.plan.speeds < 0.0
        assert back.any()
        moved = np.abs(result.plan.object_poses[back] - world.movables.poses).max()
        assert moved <= 1e-9


@pytest.mark.parametrize("name", PLANNERS[:2])
def test_a_robot_that_nothing_gets_away_is_said_to_be_blocked_at_once(name):
    stuck = boxed_in(replace(ROBOTS["burger"], min_speed=0.0), "pocket", 0.05, "behind")
    robot = stuck.robot
    car = replace(robot, drive=Drive.CAR, min_turning_radius=1.0, min_speed=-robot.max_speed)
    lid = box(-1.0, -5, -0.8, 5)  # behind the robot, with a gap that is too narrow for it
    slit = np.array([0.0, 5.3])
    polygons = [*stuck.static.polygons, lid - slit, lid + slit]
    shut = StaticMap.build(polygons=polygons, bounds=stuck.static.bounds)
    reverses = replace(robot, min_speed=-robot.max_speed)
    for world in (
        stuck,
        replace(stuck, robot=reverses, static=shut),
        replace(stuck, robot=car, static=shut),
    ):
        result = make_planner(name).plan(world, stop=FirstSolution() | MaxIterations(50_000))
        assert result.status in (PlanStatus.START_BLOCKED, PlanStatus.GOAL_UNREACHABLE)
        assert result.stats.iterations < 5000
    assert "room ahead" in PlanStatus.START_BLOCKED.remedy
