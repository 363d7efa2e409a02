"""Pushes of episodes that are drawn by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pushplan.metrics import compute
from pushplan.metrics.pushes import pushing
from pushplan.world import (
    Drive,
    Episode,
    GoalDisc,
    InvalidInputError,
    Movables,
    ObjectGoals,
    Receptacle,
    RobotModel,
    StaticMap,
    World,
)

SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
STEP_S = 0.1
NAMES = ("pushes", "relocations", "pushing_distance_m", "transit_distance_m")


def place(x: float, box: int = 0) -> ObjectGoals:
    """A goal of one box, 0.1 m wide to either side."""
    return ObjectGoals([box], [[x, 0.0, 0.0]], [0.1], [0.1])


def driven(robot: Any, boxes: Any, goal: Any, completed: Any = None) -> Episode:
    """An episode along the x axis: corners of the tracks of a robot and K boxes, 1 m/s at most.

    Args:
        robot: (N,) x of the robot.
        boxes: (K, N) x of the boxes.
        goal: of the boxes.
        completed: (K,) at the end.
    """
    tracks = np.vstack([robot, *boxes])
    spans = np.maximum(np.abs(np.diff(tracks[0])), 0.3)
    corners = np.concatenate([[0.0], np.cumsum(np.round(spans / STEP_S) * STEP_S)])
    times = np.arange(round(corners[-1] / STEP_S) + 1) * STEP_S
    poses = np.zeros((len(times), len(tracks), 3))
    poses[..., 0] = np.transpose([np.interp(times, corners, track) for track in tracks])
    world = World(
        robot=RobotModel.from_outline(
            SQUARE, mass=2.0, drive=Drive.DIFFERENTIAL, max_speed=1.0, max_turn_rate=1.0
        ),
        robot_pose=poses[0, 0],
        static=StaticMap.build(bounds=[-20, -20, 20, 20]),
        movables=Movables.from_outlines([SQUARE] * len(boxes), poses[0, 1:]),
        goal=goal,
    )
    return Episode(world, times, poses[:, 0], poses[:, 1:], False, "stopped", completed)


def figures(episode: Episode) -> tuple[float, ...]:
    found = compute(episode, NAMES)
    return tuple(round(found[name], 6) for name in NAMES)


def test_a_push_ends_where_the_robot_leaves_the_box():
    # 1 m to the box, 2 m with it, 2 m off it and back, 1 m with it to its place
    episode = driven([0, 1, 3, 1, 3, 4], [[2, 2, 4, 4, 4, 5]], place(5.0), [True])
    assert figures(episode) == (2, 1, 3.0, 5.0)


def test_a_short_loss_of_contact_ends_no_push():
    episode = driven([0, 1, 3, 2.8, 3, 4], [[2, 2, 4, 4, 4, 5]], place(5.0), [True])
    assert figures(episode) == (2, 1, 3.0, 1.4)  # 0.6 s off the box
    shorter = driven([0, 1, 3, 2.9, 4], [[2, 2, 4, 4, 5.1]], place(5.1), [True])
    assert figures(shorter)[:2] == (1, 0)


def test_a_box_that_is_moved_by_another_is_not_pushed():
    episode = driven([0, 3], [[1, 4], [2, 5]], place(5.0, box=1), [True, True])
    assert figures(episode) == (1, 1, 3.0, 0.0)  # a box without a place is relocated


def test_another_box_in_between_makes_two_pushes():
    # the robot stands still for 0.3 s, and box 1 behind it moves meanwhile
    track = [0, 1, 1, 2]
    first = [1, 2, 2, 3]
    alone = driven(track, [first, [-9, -9, -9, -9]], place(3.0), [True, True])
    assert figures(alone)[0] == 1
    touched = driven(track, [first, [-1, 0, 0.1, 0.1]], place(3.0), [True, True])
    assert figures(touched)[0] == 3


def test_a_push_out_of_its_place_is_a_relocation():
    episode = driven([0, 2, 0], [[1, 3, 3]], place(1.0), [False])
    assert figures(episode) == (1, 1, 2.0, 2.0)


def test_a_delivery_in_two_pushes_has_one_relocation():
    goal = Receptacle([[4, -1], [6, -1], [6, 1], [4, 1]])
    episode = driven([0, 2, 0, 2, 4], [[1, 3, 3, 3, 5]], goal, [True])
    assert figures(episode) == (2, 1, 4.0, 4.0)


def test_the_task_says_whether_the_last_push_was_the_last_that_was_needed():
    goal = Receptacle([[4, -1], [6, -1], [6, 1], [4, 1]])
    for done, relocations in ((True, 0), (False, 1)):
        assert figures(driven([0, 3.49], [[1, 4.49]], goal, [done]))[1] == relocations


def test_nothing_pushed_is_all_transit():
    assert figures(driven([0, 1], [[5, 5]], place(6.0))) == (0, 0, 0.0, 1.0)


def test_goals_of_the_robot_have_no_pushes():
    episode = driven([0, 1], [[5, 5]], GoalDisc([3.0, 0.0], 0.1))
    assert compute(episode, NAMES) == {}
    with pytest.raises(InvalidInputError, match="goal"):
        pushing(episode)
