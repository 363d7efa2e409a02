"""A start says which of its bodies overlap, and which places are inside something static."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from conftest import SQUARE

from pushplan.envs import PushEnv, make
from pushplan.envs.start_checks import StartWarning
from pushplan.scenarios import suite
from pushplan.world import GoalDisc, Movables, ObjectGoals, StaticMap, World, save_world
from pushplan.world import box_delivery_robot as robot

POSES = np.array([[2.0, 1.0, 0.0], [2.25, 1.0, 0.0], [3.0, 2.9, 0.0], [0.6, 1.5, 0.0], [4, 1, 0.0]])


def started(tmp_path, poses, goal=None, **options):
    """The warnings of the start of a world with boxes of 0.3 m in a room of 5 x 3 m."""
    static = StaticMap.build(segments=[[0, 3, 5, 3]], radii=0.05, bounds=[0, 0, 5, 3])
    boxes = Movables.from_outlines([0.3 * SQUARE] * len(poses), poses, **options)
    world = World(robot(), [0.5, 1.5, 0.0], static, boxes, goal or GoalDisc([4.5, 1.5], 0.2))
    save_world(world, tmp_path / "world.json")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        env = PushEnv(task="room", variations={"world_file": str(tmp_path / "world.json")})
        env.reset(seed=0)
    return [str(one.message) for one in caught if one.category is StartWarning]


def test_overlaps_are_named_with_their_depths(tmp_path):
    (said,) = started(tmp_path, POSES)
    assert "the robot and object 3 by" in said
    assert "object 2 and something static by 0.1 m" in said
    assert "object 0 and object 1 by 0.05 m" in said
    assert "more" not in said
    shifts = np.array([[0, 0, 0], [0.1, 0, 0], [0, -0.3, 0], [0, 1, 0], [0, 0, 0]])
    assert started(tmp_path, POSES + shifts) == []


def test_objects_that_are_fixed_may_be_part_of_a_wall(tmp_path):
    assert started(tmp_path, POSES[2:3], fixed=[True]) == []


def test_a_place_that_nothing_can_be_brought_to_is_named(tmp_path):
    places = np.array([[2.0, 3.0, 0.0], [4.0, 1.0, 0.0]])
    goal = ObjectGoals([0, 1], places, [0.02] * 2, [0.1] * 2)
    (said,) = started(tmp_path, [[2.0, 1.0, 0.0], [3.0, 1.0, 0.0]], goal)
    assert said == "the start has overlaps: the place of object 0 and something static by 0.2 m"


@pytest.mark.parametrize(
    "name", ["maze-2d-10", "area-clearing-2d-shapes", "ship-ice-2d-20", "namo-2d-several"]
)
def test_starts_of_our_own_have_none(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error", StartWarning)
        for scenario in suite(name, episodes=3).scenarios:
            make(scenario).reset()
