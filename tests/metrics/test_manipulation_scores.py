"""Equations 3 to 5 of the paper, worked by hand."""

from __future__ import annotations

import math
from typing import Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pushplan.metrics import compute, manipulation_scores
from pushplan.metrics.manipulation import spanning_tree_length
from pushplan.world import (
    ClearanceArea,
    Drive,
    Episode,
    GoalDisc,
    InvalidInputError,
    Movables,
    Receptacle,
    RobotModel,
    StaticMap,
    World,
)

SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
AREA = ClearanceArea(10.0 * SQUARE, np.ones(4, dtype=bool))
CORNER = Receptacle(np.array([[6.0, 6.0], [10, 6], [10, 10], [6, 10]]))
FLOOR = StaticMap.build(bounds=[-20, -20, 20, 20])


def episode(
    robot: Any,
    boxes: Any = (),
    completed: Any = (),
    *,
    goal: Any = AREA,
    masses: Any = None,
    static: StaticMap = FLOOR,
) -> Episode:
    """An episode from (T, 2) robot points and (K, T, 2) box points; the robot weighs 2 kg."""
    path = np.column_stack([np.asarray(robot, float), np.zeros(len(robot))])
    points = np.asarray(boxes, float).reshape(-1, len(path), 2).swapaxes(0, 1)
    poses = np.concatenate([points, np.zeros((*points.shape[:2], 1))], axis=2)
    world = World(
        robot=RobotModel.from_outline(
            SQUARE, mass=2.0, drive=Drive.DIFFERENTIAL, max_speed=1.0, max_turn_rate=1.0
        ),
        robot_pose=path[0],
        static=static,
        movables=Movables.from_outlines([SQUARE] * poses.shape[1], poses[0], masses=masses),
        goal=goal,
    )
    times, done = np.arange(len(path), dtype=float), np.asarray(completed, dtype=bool)
    return Episode(world, times, path, poses, bool(done.all()), "stopped", done)


def two_of_three() -> Episode:
    """The paper's figure: three boxes on a square, two of them cleared.

    The robot starts at the origin, pushes box 0 out to the right, comes back, pushes box 1 out
    upwards. Box 2 is brushed on the way and stays.
    """
    robot = [[0, 0], [5.5, 0], [0, 0], [0, 5.5]]
    boxes = [
        [[2, 0], [6, 0], [6, 0], [6, 0]],  # 4 m, l* = 3
        [[0, 3], [0, 3], [0, 3], [0, 6]],  # 3 m, l* = 2
        [[-4, 0], [-4, 0], [-4, 1], [-4, 1]],  # 1 m
    ]
    return episode(robot, boxes, [True, True, False], masses=[1.0, 0.5, 3.0])


def test_two_of_three_boxes_cleared() -> None:
    scores = manipulation_scores(two_of_three())
    assert (scores.success, scores.completed) == (pytest.approx(2 / 3), 2)
    assert scores.path_length_m == pytest.approx(5.5 + 5.5 + 5.5)
    # robot - box 0: 2 m, robot - box 1: 3 m (box 0 - box 1 would be 3.6 m), goals 3 m and 2 m
    assert scores.tree_length_m == pytest.approx(2 + 3 + 3 + 2)
    assert scores.efficiency == pytest.approx(10 / 16.5)
    assert scores.interaction_work_kg_m == pytest.approx(4 + 1.5 + 3)
    assert scores.effort == pytest.approx((33 + 1 * 3 + 0.5 * 2) / (33 + 4 + 1.5 + 3))


def test_the_tree_goes_from_box_to_box_where_that_is_shorter() -> None:
    # a row of boxes away from the robot: 1 + 1 + 1 m along the row, not 1 + 2 + 3
    boxes = [[[x, 0], [x, 7]] for x in (1.0, 2.0, 3.0)]
    scores = manipulation_scores(episode([[0, 0], [0, 20]], boxes, [True] * 3))
    assert scores.tree_length_m == pytest.approx(3 * 1 + 4 + 3 + 2)


def test_only_completed_objects_are_in_the_tree_and_in_the_numerator() -> None:
    boxes = [[[2, 0], [6, 0]], [[0, 1], [0, 4]]]
    scores = manipulation_scores(episode([[0, 0], [4, 0]], boxes, [True, False]))
    assert scores.success == 0.5
    assert scores.tree_length_m == pytest.approx(2 + 3)
    assert scores.efficiency == pytest.approx(5 / 4)  # the tree is no strict bound
    assert scores.effort == pytest.approx((8 + 3) / (8 + 4 + 3))


