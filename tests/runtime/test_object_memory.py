"""Objects out of sight are still there for a while, where they were predicted to be."""

from dataclasses import replace

import numpy as np
from conftest import make_boxes, make_u_maze

from pushplan.runtime.state_estimator import ObjectMemory
from pushplan.world import ClearanceArea, World

MAZE = make_u_maze([(11.0, 8.0, 0.1), (4.0, 8.0, 0.2), (8.0, 13.0, 0.3)])


def at(time: float, *seen: int) -> World:
    return replace(MAZE.moved(time=time), movables=MAZE.movables.select(list(seen)))


def test_what_is_missing_is_added_as_predicted_until_it_was_unseen_for_too_long() -> None:
    memory = ObjectMemory(keep=1.0)
    last = memory.complete(at(0.0, 0, 1, 2), MAZE)
    assert last == MAZE
    pushed = last.movables.poses + np.array([0.5, 0.0, 0.0])
    last = memory.complete(at(0.6, 2, 0), last.moved(movable_poses=pushed, time=0.6))
    assert last.movables.ids.tolist() == [2, 0, 1]
    assert np.array_equal(last.movables.poses[2], pushed[1])
    last = memory.complete(at(0.9, 0), last.moved(time=0.9))
    assert sorted(last.movables.ids.tolist()) == [0, 1, 2]
    last = memory.complete(at(1.1, 0), last.moved(time=1.1))
    assert sorted(last.movables.ids.tolist()) == [0, 2]  # 1 was seen at 0, 2 at 0.6


def test_what_is_cleared_is_not_missed() -> None:
    corners = [(0.0, 0.0), (6.0, 0.0), (6.0, 15.0), (0.0, 15.0)]
    world = replace(MAZE, goal=ClearanceArea(np.array(corners), np.ones(4, dtype=bool)))
    memory = ObjectMemory(keep=1.0)
    memory.complete(world, world)
    gone = replace(world.moved(time=0.1), movables=make_boxes([]))
    assert memory.complete(gone, world.moved(time=0.1)).movables.ids.tolist() == [1]


def test_nothing_is_kept_without_being_asked_for() -> None:
    memory = ObjectMemory(keep=0.0)
    memory.complete(MAZE, MAZE)
    assert memory.complete(at(0.1, 1), MAZE).movables.ids.tolist() == [1]
