"""Places of objects: tolerances, symmetry, groups, files and errors."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from pushplan.geometry.object_ways import object_ways
from pushplan.world import (
    GoalDisc,
    InvalidInputError,
    Movables,
    ObjectGoals,
    SchemaError,
    StaticMap,
    World,
    turtlebot3_burger,
    world_from_dict,
    world_to_dict,
)

SQUARE = np.array([(-0.05, -0.05), (0.05, -0.05), (0.05, 0.05), (-0.05, 0.05)])


def goals(poses, **options):
    count = len(poses)
    values = {"radii": [0.02] * count, "heading_tolerances": [0.1] * count, **options}
    return ObjectGoals(values.pop("ids", range(count)), poses, **values)


def scene(goal, poses, ids=None):
    objects = Movables.from_outlines([SQUARE] * len(poses), poses, ids=ids)
    room = StaticMap.build(bounds=(-2.0, -2.0, 2.0, 2.0))
    return World(turtlebot3_burger(), [-1.0, 0.0, 0.0], room, objects, goal)


@pytest.mark.parametrize(
    ("pose", "symmetry", "done"),
    [
        ((1.019, 0.0, 0.0), 1, True),
        ((1.021, 0.0, 0.0), 1, False),
        ((1.0, 0.0, 0.099), 1, True),
        ((1.0, 0.0, -0.101), 1, False),
        ((1.0, 0.0, math.pi / 2), 1, False),
        ((1.0, 0.0, math.pi / 2), 4, True),
        ((1.0, 0.0, 5.0 * math.tau - 0.05), 1, True),
        ((1.0, 0.0, -math.pi / 2 + 0.09), 4, True),
        ((1.0, 0.0, math.pi / 4), 4, False),
    ],
)
def test_tolerances_and_symmetry(pose, symmetry, done):
    world = scene(goals([(1.0, 0.0, 0.0)], symmetries=[symmetry]), [pose])
    assert world.completed.tolist() == [done]
    assert world.goal_reached == done


def test_objects_without_a_place_are_done_and_do_not_count():
    goal = goals([(1.0, 0.0, 0.0)], ids=[7])
    world = scene(goal, [(0.0, 1.0, 0.0), (0.0, 0.0, 0.0)], ids=[3, 7])
    assert world.completed.tolist() == [True, False]
    assert world.wanted.tolist() == [False, True]


def test_an_object_that_is_not_there_is_not_at_its_place():
    goal = goals([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    world = scene(goal, [(1.0, 0.0, 0.0)])
    assert world.completed.all()
    assert not world.goal_reached


def test_the_robot_has_to_get_to_its_own_goal():
    goal = goals([(1.0, 0.0, 0.0)], robot=GoalDisc([0.0, -1.0], 0.1))
    world = scene(goal, [(1.0, 0.0, 0.0)])
    assert not world.goal_reached
    assert world.moved(robot_pose=[0.0, -1.05, 2.0]).goal_reached


@pytest.mark.parametrize("seed", range(20))
def test_groups_are_matched_as_well_as_any_permutation(seed):
    rng = np.random.default_rng(seed)
    count = 5
    poses = rng.uniform(-1.0, 1.0, (count, 3))
    poses[:, 2] = 0.0
    goal = goals(poses, groups=[1] * count, radii=[0.5] * count)
    objects = rng.uniform(-1.0, 1.0, (count, 3))
    objects[:, 2] = 0.0
    distances = goal.errors(objects[:, None])[0]
    reached = distances <= 0.5
    orders = [list(one) for one in itertools.permutations(range(count))]
    best = max(sum(reached[range(count), order]) for order in orders)
    assert sum(goal.reached(goal.ids, objects)) == best
    static = StaticMap.build(bounds=(-2.0, -2.0, 2.0, 2.0))
    ways = object_ways(static, goal, goal.ids, objects[:, :2])
    least = min(np.maximum(distances - 0.5, 0.0)[range(count), order].sum() for order in orders)
    assert ways.sum() == pytest.approx(least)


def test_files_keep_every_value():
    goal = goals(
        [(1.0, 0.0, 0.3), (0.0, 1.0, 0.0)],
        ids=[4, 9],
        symmetries=[4, 4],
        groups=[2, 2],
        robot=GoalDisc([0.0, -1.0], 0.1),
    )
    world = scene(goal, [(0.1, 0.0, 0.0), (0.0, 0.0, 0.0)], ids=[9, 4])
    assert world_from_dict(world_to_dict(world)) == world


def test_places_of_a_file_have_defaults():
    data = world_to_dict(scene(goals([(1.0, 0.0, 0.0)]), [(0.0, 0.0, 0.0)] * 1))
    data["goal"] = {"kind": "objects", "places": [{"id": 0, "pose": [1, 0, 0], "radius": 0.1}]}
    goal = world_from_dict(data).goal
    assert (goal.heading_tolerances[0], goal.symmetries[0]) == (math.pi, 1)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"id": 5}, "unknown object id 5"),
        ({"radius": 0.0}, r"goal.places\[0\].radius must lie in"),
        ({"radius": math.nan}, r"goal.places\[0\].radius must lie in"),
        ({"pose": [0, 0]}, r"goal.places\[0\].pose must"),
        ({"symmetry": 0}, "goal.symmetries must be positive"),
        ({"symmetry": "x"}, r"goal.places\[0\].symmetry must"),
        ({"heading_tolerance": 4.0}, "goal.heading_tolerances must be positive and at most"),
        ({"colour": 1}, "colour"),
    ],
)
def test_wrong_places_of_a_file_are_named(change, message):
    data = world_to_dict(scene(goals([(1.0, 0.0, 0.0)]), [(0.0, 0.0, 0.0)]))
    data["goal"]["places"][0].update(change)
    with pytest.raises((SchemaError, InvalidInputError), match=message):
        world_from_dict(data)


def test_wrong_goals_are_refused():
    with pytest.raises(InvalidInputError, match="distinct"):
        goals([(0.0, 0.0, 0.0)] * 2, ids=[1, 1])
    with pytest.raises(InvalidInputError, match="at least one"):
        ObjectGoals([], np.zeros((0, 3)), [], [])
    with pytest.raises(InvalidInputError, match="radii"):
        goals([(0.0, 0.0, 0.0)], radii=[-1.0])
    with pytest.raises(InvalidInputError, match="robot"):
        goals([(0.0, 0.0, 0.0)], robot="there")


def test_a_place_that_is_taken_is_no_place_for_others():
    goal = goals([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], groups=[1, 1])
    left = goal.left(np.array([0, 1]), np.array([(1.0, 0.0, 0.0), (0.5, 0.0, 0.0)]))
    assert (left.ids.tolist(), left.poses[:, 0].tolist()) == ([1], [0.0])
    assert goal.left(np.array([0, 1]), np.array([(1.0, 0.0, 0.0), (0.0, 0.0, 0.0)])) is None


def test_a_group_has_one_symmetry():
    with pytest.raises(InvalidInputError, match="equal within group 3"):
        goals([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], groups=[3, 3], symmetries=[4, 1])
    with pytest.raises(InvalidInputError, match="turn by at most 1000"):
        goals([(0.0, 0.0, 1e4)])