def test_closed_edges_are_no_goal() -> None:
    open_left = ClearanceArea(AREA.polygon, np.array([False, False, False, True]))
    boxes = [[[2, 0], [-6, 0]]]
    scores = manipulation_scores(episode([[3, 0], [-5, 0]], boxes, [True], goal=open_left))
    assert scores.tree_length_m == pytest.approx(1 + 7)
    assert scores.effort == pytest.approx((16 + 7) / (16 + 8))


def test_lengths_go_around_static_things() -> None:
    # a wall from (3, -20) to (3, 4): boxes and robot on its left, the receptacle on its right
    wall = StaticMap.build([[[3, -20], [4, -20], [4, 4], [3, 4]]], bounds=[-20, -20, 20, 20])
    boxes = [[[0, 0], [7, 7]], [[5, 0], [5, 0]]]
    run = episode([[0, -1], [6, 8]], boxes, [True, False], goal=CORNER, static=wall)
    around = math.hypot(3, 4) + math.hypot(3, 2)
    scores = manipulation_scores(run)
    assert scores.tree_length_m == pytest.approx(1 + around, rel=1e-5)
    # the second box is behind the wall from the robot: its edge of the tree goes around as well
    both = episode([[0, -1], [6, 8]], boxes, [True, True], goal=CORNER, static=wall)
    to_second = math.hypot(3, 4) + 1 + math.hypot(1, 4)
    second = math.hypot(1, 6)
    assert manipulation_scores(both).tree_length_m == pytest.approx(
        1 + around + to_second + second, rel=1e-5
    )


def test_a_box_that_took_a_detour_costs_effort() -> None:
    direct = [[[2, 0], [4, 0], [6, 0]]]
    detour = [[[2, 0], [2, 3], [6, 3]]]
    robot = [[0, 0], [2, 0], [5, 0]]
    best = manipulation_scores(episode(robot, direct, [True])).effort
    assert best == pytest.approx((10 + 3) / (10 + 4))
    worse = manipulation_scores(episode(robot, detour, [True])).effort
    assert worse == pytest.approx((10 + 3) / (10 + 7))


def test_nothing_completed() -> None:
    scores = manipulation_scores(episode([[0, 0], [4, 0]], [[[2, 0], [3, 0]]], [False]))
    assert (scores.success, scores.efficiency, scores.tree_length_m) == (0.0, 0.0, 0.0)
    assert scores.effort == pytest.approx(8 / 9)


def test_a_robot_that_never_moved() -> None:
    scores = manipulation_scores(episode([[0, 0], [0, 0]], [[[2, 0], [2, 0]]], [False]))
    assert (scores.success, scores.efficiency, scores.effort) == (0.0, 0.0, 1.0)
    scores = manipulation_scores(episode([[0, 0], [0, 0]], [[[9, 0], [9, 0]]], [True]))
    assert (scores.success, scores.efficiency, scores.effort) == (1.0, 1.0, 1.0)


def test_no_objects_at_all() -> None:
    scores = manipulation_scores(episode([[0, 0], [1, 0]]))
    assert (scores.success, scores.efficiency, scores.effort) == (1.0, 0.0, 1.0)


@pytest.mark.parametrize("goal", [AREA, CORNER])
def test_an_object_that_starts_completed_needs_nothing(goal: Any) -> None:
    there = [8.0, 8.0]  # off the area, and in the receptacle
    alone = episode([[0, 0], [4, 0]], [[[2, 0], [8, 8]]], [True], goal=goal)
    more = episode([[0, 0], [4, 0]], [[[2, 0], [8, 8]], [there, there]], [True, True], goal=goal)
    a, b = manipulation_scores(alone), manipulation_scores(more)
    assert (b.tree_length_m, b.effort) == (a.tree_length_m, a.effort)
    assert (b.success, b.completed) == (1.0, 2)
    pushed = episode([[0, 0], [4, 0]], [[[2, 0], [8, 8]], [there, [9, 8]]], [True] * 2, goal=goal)
    assert manipulation_scores(pushed).effort < a.effort


