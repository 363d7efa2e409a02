"""Rooms in which every object has a place, and the instances of ReloPush."""

from __future__ import annotations

import json

import numpy as np
import pytest
import shapely

from pushplan.scenarios import generate_rearrangement, load_relopush
from pushplan.world import InvalidInputError, ScenarioError, SchemaError, turtlebot3_burger

ROBOT = turtlebot3_burger("pusher")


def footprints(world):
    objects = world.movables
    found = [
        shapely.union_all([shapely.Polygon(part) for part in objects.parts_world(k)])
        for k in range(len(objects))
    ]
    return [shapely.union_all(list(map(shapely.Polygon, world.robot_outline_world()))), *found]


@pytest.mark.parametrize("shape", ["box", "t"])
@pytest.mark.parametrize("arrangement", ["random", "swapped"])
def test_starts_and_places_are_free(shape, arrangement):
    for seed in range(5):
        world = generate_rearrangement(
            np.random.default_rng(seed),
            robot=ROBOT,
            objects=4,
            shape=shape,
            arrangement=arrangement,
            obstacles=1,
        )
        ids = world.movables.ids
        there = dict(zip(world.goal.ids.tolist(), world.goal.poses, strict=True))
        poses = np.array(
            [there.get(int(k), p) for k, p in zip(ids, world.movables.poses, strict=True)]
        )
        placed = world.moved(movable_poses=poses)
        assert placed.completed.all()
        assert not world.goal_reached
        for bodies in (footprints(world), footprints(placed)[1:5]):
            for i, one in enumerate(bodies):
                assert not shapely.box(*world.static.bounds).exterior.intersects(one)
                assert not any(one.intersects(other) for other in bodies[:i])
        if arrangement == "swapped":
            starts = world.movables.poses[:4]
            gaps = np.abs(world.goal.poses[:, None] - starts).max(axis=2)
            assert (gaps.min(axis=1) == 0.0).all()
            assert (gaps.argmin(axis=1) != np.arange(4)).all()


def test_the_same_seed_draws_the_same_room():
    one, other = (
        generate_rearrangement(np.random.default_rng(3), robot=ROBOT, objects=5) for _ in range(2)
    )
    assert one == other


def test_too_many_objects_are_refused(monkeypatch):
    monkeypatch.setattr("pushplan.scenarios.rearrangement._TRIES", 10)
    for room in ((0.5, 0.5), (-1.0, -1.0)):
        with pytest.raises(ScenarioError, match="wider than"):
            generate_rearrangement(np.random.default_rng(0), robot=ROBOT, room=room)
    with pytest.raises(ScenarioError, match="30 objects do not fit"):
        generate_rearrangement(np.random.default_rng(0), robot=ROBOT, objects=30, room=(1.5, 1.5))
    for wrong in ({"objects": 0}, {"shape": "z"}, {"arrangement": 3}, {"tolerance": -1.0}):
        with pytest.raises(InvalidInputError, match=next(iter(wrong))):
            generate_rearrangement(np.random.default_rng(0), robot=ROBOT, **wrong)


INSTANCE = {
    "objects": {"b1": [1.0, 1.0, 0.0], "b2": [2.0, 1.0, 0.0]},
    "robot": [2.0, 3.0, 1.57],
    "goals": {"d1": [1.0, 4.0, 0.0], "d2": [3.0, 4.0, 0.0]},
    "raw_other": {"assign": [["b1", "d2"], ["b2", "d1"]]},
}


def test_instances_of_relopush_are_read(tmp_path):
    file = tmp_path / "instances.json"
    file.write_text(json.dumps([INSTANCE, {**INSTANCE, "robot": [1.0, 2.0, 0.0]}]))
    world = load_relopush(file, 0, robot=ROBOT)
    assert world.goal.ids.tolist() == [0, 1]
    assert world.goal.poses[:, 0].tolist() == [3.0, 1.0]
    assert load_relopush(file, 3, robot=ROBOT).robot_pose.tolist() == [1.0, 2.0, 0.0]


def test_walls_leave_the_places_of_relopush_free(tmp_path):
    """Its workspace bounds the robot's origin: places may reach over it, and do in `data_2o1r`."""
    corner = {**INSTANCE, "goals": {"d1": [0.015, 0.02, 0.0], "d2": [3.0, 4.0, 0.3]}}
    file = tmp_path / "instances.json"
    file.write_text(json.dumps([corner, INSTANCE]))
    inner, usual = (load_relopush(file, i, robot=ROBOT) for i in (0, 1))
    for world in (inner, usual):
        walls = shapely.union_all([shapely.Polygon(wall) for wall in world.static.convex_parts])
        placed = np.concatenate(world.goal_polygons)
        assert not shapely.intersects_xy(walls, placed).any()
        assert world.static.bounds.tolist() == [0.0, 0.0, 4.0, 5.4]
        x0, y0, x1, y1 = shapely.difference(shapely.box(*walls.bounds), walls).bounds
        assert [x1, y1] == pytest.approx([4.0, 5.4])
        away = ROBOT.circumscribed_radius if world is inner else 0.0
        assert [x0, y0] == pytest.approx([-away, -away])


@pytest.mark.parametrize(
    "wrong",
    [
        {"goals": {"d1": [1.0, 4.0, 0.0]}},
        {"robot": [1.0]},
        {"objects": 3},
        {"raw_other": {"assign": [["b1", "d9"]]}},
        {"speed": 3},
        {"raw_other": {"assign": [["b1", "d1"], ["b2", "d1"]]}},
        {"objects": {}, "goals": {}, "raw_other": {}},
    ],
)
def test_wrong_instances_are_refused(tmp_path, wrong):
    file = tmp_path / "instances.json"
    file.write_text(json.dumps([{**INSTANCE, **wrong}]))
    with pytest.raises((SchemaError, InvalidInputError)):
        load_relopush(file, 0, robot=ROBOT)
    file.write_text("{}")
    with pytest.raises(SchemaError, match="expected a list"):
        load_relopush(file, 0, robot=ROBOT)
    with pytest.raises(SchemaError, match="nowhere"):
        load_relopush(tmp_path / "nowhere.json", 0, robot=ROBOT)
