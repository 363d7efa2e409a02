"""Rooms in which every object has a place of its own, at random and as ReloPush publishes them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from pushplan.errors import InvalidInputError, SchemaError, short
from pushplan.files.safe_files import known_keys, name_unused, read_data
from pushplan.world import Movables, ObjectGoals, RobotModel, ScenarioError, StaticMap, World
from pushplan.world.checks import FloatArray, array, choice, integer, number
from pushplan.world.outline import transform

ARRANGEMENTS = ("random", "swapped")
SHAPES = ("box", "t")

_WALL = 0.1  # thickness [m]
_AT_BOUNDS = np.zeros((2, 2))  # of walls that are not outside
_SIDES = {"box": 0.1, "t": 0.05}  # of a box, and of the squares that a T is made of [m]
_DENSITY = 10.0  # of the objects [kg/m²]
_FREE = 1.2  # distance of places from the walls [diameters of the robot] and half a side
_APART = 1.6  # distance of two places of one time [diagonals of an object]
_GAP = 0.02  # least distance between the robot and an object at the start [m]
_TRIES = 200
_DRAWS = 400
MOST_OBJECTS = 40
HEADING_TOLERANCE = math.radians(5.0)

RELOPUSH_ROOM = (4.0, 5.4)
"""Sides of the workspace of ReloPush [m]; a corner is the origin."""
_RELOPUSH_SIDE = 0.15  # of its blocks [m]


def generate_rearrangement(
    rng: np.random.Generator,
    *,
    robot: RobotModel,
    objects: int = 8,
    shape: str = "box",
    arrangement: str = "random",
    obstacles: int = 0,
    room: tuple[float, float] = (2.845, 2.845),
    tolerance: float = 0.02,
    heading_tolerance: float = HEADING_TOLERANCE,
) -> World:
    """A room with objects, each of which has a place and a heading.

    Places keep so far from the walls that the robot gets behind an object on any side of it.

    Args:
        rng: the only source of randomness.
        robot: stands at a random pose.
        objects: how many have a place.
        shape: square boxes of 10 cm, or T shapes of 20 cm as those of Push-T (Chi et al., RSS
            2023): a bar of 4 x 1 and a stem of 1 x 3 squares.
        arrangement: places at random, or ``"swapped"``: each is where another object starts, so
            that one has to be put aside before.
        obstacles: further objects, which may be anywhere in the end.
        room: width and length [m].
        tolerance: of the positions [m].
        heading_tolerance: [rad]; of a box all four headings are the same.

    Raises:
        InvalidInputError: if a value is out of range.
        ScenarioError: if so many objects do not fit.
    """
    count = integer("objects", objects, low=1, high=MOST_OBJECTS)
    others = integer("obstacles", obstacles, low=0, high=MOST_OBJECTS)
    choice("shape", shape, SHAPES)
    choice("arrangement", arrangement, ARRANGEMENTS)
    sides = array("room", room, (2,))
    if arrangement == "swapped" and count < 2:
        raise InvalidInputError("objects must be at least 2 where they swap places, got 1")
    outline = _outline(shape)
    radius = max(float(np.hypot(*part.T).max()) for part in outline)
    margin = _FREE * 2.0 * robot.circumscribed_radius + radius
    low = -0.5 * sides + margin
    if (low >= 0.0).any():
        least = 2.0 * margin
        raise ScenarioError(
            f"the room must be wider than {least:.3g} m for this robot, "
            f"got {sides[0]:g} x {sides[1]:g} m"
        )
    apart = _APART * 2.0 * radius
    for _ in range(_TRIES):
        starts = _spread_out(rng, count + others, low, apart)
        ends = _spread_out(rng, count, low, apart)
        if starts is not None and ends is not None:
            break
    else:
        raise ScenarioError(
            f"{count + others} objects do not fit in a room of {sides[0]:g} x {sides[1]:g} m"
        )
    if arrangement == "swapped":
        ends = np.roll(starts[:count], 1, axis=0)
    movables = Movables.from_outlines([outline] * len(starts), starts, density=_DENSITY)
    static = _room(-0.5 * sides, 0.5 * sides)
    goal = ObjectGoals(
        np.arange(count),
        ends,
        np.full(count, number("tolerance", tolerance, low=0.0, open_low=True)),
        np.full(count, heading_tolerance),
        np.full(count, 4 if shape == "box" else 1),
    )
    return World(robot, _free_start(rng, robot, static, movables), static, movables, goal)


def load_relopush(
    path: str | Path,
    index: int,
    *,
    robot: RobotModel,
    tolerance: float = 0.02,
    heading_tolerance: float = HEADING_TOLERANCE,
) -> World:
    """One instance of a file of ReloPush (Ahn and Mavrogiannis, arXiv 2409.18231).

    The workspace of ReloPush bounds the origin of the robot. We add walls around it; where a block
    or a place reaches over a side, that wall is farther out, so that the robot gets there.

    Args:
        path: a JSON list of instances: ``objects`` and ``goals`` [x, y, theta], the ``robot``'s
            pose, and ``raw_other.assign``, pairs of an object and a goal.
        index: number of the instance; one past the end begins anew.
        robot: that pushes.
        tolerance: of the positions [m].
        heading_tolerance: [rad]; all four headings of a block are the same.

    Raises:
        SchemaError: if the file is missing, or not as described.
    """
    data = read_data(path, "instances of ReloPush")
    if not isinstance(data, list) or not data:
        raise SchemaError(f"{path}: expected a list of instances, got {short(data)}")
    at = integer("instance", index, low=0) % len(data)
    name = f"{path}: instance {at}"
    one = known_keys(
        name, data[at], ("objects", "robot", "goals", "raw_other"), ("objects", "robot", "goals")
    )
    other = known_keys(f"{name}: raw_other", one.get("raw_other", {}), None, ())
    try:
        pairs = list(map(tuple, other.get("assign", [])))
        pairs = pairs or list(zip(one["objects"], one["goals"], strict=True))
        starts = np.array([array(b, pose, (3,)) for b, pose in one["objects"].items()])
        order = {b: k for k, b in enumerate(one["objects"])}
        ends = np.array([array(d, one["goals"][d], (3,)) for _, d in pairs])
        ids = np.array([order[b] for b, _ in pairs])
        pose = array("robot", one["robot"], (3,))
        taken = {d for _, d in pairs}
        if len(set(pairs)) != len(taken) or not pairs:
            raise SchemaError(f"{name}: each goal needs an object of its own, got {short(pairs)}")
        unused = {f"goals.{d}" for d in one["goals"].keys() - taken}
        name_unused(name, unused | {f"raw_other.{key}" for key in other.keys() - {"assign"}})
    except InvalidInputError as error:
        raise SchemaError(f"{name}: {error}") from error
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise SchemaError(f"{name}: {short(error)} does not fit") from error
    half = 0.5 * _RELOPUSH_SIDE
    box = np.array([(-half, -half), (half, -half), (half, half), (-half, half)])
    count = len(ids)
    goal = ObjectGoals(
        ids,
        ends,
        np.full(count, tolerance),
        np.full(count, heading_tolerance),
        np.full(count, 4),
    )
    movables = Movables.from_outlines([box] * len(starts), starts, density=_DENSITY)
    corners = np.concatenate([transform(at, box) for at in (*starts, *ends)])
    low = corners.min(axis=0) < 0.0
    high = corners.max(axis=0) > RELOPUSH_ROOM
    outside = robot.circumscribed_radius * np.array([low, high])
    return World(robot, pose, _room(np.zeros(2), np.array(RELOPUSH_ROOM), outside), movables, goal)


def _outline(shape: str) -> list[FloatArray]:
    """Convex parts about the centroid of all."""
    side = _SIDES[shape]
    if shape == "box":
        return [rectangle(-0.5 * side, -0.5 * side, 0.5 * side, 0.5 * side)]
    bar = rectangle(-2.0 * side, 0.0, 2.0 * side, side)
    stem = rectangle(-0.5 * side, -3.0 * side, 0.5 * side, 0.0)
    middle = np.array([0.0, (4.0 * 0.5 - 3.0 * 1.5) / 7.0 * side])  # areas of 4 and 3 squares
    return [bar - middle, stem - middle]


def rectangle(x0: float, y0: float, x1: float, y1: float) -> FloatArray:
    """(4, 2) corners [m] of an upright rectangle, counter-clockwise."""
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])


def walls_around(
    bounds: tuple[float, float, float, float], thickness: float
) -> tuple[FloatArray, ...]:
    """Four walls, each (4, 2) corners [m], around a room x_min, y_min, x_max, y_max [m]."""
    x0, y0, x1, y1 = bounds
    t = thickness
    return (
        rectangle(x0 - t, y0 - t, x1 + t, y0),
        rectangle(x0 - t, y1, x1 + t, y1 + t),
        rectangle(x0 - t, y0, x0, y1),
        rectangle(x1, y0, x1 + t, y1),
    )


def _room(low: FloatArray, high: FloatArray, outside: FloatArray = _AT_BOUNDS) -> StaticMap:
    """Bounds, and walls (2, 2) so far outside of the low and the high ones [m]."""
    below, beyond = outside
    walls = walls_around((*(low - below).tolist(), *(high + beyond).tolist()), _WALL)
    return StaticMap.build(walls, bounds=(*low, *high))


def _spread_out(
    rng: np.random.Generator, count: int, low: FloatArray, apart: float
) -> FloatArray | None:
    """(count, 3) poses whose middles are far enough apart; None if they were not found."""
    found: list[FloatArray] = []
    for pose in rng.uniform((*low, -np.pi), (*-low, np.pi), (_DRAWS, 3)):
        if len(found) < count and all(np.hypot(*(pose - one)[:2]) >= apart for one in found):
            found.append(pose)
    return np.array(found) if len(found) == count else None


def _free_start(
    rng: np.random.Generator, robot: RobotModel, static: StaticMap, movables: Movables
) -> FloatArray:
    """(3,) pose at which the robot touches nothing."""
    taken = [
        *map(shapely.Polygon, static.polygons),
        *(shapely.Polygon(part) for k in range(len(movables)) for part in movables.parts_world(k)),
    ]
    tree: Any = shapely.STRtree(taken)
    x0, y0, x1, y1 = static.bounds.tolist()
    for pose in rng.uniform((x0, y0, -np.pi), (x1, y1, np.pi), (_DRAWS, 3)):
        parts = [shapely.Polygon(transform(pose, part)) for part in robot.contact_parts]
        if not len(tree.query(parts, "dwithin", _GAP)[0]):
            return np.asarray(pose)
    raise ScenarioError(f"there is no free start for robot {robot.name!r} among the objects")
