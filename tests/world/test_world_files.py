"""World files: exact both ways, and clear about what is wrong."""

from __future__ import annotations

import json

import numpy as np
import pytest
import yaml
from conftest import SQUARE, make_robot, make_u_maze
from hypothesis import given, settings
from hypothesis import strategies as st

from pushplan.world import (
    ClearanceArea,
    GoalLine,
    GoalPose,
    InvalidInputError,
    Movables,
    Receptacle,
    SchemaError,
    load_world,
    save_world,
    world_from_dict,
    world_to_dict,
)

GOALS = [
    GoalLine([0, 9], [0.1, 1]),
    GoalPose([1 / 3, 9], 0.02, heading=-7.0, heading_tolerance=0.05),
    Receptacle(SQUARE),
    ClearanceArea(SQUARE, [True, False, True, True]),
]
numbers = st.floats(-1e6, 1e6)


@pytest.mark.parametrize("ending", ["json", "yaml", "yml"])
@pytest.mark.parametrize("goal", GOALS, ids=lambda goal: type(goal).__name__)
def test_a_world_survives_its_file(tmp_path, ending, goal):
    world = make_u_maze([[1 / 3, np.pi, 0.1]], goal=goal, robot=make_robot(max_acceleration=0.7))
    save_world(world, tmp_path / f"w.{ending}")
    assert load_world(tmp_path / f"w.{ending}") == world


@settings(max_examples=50)
@given(st.lists(st.tuples(numbers, numbers, numbers), max_size=4), numbers, st.booleans())
def test_every_number_survives_json(poses, time, wheeled):
    boxes = Movables.from_outlines(
        [SQUARE] * len(poses),
        np.array(poses).reshape(-1, 3),
        wheeled=np.full(len(poses), wheeled),
        ids=np.arange(len(poses)) * 7 + 1,
    )
    world = make_u_maze(movables=boxes, time=time)
    assert world_from_dict(json.loads(json.dumps(world_to_dict(world)))) == world


def test_a_person_can_write_one_by_hand(tmp_path):
    (tmp_path / "room.yaml").write_text(
        """
schema: pushplan-world/1
robot: {drive: differential, mass: 1, max_speed: 0.2, max_turn_rate: 1, pose: [1, 1, 0],
        parts: [[[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]]]}
static: {bounds: [0, 0, 5, 5], segments: [{from: [0, 2], to: [3, 2], radius: 0.1}]}
movables:
  - {polygon: [[2, 1], [2.5, 1], [2.5, 1.5], [2, 1.5]], mass: 2}
goal: {kind: disc, center: [4, 4], radius: 0.3}
"""
    )
    world = load_world(tmp_path / "room.yaml")
    assert world.movables.poses[0].tolist() == pytest.approx([2.25, 1.25, 0.0])
    assert world.movables.masses.tolist() == [2.0]
    assert world.time == 0.0


def change(path: str, value: object) -> dict:
    data = json.loads(json.dumps(world_to_dict(make_u_maze([[4, 9, 0.3]]))))
    at, keys = data, path.split(".")
    for key in keys[:-1]:
        at = at[int(key) if key.isdigit() else key]
    if value is KeyError:
        del at[keys[-1]]
    else:
        at[keys[-1]] = value
    return data


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("schema", "pushplan-world/9", "pushplan-world/1"),
        ("robot.max_sped", 1, "did you mean 'max_speed'"),
        ("robot.mass", KeyError, "required key 'mass'"),
        ("robot.mass", "1", "must be a number"),
        ("robot.drive", "legs", "valid: car, constant_speed, differential"),
        ("robot.parts", 3, "list of convex outlines"),
        ("robot.pose", [1, 2], "shape (3,)"),
        ("goal.kind", "disk", "did you mean 'disc'"),
        ("goal.radius", KeyError, "required key 'radius'"),
        ("movables.0.outline", KeyError, "either 'polygon'"),
        ("movables.0.weight", 2, "unknown key in movables[0] 'weight'"),
        ("movables", {"a": 1}, "must be a list"),
        ("static.segments.0.to", None, "must be a list"),
        ("static.walls", [], "unknown key in static"),
        ("time", "noon", "time must be a number"),
    ],
)
def test_errors_name_the_value_and_the_choices(path, value, words):
    with pytest.raises(InvalidInputError) as caught:
        world_from_dict(change(path, value))
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("name", "text"),
    [("w.json", "{"), ("w.yaml", "a: [1"), ("w.yaml", "just text"), ("w.json", "[1, 2]")],
)
def test_unreadable_files_name_themselves(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    with pytest.raises(SchemaError, match=name):
        load_world(tmp_path / name)


def test_missing_file_and_wrong_ending(tmp_path):
    with pytest.raises(SchemaError, match="cannot read"):
        load_world(tmp_path / "none.yaml")
    with pytest.raises(SchemaError, match="ends in"):
        save_world(make_u_maze(), tmp_path / "w.txt")


def test_yaml_files_cannot_run_code(tmp_path):
    (tmp_path / "w.yaml").write_text("!!python/object/apply:os.getcwd []")
    with pytest.raises(SchemaError):
        load_world(tmp_path / "w.yaml")
    assert yaml.safe_load("a: 1") == {"a": 1}


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("static.bounds", [[1, 2], [3]]),
        ("static.bounds", "wide"),
        ("goal.kind", []),
        ("robot.mass", 10**400),
        ("movables.0.outline", [[1, 2], [3]]),
        ("movables.0.mass", [1]),
        ("movables.0.id", 2**70),
        ("movables.0.twist", [[0, 0], [1]]),
        ("static.segments.0.radius", "thick"),
        ("robot.parts", [[[0, 0], [1]]]),
    ],
)
def test_malformed_values_are_one_clear_error(path, value):
    with pytest.raises(InvalidInputError):
        world_from_dict(change(path, value))


def test_nested_and_impossible_files(tmp_path):
    (tmp_path / "deep.json").write_text("[" * 100_000)
    (tmp_path / "date.yaml").write_text("time: 2001-99-99")
    for name in ("deep.json", "date.yaml"):
        with pytest.raises(SchemaError, match=name):
            load_world(tmp_path / name)
