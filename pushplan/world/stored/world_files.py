"""Worlds in JSON and YAML files, exact both ways. The schema is described in docs/world-file.md."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from pushplan.errors import InvalidInputError, SchemaError, short, unknown_name_message
from pushplan.files.safe_files import known_keys, read_data
from pushplan.files.safe_yaml import dump
from pushplan.world.checks import array, boolean, integer, number, word
from pushplan.world.convex_shapes import (
    areas_and_centres,
    disjoint,
    listed_corners,
    shapes_of,
)
from pushplan.world.goals import (
    ClearanceArea,
    Goal,
    GoalDisc,
    GoalLine,
    GoalPose,
    ObjectGoals,
    Receptacle,
)
from pushplan.world.movables import Movables
from pushplan.world.robot import RobotModel
from pushplan.world.scene import World
from pushplan.world.static_map import StaticMap
from pushplan.world.stored.nav2_map import load_nav2_map
from pushplan.world.units import check_units

SCHEMA = "pushplan-world/1"
"""Name and version of the file format; files of another version are refused."""

_ROBOT_NEEDS = ("parts", "mass", "drive", "max_speed", "max_turn_rate", "pose")
_ROBOT_KEYS = (
    *("name", "drive", "parts", "mass", "max_speed", "max_turn_rate"),
    *("min_speed", "max_acceleration", "max_turn_acceleration", "min_turning_radius"),
    *("wheel_separation", "contact_radius", "wheel_parts"),
)
_LEFT_OUT = {
    "max_acceleration": math.inf,
    "max_turn_acceleration": math.inf,
    "contact_radius": 0.0,
    "wheel_parts": 0,
    "gyration_radius": 0.0,
    "fixed": False,
    "margin": 0.0,
}
"""Values that are not written."""
_GOALS: dict[str, tuple[type[Any], tuple[str, ...]]] = {
    "pose": (GoalPose, ("center", "radius", "heading", "heading_tolerance")),
    "disc": (GoalDisc, ("center", "radius")),
    "line": (GoalLine, ("point", "normal")),
    "receptacle": (Receptacle, ("polygon",)),
    "clearance_area": (ClearanceArea, ("polygon", "open_edges")),
}


_OBJECTS = "objects"
_PLACE = {
    "id": "ids",
    "pose": "poses",
    "radius": "radii",
    "heading_tolerance": "heading_tolerances",
    "symmetry": "symmetries",
    "group": "groups",
}
"""Keys of the place of an object, and the fields of `ObjectGoals` that take them."""


def world_to_dict(world: World) -> dict[str, Any]:
    """The world as plain lists, numbers and texts, ready for JSON or YAML."""
    robot = {key: _plain(getattr(world.robot, key)) for key in _ROBOT_KEYS}
    robot["drive"] = world.robot.drive.value
    robot["pose"] = _plain(world.robot_pose)
    robot["twist"] = _plain(world.robot_twist)
    objects = world.movables
    columns = {
        "id": objects.ids,
        "pose": objects.poses,
        "twist": objects.twists,
        "outline": [listed_corners(objects.drawn_parts(k)) for k in range(len(objects))],
        "contact_radius": objects.contact_radii,
        "gyration_radius": objects.gyration_radii,
        "mass": objects.masses,
        "wheeled": objects.wheeled,
        "fixed": objects.fixed,
    }
    rows = [
        dict(zip(columns, row, strict=True))
        for row in zip(*map(_plain, columns.values()), strict=True)
    ]
    for k in np.flatnonzero(np.diff(objects.first_parts) > 1).tolist():
        rows[k]["parts"] = rows[k].pop("outline")
    static = {
        "bounds": _plain(world.static.bounds),
        "polygons": _plain(world.static.polygons),
        "segments": [
            {"from": line[:2].tolist(), "to": line[2:].tolist(), "radius": float(radius)}
            for line, radius in zip(world.static.segments, world.static.radii, strict=True)
        ],
    }
    return _written(
        {
            "schema": SCHEMA,
            "time": world.time,
            "margin": world.margin,
            "robot": _written(robot),
            "static": static,
            "movables": [_written(row) for row in rows],
            "goal": _goal_to_dict(world.goal),
        }
    )


def _goal_to_dict(goal: Goal) -> dict[str, Any]:
    if isinstance(goal, ObjectGoals):
        columns = [_plain(getattr(goal, name)) for name in _PLACE.values()]
        places = [dict(zip(_PLACE, row, strict=True)) for row in zip(*columns, strict=True)]
        written: dict[str, Any] = {"kind": _OBJECTS, "places": places}
        if goal.robot is not None:
            written["robot"] = _goal_to_dict(goal.robot)
        return written
    kind, keys = next((kind, keys) for kind, (cls, keys) in _GOALS.items() if isinstance(goal, cls))
    return {"kind": kind, **{key: _plain(getattr(goal, key)) for key in keys}}


def _plain(value: Any) -> Any:
    """Arrays, and tuples of them, as lists."""
    if isinstance(value, tuple):
        return [part.tolist() for part in value]
    return value.tolist() if isinstance(value, np.ndarray) else value


def _written(values: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if value != _LEFT_OUT.get(key)}


def world_from_dict(data: object, folder: str | Path = ".") -> World:
    """Read what `world_to_dict` wrote, or what a person wrote by the same schema.

    Args:
        data: the mapping.
        folder: where the file of a map is looked for, if ``data`` name one.

    Raises:
        SchemaError: an unknown or missing key, or another schema version.
        InvalidInputError: a value that the types of `pushplan.world` refuse.
    """
    data = known_keys(
        "world file",
        data,
        ("schema", "time", "margin", "robot", "static", "movables", "goal"),
        ("schema", "robot", "goal"),
    )
    if data["schema"] != SCHEMA:
        raise SchemaError(f"this pushplan reads schema {SCHEMA!r}, got {short(data['schema'])}")
    robot, pose, twist = robot_from_dict(data["robot"])
    movables = movables_from_list(data.get("movables", []))
    goal = _goal(data["goal"])
    if isinstance(goal, ObjectGoals):
        for label in goal.ids[~np.isin(goal.ids, movables.ids)].tolist():
            raise SchemaError(
                unknown_name_message("object id", label, map(str, movables.ids.tolist()))
            )
    return World(
        robot=robot,
        robot_pose=pose,
        robot_twist=twist,
        static=_static(data.get("static", {}), Path(folder)),
        movables=movables,
        goal=goal,
        time=data.get("time", 0.0),
        margin=data.get("margin", 0.0),
    )


def load_world(path: str | Path, *, strict: bool = False) -> World:
    """Read a world from a ``.json``, ``.yaml`` or ``.yml`` file.

    Values that look like other units, such as walls outside the bounds or a heading of more than
    two turns, are reported by a `pushplan.world.units.UnitsWarning`.

    Args:
        path: the file.
        strict: raise that warning as an error.

    Raises:
        SchemaError: if the file is missing, over a limit of `safe_files`, not readable as JSON or
            YAML, or off the schema.
        InvalidInputError: if the types of `pushplan.world` refuse a value, or ``strict`` does.
    """
    data = read_data(path, "world file")
    path = Path(path)
    try:
        world = world_from_dict(data, path.parent)
    except InvalidInputError as error:
        raise type(error)(f"{path}: {error}") from error
    check_units(world, str(path), cropped="map" in data.get("static", {}), strict=strict)
    return world


def save_world(world: World, path: str | Path) -> None:
    """Write a world to a ``.json``, ``.yaml`` or ``.yml`` file.

    `load_world` gives it back equal, but for prices, which files leave out.

    Raises:
        SchemaError: if the ending is none of these.
    """
    path = Path(path)
    data = world_to_dict(world)
    if path.suffix == ".json":
        text = json.dumps(data, indent=1)
    elif path.suffix in (".yaml", ".yml"):
        text = dump(data, default_flow_style=None)
    else:
        raise SchemaError(f"a world file ends in .json, .yaml or .yml, got {path.name!r}")
    path.write_text(text, encoding="utf-8")


def robot_from_dict(data: object) -> tuple[RobotModel, Any, Any]:
    """The robot, its pose and its twist, as the key ``robot`` of a world has them.

    Raises:
        SchemaError, InvalidInputError: as `world_from_dict`.
    """
    fields = dict(known_keys("robot", data, (*_ROBOT_KEYS, "pose", "twist"), _ROBOT_NEEDS))
    pose = fields.pop("pose")
    twist = fields.pop("twist", None)
    robot = RobotModel(**fields)
    checked = array("robot.pose", pose, (3,))
    return robot, checked, None if twist is None else array("robot.twist", twist, (3,))


def _static(data: object, folder: Path) -> StaticMap:
    data = known_keys("static", data, ("bounds", "polygons", "segments", "map", "unknown"), ())
    polygons = _list("static.polygons", data.get("polygons", []))
    bounds = data.get("bounds")
    if "map" in data:
        file = folder / word("static.map", data["map"])
        grid = load_nav2_map(file, unknown=data.get("unknown", "obstacle"))
        polygons = [*grid.polygons, *polygons]
        bounds = grid.bounds if bounds is None else bounds
    elif "unknown" in data:
        raise SchemaError("static.unknown says how to read a map: it needs static.map")
    lines = []
    radii = []
    for i, segment in enumerate(_list("static.segments", data.get("segments", []))):
        known_keys(f"static.segments[{i}]", segment, ("from", "to", "radius"), ("from", "to"))
        ends = [_list(f"static.segments[{i}].{end}", segment[end]) for end in ("from", "to")]
        lines.append(array(f"static.segments[{i}]", [*ends[0], *ends[1]], (4,)))
        radii.append(number(f"static.segments[{i}].radius", segment.get("radius", 0.0), low=0.0))
    return StaticMap.build(polygons, lines, radii, bounds)


_COLUMNS: dict[str, Callable[[str, Any], Any]] = {
    "pose": partial(array, shape=(3,)),
    "twist": partial(array, shape=(3,)),
    "mass": partial(number, low=0.0, open_low=True),
    "wheeled": boolean,
    "fixed": boolean,
    "contact_radius": partial(number, low=0.0),
    "gyration_radius": partial(number, low=0.0),
    "id": partial(integer, low=-(2**63), high=2**63 - 1),
}
"""Checks of what a file says of an object, beside its outline."""
_AT_REST = {
    "twist": [0.0, 0.0, 0.0],
    "wheeled": False,
    "fixed": False,
    "contact_radius": 0.0,
    "gyration_radius": 0.0,
}
_SHAPES = ("polygon", "outline", "parts")


def movables_from_list(data: object) -> Movables:
    """The objects, as the key ``movables`` of a world has them.

    Raises:
        SchemaError, InvalidInputError: as `world_from_dict`.
    """
    items = _list("movables", data)
    kinds = []
    for i, item in enumerate(items):
        name = f"movables[{i}]"
        known_keys(name, item, (*_COLUMNS, *_SHAPES), ())
        kinds += [kind for kind in _SHAPES if kind in item]
        if len(kinds) != i + 1 or (kinds[i] == "polygon") == ("pose" in item):
            raise SchemaError(
                f"{name} needs either 'polygon' (world frame), or 'pose' and 'outline' or 'parts' "
                "(body frame)"
            )
    if not items:
        return Movables.empty()
    given_shapes = [item[kind] for item, kind in zip(items, kinds, strict=True)]
    shapes = shapes_of("movables", given_shapes, lambda i: f"movables[{i}].{kinds[i]}")
    areas, centres = areas_and_centres([disjoint(parts) for parts in shapes])
    columns: dict[str, list[Any]] = {key: [] for key in _COLUMNS}
    for i, item in enumerate(items):
        given = {"id": i, **_AT_REST, **item}
        if kinds[i] == "polygon":
            given["pose"] = [*centres[i], 0.0]
            shapes[i] = tuple(part - centres[i] for part in shapes[i])
        if given.get("mass") is None:
            given["mass"] = float(areas[i])
        for key, check in _COLUMNS.items():
            columns[key].append(check(f"movables[{i}].{key}", given[key]))
    return Movables.from_outlines(
        shapes,
        columns["pose"],
        masses=columns["mass"],
        wheeled=columns["wheeled"],
        twists=columns["twist"],
        ids=columns["id"],
        contact_radii=columns["contact_radius"],
        fixed=columns["fixed"],
        gyration_radii=columns["gyration_radius"],
    )


def _goal(data: object) -> Goal:
    kind = data.get("kind") if isinstance(data, Mapping) else data
    kinds = (*_GOALS, _OBJECTS)
    if not isinstance(data, Mapping) or not isinstance(kind, str) or kind not in kinds:
        raise SchemaError(unknown_name_message("goal kind", kind, kinds))
    if kind == _OBJECTS:
        return _object_goals(data)
    cls, keys = _GOALS[kind]
    known_keys("goal", data, ("kind", *keys), keys)
    goal: Goal = cls(**{key: data[key] for key in keys})
    return goal


def _object_goals(data: Mapping[str, Any]) -> ObjectGoals:
    known_keys("goal", data, ("kind", "places", "robot"), ("places",))
    robot = _goal(data["robot"]) if "robot" in data else None
    if not (robot is None or isinstance(robot, GoalDisc)):
        raise SchemaError("goal.robot must be of kind disc or pose")
    rows = []
    for i, place in enumerate(_list("goal.places", data["places"])):
        name = f"goal.places[{i}]"
        row = known_keys(name, place, tuple(_PLACE), ("id", "pose", "radius"))
        row = {"heading_tolerance": math.pi, "symmetry": 1, "group": None, **row}
        for key in ("id", "symmetry", "group"):
            if row[key] is not None:
                row[key] = integer(f"{name}.{key}", row[key], low=-(2**62), high=2**62)
        for key in ("radius", "heading_tolerance"):
            row[key] = number(f"{name}.{key}", row[key], low=0.0, open_low=True)
        row["pose"] = array(f"{name}.pose", row["pose"], (3,))
        rows.append(row)
    free = itertools.count(max((row["group"] or 0 for row in rows), default=0) + 1)
    for row in rows:  # one that names no group is in one of its own
        row["group"] = next(free) if row["group"] is None else row["group"]
    columns: dict[str, Any] = {name: [row[key] for row in rows] for key, name in _PLACE.items()}
    return ObjectGoals(**columns, robot=robot)


def _list(name: str, value: object) -> Sequence[Any]:
    if not isinstance(value, list):
        raise SchemaError(f"{name} must be a list, got {short(value)}")
    return value
