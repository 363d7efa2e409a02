"""Equations 1 and 2 of the paper, worked by hand."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pushplan.metrics import compute, interaction_work, navigation_scores, path_length
from pushplan.world import (
    Drive,
    Episode,
    GoalDisc,
    GoalLine,
    InvalidInputError,
    Movables,
    Receptacle,
    RobotModel,
    StaticMap,
    UnknownNameError,
    World,
)

SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
GOAL = GoalDisc(np.array([10.0, 0.0]), 1.0)


def episode(
    robot: Any,
    boxes: Any = (),
    *,
    success: bool = True,
    goal: Any = GOAL,
    masses: Any = None,
    static: StaticMap | None = None,
) -> Episode:
    """An episode from (T, 2) robot points and (T, K, 2) box points."""
    path = np.column_stack([np.asarray(robot, float), np.zeros(len(robot))])
    points = np.asarray(boxes, float).reshape(len(path), -1, 2)
    poses = np.concatenate([points, np.zeros((*points.shape[:2], 1))], axis=2)
    count = poses.shape[1]
    world = World(
        robot=RobotModel.from_outline(
            SQUARE, mass=2.0, drive=Drive.DIFFERENTIAL, max_speed=1.0, max_turn_rate=1.0
        ),
        robot_pose=path[0],
        static=static or StaticMap.build(bounds=[-50.0, -50.0, 50.0, 50.0]),
        movables=Movables.from_outlines([SQUARE] * count, poses[0], masses=masses),
        goal=goal,
    )
    times = np.arange(len(path), dtype=float)
    return Episode(world, times, path, poses, success, "goal" if success else "wall")


def test_detour_and_push() -> None:
    # up 3, across 8, down 3: 14 m. The disc's edge is 9 m away. A 0.5 kg box moves 4 m.
    path = [[0, 0], [0, 3], [8, 3], [8, 0], [9, 0]]
    boxes = [[[5, 1]], [[5, 1]], [[9, 1]], [[9, 1]], [[9, 1]]]
    scores = navigation_scores(episode(path, boxes, masses=[0.5]))
    assert scores.success
    assert scores.path_length_m == pytest.approx(15.0)
    assert scores.shortest_length_m == pytest.approx(9.0)
    assert scores.efficiency == pytest.approx(9.0 / 15.0)
    assert scores.interaction_work_kg_m == pytest.approx(2.0)
    assert scores.effort == pytest.approx(2.0 * 15.0 / (2.0 * 15.0 + 0.5 * 4.0))


def test_straight_to_the_goal_without_touching_anything_is_perfect() -> None:
    scores = navigation_scores(episode([[0, 0], [4, 0], [9, 0]], [[[5, 5]]] * 3))
    assert (scores.efficiency, scores.effort) == (pytest.approx(1.0), 1.0)


def test_failure_has_no_efficiency_but_an_effort() -> None:
    scores = navigation_scores(
        episode([[0, 0], [2, 0]], [[[1, 0]], [[2, 0]]], success=False, masses=[4.0])
    )
    assert scores.efficiency == 0.0
    assert scores.effort == pytest.approx(0.5)  # 2 kg x 2 m against 4 kg x 1 m


def test_a_box_moved_and_moved_back_counts_twice() -> None:
    path = [[0, 0], [1, 0], [2, 0]]
    there_and_back = episode(path, [[[5, 0]], [[-5, 0]], [[5, 0]]])
    assert interaction_work(there_and_back) == pytest.approx(20.0)
    assert navigation_scores(there_and_back).effort == pytest.approx(4.0 / 24.0)


def test_a_box_that_only_turns_does_no_work() -> None:
    still = episode([[0, 0], [9, 0]], [[[5, 5]], [[5, 5]]])
    poses = np.array(still.object_poses)
    poses[1, 0, 2] = 1.0
    turned = Episode(still.world, still.times, still.robot_poses, poses, True, "goal")
    assert interaction_work(turned) == 0.0


def test_every_recorded_pose_counts() -> None:
    angles = np.linspace(0.0, np.pi, 2001)
    half_circle = np.column_stack([np.cos(angles), np.sin(angles), angles])
    assert path_length(half_circle) == pytest.approx(np.pi, rel=1e-6)


@pytest.mark.parametrize(("success", "efficiency"), [(True, 1.0), (False, 0.0)])
def test_a_robot_that_never_moved(success: bool, efficiency: float) -> None:
    start = [9.5, 0.0] if success else [0.0, 0.0]
    scores = navigation_scores(episode([start, start], success=success))
    assert (scores.efficiency, scores.effort) == (efficiency, 1.0)


def test_goal_point_convention_can_pass_one() -> None:
    straight = episode([[0, 0], [9, 0]])
    assert navigation_scores(straight, to_goal_point=True).efficiency == pytest.approx(10.0 / 9.0)


def test_goal_line_is_measured_to_the_line() -> None:
    line = GoalLine(np.array([0.0, 6.0]), np.array([0.0, 1.0]))
    run = episode([[0, 0], [0, 8]], goal=line)
    assert navigation_scores(run).efficiency == pytest.approx(6.0 / 8.0)
    assert navigation_scores(run, to_goal_point=True).efficiency == pytest.approx(6.0 / 8.0)


def test_the_robots_inscribed_disc_keeps_clear_of_walls() -> None:
    wall = StaticMap.build(
        polygons=[[[4.0, -20.0], [5.0, -20.0], [5.0, 3.0], [4.0, 3.0]]],
        bounds=[-30.0, -30.0, 30.0, 30.0],
    )
    run = episode([[0, 0], [4.5, 6], [10, 1]], static=wall)
    as_point = navigation_scores(run, clearance="point").shortest_length_m
    as_disc = navigation_scores(run).shortest_length_m
    by_hand = math.hypot(4, 3) + 1 + math.hypot(5, 3) - 1.0
    assert as_point == pytest.approx(by_hand, rel=1e-5)
    assert by_hand < as_disc < by_hand + 1.0
    assert navigation_scores(run).efficiency <= 1.0
    with pytest.raises(InvalidInputError, match="clearance"):
        navigation_scores(run, clearance="disc")  # type: ignore[arg-type]


def test_registry_leaves_out_what_does_not_apply() -> None:
    values = compute(episode([[0, 0], [9, 0]]))
    assert values["E_nav"] == pytest.approx(1.0)
    assert values["steps"] == 0.0
    assert values["sim_time_s"] == 1.0
    corner = Receptacle(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]))
    assert "E_nav" not in compute(episode([[0, 0], [9, 0]], goal=corner))


def test_registry_takes_functions_by_text_and_names_unknown_metrics(tmp_path: Path) -> None:
    run = episode([[0, 0], [3, 4]])
    name = "pushplan.metrics.lengths:robot_path_length"
    assert compute(run, [name]) == {name: pytest.approx(5.0)}
    with pytest.raises(UnknownNameError, match="did you mean 'E_nav'"):
        compute(run, ["E_nva"])
    with pytest.raises(InvalidInputError, match="cannot load metric"):
        compute(run, ["pushplan.metrics.lengths:nothing"])
    (tmp_path / "broken.py").write_text("def f(:")
    with pytest.raises(InvalidInputError, match=r"cannot load metric .*SyntaxError.*broken.py"):
        compute(run, [f"{tmp_path}/broken.py:f"])
