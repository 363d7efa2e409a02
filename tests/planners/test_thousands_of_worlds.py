"""What a status says of a plan is true in any world, and does not depend on where that lies.

    python -m pytest tests/planners/test_thousands_of_worlds.py -m slow --worlds 3000

asks every planner in so many worlds; `random_worlds` makes them and `plan_checks` judges the plans.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from plan_checks import check_no_way, check_plan
from random_worlds import driven_world, random_world, similar

from pushplan.motion.polyline_plan import polyline_plan, polyline_status
from pushplan.planners import make_planner, planner_names
from pushplan.world import (
    FirstSolution,
    GoalDisc,
    GoalPose,
    MaxIterations,
    Movables,
    PlanResult,
    PlanStatus,
    StaticMap,
    World,
)

CHANCE = ("geometric-rrt", "kinodynamic-rrt", "push-aware", "namo")
"""Planners that draw places between the bounds: turned, they draw others."""
AS_PUBLISHED = "ship-lattice-published"
"""Its cost adds kilograms to metres, so that another unit of length gives another path."""
ITERATIONS = {"ship-predictive-published": 40}
PLANNERS = planner_names()
COUNTS = [4, pytest.param(150, marks=pytest.mark.slow)]
BOATS = {name: 200 for name in PLANNERS if name.startswith("ship")}
BOATS |= {"ship-predictive-network": 20, "ship-predictive-published": 20}
"""Worlds of the planners of ships, whose calls take up to a second."""
MANY = [
    *((name, 40) for name in PLANNERS if name not in BOATS),
    *(pytest.param(name, BOATS.get(name, 2000), marks=pytest.mark.slow) for name in PLANNERS),
]
FEW = [2, pytest.param(40, marks=pytest.mark.slow)]


@pytest.fixture
def worlds(request: pytest.FixtureRequest, count: int) -> int:
    """How many worlds to look at: the test's own number, or what the command asks for."""
    return int(request.config.getoption("--worlds") or count)


def planned(name: str, world: World, seed: int) -> PlanResult:
    """A short call, whose plan is checked."""
    stop = FirstSolution() | MaxIterations(ITERATIONS.get(name, 400))
    result = make_planner(name).plan(world, stop=stop, rng=np.random.default_rng(seed))
    assert (result.plan is not None) == result.status.has_plan
    if result.plan is not None:
        check_plan(world, result.plan, result.status)
    if result.status is PlanStatus.GOAL_UNREACHABLE:
        check_no_way(world, seed)
    return result


def cost(result: PlanResult) -> float:
    """Travel of the plan [kg m], 0 where there is none."""
    return 0.0 if result.plan is None else result.plan.travel_cost


def check_worlds(name: str, worlds: int, make: Callable[[int, str], World]) -> None:
    """Plan in so many worlds; what is wrong is said of all of them."""
    found, wrong = 0, []
    for seed in range(worlds):
        try:
            found += planned(name, make(seed, name), seed).status.has_plan
        except AssertionError as error:
            wrong.append(f"world {seed}: {error}")
    assert not wrong, "\n".join(wrong)
    assert found >= 0.3 * worlds


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("name", PLANNERS)
def test_a_plan_is_what_its_status_says(name: str, worlds: int) -> None:
    check_worlds(name, worlds, random_world)


@pytest.mark.parametrize(("name", "count"), MANY)
def test_so_it_is_for_every_drive_goal_and_shape(name: str, worlds: int) -> None:
    check_worlds(name, worlds, driven_world)


@pytest.mark.parametrize("count", FEW)
@pytest.mark.parametrize("name", PLANNERS)
def test_another_unit_of_length_changes_nothing(name: str, worlds: int) -> None:
    """Powers of two scale without rounding, so that statuses and costs are exactly the same."""
    for seed in range(worlds):
        world = random_world(seed, name)
        first = planned(name, world, seed)
        for scale in (2.0**-10, 2.0**10):
            again = planned(name, similar(world, scale=scale), seed)
            if name != AS_PUBLISHED:
                assert again.status is first.status, f"world {seed} times {scale}"
                assert cost(again) == pytest.approx(scale * cost(first), rel=1e-9), f"world {seed}"