def test_completed_where_no_way_is_known_has_no_efficiency() -> None:
    ring = [[-1, -1, 4, -1], [4, -1, 4, 1], [4, 1, -1, 1], [-1, 1, -1, -1]]
    walled = StaticMap.build([], ring, 0.1, bounds=[-20, -20, 20, 20])
    run = episode([[0, 0], [4, 0]], [[[2, 0], [6, 0]]], [True], static=walled)
    scores = manipulation_scores(run)
    assert math.isnan(scores.efficiency) and 0.0 <= scores.effort <= 1.0
    assert "E_manip" not in compute(run) and compute(run)["S_manip"] == 1.0


def test_registry_leaves_out_what_does_not_apply() -> None:
    values = compute(two_of_three())
    assert values["S_manip"] == pytest.approx(2 / 3)
    assert values["E_manip"] == pytest.approx(10 / 16.5)
    assert values["I_manip"] == pytest.approx(37 / 41.5)
    assert not {"E_nav", "I_nav"} & set(values)
    disc = episode([[0, 0], [1, 0]], goal=GoalDisc(np.array([1.0, 0.0]), 0.5))
    assert not {"S_manip", "E_manip", "I_manip", "E_manip_reference"} & set(compute(disc))
    with pytest.raises(InvalidInputError, match="GoalDisc"):
        manipulation_scores(disc)


def test_the_convention_of_the_original() -> None:
    wall = StaticMap.build([[[3, -20], [4, -20], [4, 4], [3, 4]]], bounds=[-20, -20, 20, 20])
    boxes = [[[0, 0], [7, 7]], [[5, 0], [5, 0]]]
    run = episode([[0, -1], [6, 8]], boxes, [True, False], goal=CORNER, static=wall)
    found = manipulation_scores(run, reference=True)  # through the wall to the middle
    middle = CORNER.polygon.mean(axis=0)
    assert found.tree_length_m == pytest.approx(1 + math.hypot(*middle))
    closed = ClearanceArea(AREA.polygon, np.zeros(4, dtype=bool))
    run = episode([[3, 0], [5, 0]], [[[2, 0.3], [6, 0]]], [True], goal=closed)
    found = manipulation_scores(run, reference=True)  # ten places along each edge of 10 m
    assert found.tree_length_m == pytest.approx(math.hypot(1, 0.3) + math.hypot(3, 0.2))
    short = episode([[3, 0], [5, 0]], [[[2, 0], [3, 0]]], [True], goal=closed)
    assert manipulation_scores(short, reference=True).effort > 1.0
    assert compute(short, ["I_manip_reference"])["I_manip_reference"] > 1.0


COLUMNS = StaticMap.build(
    [np.array(c) + 1.5 * SQUARE for c in ([-2.5, 1], [2, 2.5], [1, -2])], bounds=[-20, -20, 20, 20]
)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=10)
def test_bounds_of_the_scores(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 6))
    robot = rng.uniform(-8, 8, (4, 2))
    boxes = rng.uniform(-5, 5, (count, 4, 2))
    done = rng.random(count) < 0.6
    boxes[done, -1] = rng.uniform(6.1, 9, (int(done.sum()), 2))
    run = episode(robot, boxes, done, masses=rng.uniform(0.1, 5, count), static=COLUMNS)
    scores, reference = manipulation_scores(run), manipulation_scores(run, reference=True)
    assert 0.0 <= scores.effort <= 1.0
    for each in (scores, reference):
        assert each.success == pytest.approx(done.mean())
        assert (each.efficiency == 0.0) == (each.tree_length_m == 0.0)
    values = compute(run)
    assert values["I_manip"] == scores.effort
    assert values.get("E_manip", scores.efficiency) == pytest.approx(scores.efficiency, nan_ok=True)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=25)
def test_the_tree_is_that_of_networkx(seed: int) -> None:
    points = np.random.default_rng(seed).uniform(-5, 5, (6, 2))
    graph = nx.Graph()
    for i in range(6):
        for j in range(i):
            graph.add_edge(i, j, weight=math.dist(points[i], points[j]))
    expected = nx.minimum_spanning_tree(graph).size(weight="weight")
    assert spanning_tree_length(FLOOR, list(points)) == pytest.approx(expected)


def test_equal_places_cost_nothing() -> None:
    assert spanning_tree_length(FLOOR, [np.zeros(2)] * 3) == 0.0
