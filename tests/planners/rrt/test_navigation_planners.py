"""Contracts of every navigation planner, and what the kinodynamic one promises."""

from __future__ import annotations

import hashlib
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import make_boxes, make_robot, make_u_maze, quickest, scattered_boxes, solved_by
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Polygon
from shapely.ops import unary_union

from pushplan.interaction import QuasiStatic
from pushplan.planners import make_planner, planner_names
from pushplan.planners.rrt import KinodynamicRRT, KinodynamicRRTConfig
from pushplan.world import (
    Cancellation,
    Deadline,
    FirstSolution,
    GoalDisc,
    GoalLine,
    InvalidInputError,
    MaxIterations,
    Planner,
    PlanStatus,
    Receptacle,
    StaticMap,
    UnknownNameError,
    World,
)
from pushplan.world.outline import transform

BUDGET = MaxIterations(1200)
QUICK = MaxIterations(80_000) | FirstSolution()


def generator(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize("name", planner_names(open_water=False))
class TestEveryPlanner:
    def test_it_is_a_planner(self, name):
        assert isinstance(make_planner(name), Planner)

    def test_a_plan_leads_from_the_robot_to_the_goal(self, name, u_maze):
        result = make_planner(name).plan(u_maze, stop=QUICK, rng=generator(0))
        assert result.status is solved_by(name)[-1]
        plan = result.plan
        assert plan.poses[0, :2] == pytest.approx(u_maze.robot_pose[:2])
        assert u_maze.goal.distance(*plan.poses[-1, :2]) <= 1e-6
        assert plan.length == pytest.approx(plan.travel_cost / u_maze.robot.mass, rel=1e-6)

    def test_same_seed_same_plan(self, name, u_maze):
        planner = make_planner(name)
        first, second = (planner.plan(u_maze, stop=BUDGET, rng=generator(4)) for _ in range(2))
        assert first.plan == second.plan

    def test_no_boxes(self, name):
        assert make_planner(name).plan(make_u_maze(), stop=QUICK).status in solved_by(name)

    def test_a_sealed_goal_is_reported(self, name):
        walls = [[0, 0, 15, 0], [0, 0, 0, 15], [15, 0, 15, 15], [0, 15, 15, 15], [7.5, 0, 7.5, 15]]
        world = make_u_maze(static=StaticMap.build(segments=walls, radii=0.5))
        result = make_planner(name).plan(world, stop=MaxIterations(500))
        assert result.status in (PlanStatus.GOAL_UNREACHABLE, PlanStatus.TIMED_OUT)
        assert result.plan is None

    @pytest.mark.usefixtures("cpu_time")
    def test_it_keeps_its_deadline(self, name):
        world = make_u_maze(scattered_boxes(10, 1))
        planner = make_planner(name)
        took = quickest(lambda: planner.plan(world, stop=Deadline(0.05)))
        assert took < 0.05 + 0.05

    def test_the_snapshot_is_left_alone(self, name, u_maze):
        before = hash(u_maze)
        make_planner(name).plan(u_maze, stop=BUDGET)
        for kept in ("_hash", "_content"):
            u_maze.__dict__.pop(kept)
        assert hash(u_maze) == before


@pytest.mark.parametrize("name", ["geometric-rrt", "kinodynamic-rrt"])
def test_a_start_inside_a_wall_is_reported(name):
    world = make_u_maze(robot_pose=[7.5, 3.0, 0.0])
    assert make_planner(name).plan(world, stop=BUDGET).status is PlanStatus.START_BLOCKED


@pytest.mark.usefixtures("cpu_time")
@pytest.mark.parametrize("name", ["geometric-rrt", "kinodynamic-rrt"])
def test_cancelling_ends_the_call(name):
    token = Cancellation()
    threading.Timer(0.05, token.cancel).start()
    world = make_u_maze(scattered_boxes(10, 1))
    began = time.perf_counter()
    result = make_planner(name).plan(world, stop=token)
    assert time.perf_counter() - began < 2.0
    assert result.status in (PlanStatus.CANCELLED, PlanStatus.SOLVED)
    assert make_planner(name).plan(world, stop=token).status is PlanStatus.CANCELLED


def check_plan(world: World, result, planner: KinodynamicRRT) -> None:
    """A plan is free of walls, within the turn limit, consistent, and priced as predicted."""
    plan = result.plan
    walls = unary_union([Polygon(part) for part in world.static.convex_parts])
    for pose in plan.poses[::2]:
        for part in world.robot.parts:
            assert Polygon(transform(pose, part)).intersection(walls).area < 1e-9
    robot = world.robot
    steps = np.diff(plan.times)
    turns = (np.diff(plan.poses[:, 2]) + np.pi) % (2 * np.pi) - np.pi
    assert np.all(np.abs(turns) <= robot.max_turn_rate * steps + 1e-6)
    assert np.all(np.abs(plan.turn_rates) <= robot.max_turn_rate + 1e-9)
    moves = np.hypot(*np.diff(plan.poses[:, :2], axis=0).T)
    assert np.all(moves <= robot.max_speed * steps + 1e-6)
    bearings = np.arctan2(*np.diff(plan.poses[:, :2], axis=0).T[::-1])
    slip = (bearings - plan.poses[:-1, 2] - 0.5 * turns + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(slip[moves > 1e-6]).max(initial=0.0) < 1e-3  # it drives where it looks
    predicted = planner.interaction.sweep(world, plan.poses)
    assert predicted.jammed_at == -1
    assert plan.interaction_cost == pytest.approx(predicted.work, rel=0.02, abs=0.02)


@pytest.mark.slow
@settings(max_examples=40)
@given(st.integers(0, 100_000), st.integers(0, 12))
def test_kinodynamic_plans_can_be_driven(seed, boxes):
    world = make_u_maze(scattered_boxes(boxes, seed))
    planner = KinodynamicRRT()
    result = planner.plan(world, stop=QUICK, rng=generator(seed))
    assert result.status is PlanStatus.SOLVED
    check_plan(world, result, planner)


def test_more_iterations_never_cost_more():
    world = make_u_maze(scattered_boxes(8, 5))
    costs = []
    for budget in (600, 1500, 4000):
        plan = KinodynamicRRT().plan(world, stop=MaxIterations(budget), rng=generator(1)).plan
        costs.append(plan.travel_cost + 3.0 * plan.interaction_cost)
    assert costs[0] >= costs[1] >= costs[2]


def test_the_price_of_pushing_is_respected():
    # one box in the middle of a corridor: cheap pushing goes through, dear pushing goes round
    walls = StaticMap.build(
        segments=[[0, 0, 16, 0], [0, 6, 16, 6]], radii=0.1, bounds=[0, 0, 16, 6]
    )
    world = make_u_maze(
        [[8, 3, 0.0]], static=walls, robot_pose=[1.5, 3, 0], goal=GoalDisc([14.5, 3], 1.0)
    )

    def plan(weight):
        planner = KinodynamicRRT(KinodynamicRRTConfig(push_weight=weight))
        return planner.plan(world, stop=MaxIterations(3000), rng=generator(0)).plan

    cheap, dear = plan(0.0), plan(20.0)
    assert cheap.travel_cost < dear.travel_cost
    assert dear.interaction_cost < 0.05
    assert cheap.length == pytest.approx(12.0, abs=0.15)


def test_it_pushes_through_when_there_is_no_way_round():
    walls = StaticMap.build(
        segments=[[0, 0, 16, 0], [0, 3, 16, 3]], radii=0.1, bounds=[0, 0, 16, 3]
    )
    world = make_u_maze(
        [[6, 1.5, 0.2]], static=walls, robot_pose=[1.5, 1.5, 0], goal=GoalDisc([14, 1.5], 1.0)
    )
    result = KinodynamicRRT().plan(world, stop=MaxIterations(3000))
    assert result.status is PlanStatus.SOLVED
    assert result.plan.interaction_cost > 0.4  # it shoves the box aside


def test_a_goal_line_and_a_differential_drive():
    robot = make_robot(drive="differential", max_speed=0.22, max_turn_rate=2.84)
    world = make_u_maze([[10, 9, 0]], robot=robot, goal=GoalLine([0, 12], [0, 1]))
    result = KinodynamicRRT().plan(world, stop=BUDGET)
    assert result.status is PlanStatus.SOLVED
    assert result.plan.poses[-1, 1] >= 12.0
    check_plan(world, result, KinodynamicRRT())
    assert result.plan.length < 8.25 + 0.6


def test_a_robot_in_the_goal_stays():
    result = KinodynamicRRT().plan(make_u_maze(robot_pose=[3.75, 3.0, 1.0]))
    assert result.status is PlanStatus.SOLVED
    assert result.plan.length == 0.0


def test_a_robot_that_touches_a_box_and_one_near_a_wall_can_start():
    for pose, boxes in (
        ([11.25, 3.75, np.pi / 2], [[11.25, 4.9, 0.0]]),
        ([13.88, 6.0, np.pi / 2], []),
    ):
        world = make_u_maze(boxes, robot_pose=pose)
        assert KinodynamicRRT().plan(world, stop=MaxIterations(3000)).status is PlanStatus.SOLVED


@pytest.mark.usefixtures("cpu_time")
@pytest.mark.slow
def test_hundreds_of_boxes_do_not_break_the_stop_rule():
    spots = [[x, y, 0.1] for x in np.arange(1, 14.2, 0.75) for y in np.arange(5.5, 14.2, 0.75)]
    small = [spot for spot in spots if abs(spot[0] - 7.5) > 1.0 or spot[1] > 11]
    outline = 0.25 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    from pushplan.world import Movables

    crowd = Movables.from_outlines([outline] * len(small), np.array(small))
    assert len(crowd) > 140
    world = make_u_maze(movables=crowd)
    planner = KinodynamicRRT()
    began = time.perf_counter()
    result = planner.plan(world, stop=Deadline(1.0))
    assert time.perf_counter() - began < 1.5
    assert result.status in (PlanStatus.SOLVED, PlanStatus.TIMED_OUT)


def test_plans_are_the_same_in_another_process():
    code = (
        "import sys; sys.path.insert(0, 'tests')\n"
        "from conftest import *\nfrom pushplan.planners import make_planner, MaxIterations\n"
        "w = make_u_maze(scattered_boxes(5, 2))\n"
        "p = make_planner('kinodynamic-rrt').plan(w, stop=MaxIterations(700))\n"
        "import hashlib; print(hashlib.sha256(p.plan.poses.tobytes()).hexdigest())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    world = make_u_maze(scattered_boxes(5, 2))
    plan = make_planner("kinodynamic-rrt").plan(world, stop=MaxIterations(700)).plan
    assert done.stdout.strip() == hashlib.sha256(plan.poses.tobytes()).hexdigest()


def test_goals_for_objects_are_refused():
    box = [[1, 1], [2, 1], [2, 2], [1, 2]]
    with pytest.raises(InvalidInputError, match="goal for the robot"):
        KinodynamicRRT().plan(make_u_maze(goal=Receptacle(box)))


def test_unknown_names_list_the_choices():
    with pytest.raises(UnknownNameError, match="did you mean 'kinodynamic-rrt'"):
        make_planner("kinodynamic_rrt")


@pytest.mark.parametrize(
    "options",
    [{"push_weight": -1}, {"turn_fraction": 0}, {"margin": 2}, {"default_iterations": 0}],
)
def test_bad_parameters(options):
    with pytest.raises(InvalidInputError):
        KinodynamicRRTConfig(**options)


def test_interaction_weighs_in_the_reference_metric():
    world = make_u_maze(make_boxes([[11.25, 8.0, 0.0]]).poses)
    plan = KinodynamicRRT().plan(world, stop=MaxIterations(2500)).plan
    line = LineString(plan.poses[:, :2])
    assert line.length == pytest.approx(plan.length)
    assert QuasiStatic().sweep(world, plan.poses).work < 0.6