@pytest.mark.parametrize("count", FEW)
@pytest.mark.parametrize("name", PLANNERS)
def test_another_origin_or_north_changes_nothing(name: str, worlds: int) -> None:
    """Coordinates round, and what is nearly equal may change places: costs only nearly agree."""
    others = costlier = 0
    for seed in range(worlds):
        rng = np.random.default_rng([seed, 1])
        world, angle = random_world(seed, name), rng.uniform(0.0, 2.0 * np.pi)
        away = 10.0 ** rng.uniform(3.0, 6.0)
        shift = (away * np.cos(angle), away * np.sin(angle))
        first = planned(name, world, seed)
        moved = planned(name, similar(world, shift=shift), seed)
        turned = planned(name, similar(world, turns=int(rng.integers(1, 4))), seed)
        for again in (moved, turned):
            if again is turned and name in CHANCE:
                known = {PlanStatus.START_BLOCKED, PlanStatus.GOAL_UNREACHABLE}
                assert (again.status in known) == (first.status in known), f"world {seed}"
                others += again.status.has_plan is not first.status.has_plan
                continue
            others += again.status is not first.status
            costlier += abs(cost(again) - cost(first)) > 0.03 * cost(first)
    assert others <= (0.1 if name in CHANCE else 0.01) * worlds
    assert costlier <= 0.02 * worlds


def test_a_path_for_a_point_is_solved_only_where_the_robot_can_drive_it() -> None:
    free = StaticMap.build(bounds=[0, 0, 10, 10])
    robot, goal = random_world(7).robot, GoalDisc([8.0, 5.0], 0.5)
    ahead = World(robot, [2.0, 5.0, 0.0], free, Movables.empty(), goal)
    assert planned("straight", ahead, 0).status is PlanStatus.SOLVED
    for name in ("straight", "skeleton", "geometric-rrt"):
        turned = ahead.moved(robot_pose=[2.0, 5.0, 1.0])
        assert planned(name, turned, 0).status is PlanStatus.PATH_ONLY


def test_a_path_of_ones_own_that_ends_short_of_the_goal_is_approximate() -> None:
    free = StaticMap.build(bounds=[0, 0, 10, 10])
    poses = {"place": [8.0, 5.0], "short": [6.0, 5.0]}
    goals = {
        "disc": GoalDisc(poses["place"], 0.5),
        "ahead": GoalPose(poses["place"], 0.5, 0.0, 0.1),
        "aside": GoalPose(poses["place"], 0.5, 1.0, 0.1),
    }
    ends = {}
    for name, goal in goals.items():
        world = World(random_world(7).robot, [2.0, 5.0, 0.0], free, Movables.empty(), goal)
        for end, place in poses.items():
            plan = polyline_plan(world, np.array([[2.0, 5.0], place]), 0.1)
            ends[name, end] = polyline_status(world, plan)
    arrive = {key for key, status in ends.items() if status is PlanStatus.SOLVED}
    assert arrive == {("disc", "place"), ("ahead", "place")}
    assert {ends[key] for key in ends.keys() - arrive} == {PlanStatus.APPROXIMATE}


@pytest.mark.parametrize("seed", [12, 19, 167, 713, 1285])
def test_a_ship_has_a_way_where_another_planner_knows_one(seed: int) -> None:
    """The tightest turn fits to neither side, or the beam ends before the line."""
    world = random_world(seed, "ship-predictive")
    result = make_planner("ship-predictive").plan(world)
    assert result.status is PlanStatus.SOLVED
    assert result.plan is not None
    check_plan(world, result.plan, result.status)
