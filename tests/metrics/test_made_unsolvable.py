"""A way that is closed for good, and one that is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pushplan.metrics.closing import made_unsolvable
from pushplan.world import Episode, GoalDisc, Movables, StaticMap, World, maze_robot

SIDE, END = -3.0, 7.0  # where the box stands in a corridor that the goal ends


def episode(box: float, robot: tuple[float, float] = (0.0, 1.1), success: bool = False) -> Episode:
    """An episode in which a box as wide as the corridor goes from behind the robot to x."""
    corridor = [[[-6, -1], [11, -1], [11, 0], [-6, 0]], [[-6, 2.2], [11, 2.2], [11, 3], [-6, 3]]]
    ends = [[[-7, -1], [-6, -1], [-6, 3], [-7, 3]], [[10, -1], [11, -1], [11, 3], [10, 3]]]
    square = 0.8 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    world = World(
        robot=maze_robot("differential"),
        robot_pose=[0.0, 1.1, 0.0],
        static=StaticMap.build([*corridor, *ends], bounds=[-6, 0, 10, 2.2]),
        movables=Movables.from_outlines([square], [[SIDE, 1.1, 0.0]]),
        goal=GoalDisc(np.array([9.0, 1.1]), 0.5),
    )
    robots = np.array([[0.0, 1.1, 0.0], [*robot, 0.0]])
    boxes = np.array([[[SIDE, 1.1, 0.0]], [[box, 1.1, 0.0]]])
    return Episode(world, [0.0, 1.0], robots, boxes, success, "goal" if success else "time_limit")


def test_a_box_that_was_pushed_onto_the_goal_is_a_way_closed_for_good() -> None:
    assert made_unsolvable(episode(END)) == 1.0
    assert made_unsolvable(episode(END, success=True)) == 0.0
    assert made_unsolvable(episode(SIDE)) == 0.0


def test_a_robot_that_ends_at_a_wall_has_closed_nothing() -> None:
    assert made_unsolvable(episode(SIDE, robot=(2.0, 0.6))) == 0.0


def test_only_starts_that_can_be_solved_count() -> None:
    hopeless = episode(SIDE)
    closed = hopeless.world.moved(movable_poses=[[END, 1.1, 0.0]])
    there = np.array([[[END, 1.1, 0.0]]] * 2)
    assert made_unsolvable(replace(hopeless, world=closed, object_poses=there)) is None
    alone = replace(closed, movables=Movables.empty())
    nothing = {"object_poses": np.zeros((2, 0, 3)), "completed": None}
    assert made_unsolvable(replace(hopeless, world=alone, **nothing)) is None
