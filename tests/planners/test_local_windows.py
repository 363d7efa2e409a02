"""Far goals behind doors that a box stands in: searched in windows, not over the whole map."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plan_checks import check_plan

from pushplan.planners import make_planner
from pushplan.world import (
    FirstSolution,
    GoalDisc,
    MaxIterations,
    Movables,
    PlanStatus,
    StaticMap,
    World,
    turtlebot3_burger,
)
from pushplan.world.checks import FloatArray

PLANNERS = ("kinodynamic-rrt", "push-aware")
ROOM, WIDTH, WALL = 3.0, 2.0, 0.1  # [m]


def box(x: float, y: float, width: float, depth: float) -> FloatArray:
    """(4, 2) corners of a rectangle around a place [m]."""
    half = 0.5 * np.array([width, depth])
    return np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half + (x, y)


def rooms(seed: int, side: float = 0.4, door: float = 0.9, doors: int = 8) -> World:
    """Rooms in a row; a box of some side stands about in each door between two of them."""
    rng = np.random.default_rng(seed)
    walls, boxes = [], []
    for k in range(1, doors + 1):
        x, y = ROOM * k, rng.uniform(0.6, WIDTH - 0.6)
        low, high = y - 0.5 * door, y + 0.5 * door
        walls += [box(x, 0.5 * low, WALL, low), box(x, 0.5 * (high + WIDTH), WALL, WIDTH - high)]
        boxes.append(box(x, y, side, side) + rng.uniform(-0.05, 0.05, 2))
    length = ROOM * (doors + 1)
    return World(
        robot=turtlebot3_burger(),
        robot_pose=np.array([1.0, 1.0, 0.3]),
        static=StaticMap.build(walls, bounds=[0.0, 0.0, length, WIDTH]),
        movables=Movables.from_polygons(boxes, density=2.0),
        goal=GoalDisc(np.array([length - 1.0, 1.0]), 0.3),
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", PLANNERS)
@pytest.mark.parametrize(("side", "most"), [(0.4, 1_000), (0.7, 20_000)])
def test_a_way_through_many_doors_with_boxes_is_found_soon(
    name: str, side: float, most: int
) -> None:
    for seed in (1, 3, 5):
        world = rooms(seed, side)
        result = make_planner(name).plan(
            world, stop=FirstSolution() | MaxIterations(most), rng=np.random.default_rng(seed)
        )
        assert result.plan is not None, (seed, result.status)
        assert result.stats.iterations <= most
        check_plan(world, result.plan, result.status)


@pytest.mark.parametrize("name", PLANNERS)
def test_a_box_that_jams_in_front_of_the_only_door_ends_with_the_stop_rule(name: str) -> None:
    world = rooms(0)
    door = ROOM * 4 - 0.5 * WALL
    wide = Movables.from_polygons([box(door - 0.21, 0.5 * WIDTH, 0.4, WIDTH - 0.02)], density=2.0)
    shut = replace(world, movables=wide)
    result = make_planner(name).plan(shut, stop=MaxIterations(1_500))
    assert result.stats.iterations <= 1_500 + 10
    assert result.plan is None
    assert result.status is PlanStatus.TIMED_OUT


@pytest.mark.parametrize("name", PLANNERS)
@pytest.mark.parametrize("most", [1, 10, 100])
def test_iterations_in_windows_count(name: str, most: int) -> None:
    for seed in (1, 3):
        result = make_planner(name).plan(rooms(seed, 0.7), stop=MaxIterations(most))
        assert result.stats.iterations <= most + 10  # a batch of shortcuts is one look


def test_a_goal_that_hardly_peeks_out_of_a_grown_wall_is_reached_or_not_claimed() -> None:
    robot = turtlebot3_burger()
    rng = np.random.default_rng(0)
    solved = 0
    for _ in range(30):
        wall = box(20.0, 0.5, 42.0, 1.0)
        radius = rng.uniform(0.05, 0.6)
        peeks = 10.0 ** rng.uniform(-6.0, -4.0)
        beyond = 1.0 + 1.25 * robot.circumscribed_radius - radius + peeks
        world = World(
            robot=robot,
            robot_pose=np.array([1.0, 1.3, rng.uniform(-3.0, 3.0)]),
            static=StaticMap.build([wall], bounds=[-1.0, 0.0, 40.0, 3.0]),
            movables=Movables.empty(),
            goal=GoalDisc((20.0, beyond), radius),
        )
        result = make_planner("kinodynamic-rrt").plan(world, stop=MaxIterations(1))
        if result.plan is not None:
            solved += 1
            assert world.navigation_goal.reached_by(result.plan.poses[-1])
    assert solved
