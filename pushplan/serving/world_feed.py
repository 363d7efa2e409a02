"""`WorldFeed`: whole worlds, and worlds of which a message says only what has changed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pushplan.errors import short
from pushplan.serving.messages import CHANGES
from pushplan.world import (
    GoalDisc,
    GoalLine,
    InvalidInputError,
    Movables,
    ObjectGoals,
    SchemaError,
    World,
    world_from_dict,
)
from pushplan.world.checks import FloatArray, array
from pushplan.world.stored.world_files import movables_from_list, robot_from_dict
from pushplan.world.units import check_units

FARTHEST = 1e6
"""Greatest distance of anything from the origin, along x or y [m]."""
WIDEST = 1e5
"""Greatest extent of bounds, robot and goal along x or y [circumscribed radii of the robot]."""
FASTEST = 1e6
"""Greatest speed [m/s] and turn rate [rad/s] of anything."""
HEAVIEST = 1e12
"""Greatest mass of anything [kg]."""
LEAST = 1e-9
"""Least mass [kg], and least limit of the robot's motion [m/s, rad/s and their changes]: planners
divide by them."""
MAX_OBJECTS = 20_000
"""Most objects that one client may make known."""
_AT_REST = (0.0, 0.0, 0.0)


class WorldFeed:
    """Keeps what does not change between the worlds of one client: map, goal, outlines, masses.

    Args:
        robot: mapping of the robot, for worlds that have only its pose and twist.
    """

    def __init__(self, robot: Mapping[str, Any] | None = None) -> None:
        if robot is not None:
            if not isinstance(robot, Mapping):
                raise SchemaError(f"robot must be a mapping, got {short(robot)}")
            robot_from_dict({**robot, "pose": _AT_REST})
        self._robot = dict(robot or {})
        self._world: World | None = None
        self._known = Movables.empty()
        self._index: dict[int, int] = {}

    def whole(self, data: object) -> World:
        """A world by the schema of world files, from which later messages go on.

        Raises:
            SchemaError, InvalidInputError: as `world_from_dict` and `check_scale`, or if it names a
                file.
        """
        if isinstance(data, Mapping):
            static = data.get("static")
            robot = data.get("robot")
            if isinstance(static, Mapping) and ("map" in static or "unknown" in static):
                raise SchemaError(
                    "static.map names a file, which a message must not: give obstacles as "
                    "static.polygons and static.segments"
                )
            if self._robot and isinstance(robot, Mapping):
                data = {**data, "robot": {**self._robot, **robot}}
        world = world_from_dict(data)
        check_scale(world)
        if self._world is None:  # the units of a client do not change
            check_units(world)
        return self._keep(world, world.movables)

    def next(self, message: Mapping[str, Any]) -> World:
        """The world of a message: ``world``, or ``time``, ``robot_pose`` and what else changed.

        Raises:
            SchemaError, InvalidInputError: if it is neither, names an object that no world had, or
                nothing was there before.
        """
        changes = [key for key in CHANGES if key in message]
        if "world" in message:
            if changes:
                raise SchemaError(f"give either 'world' or {changes[0]!r}, not both")
            return self.whole(message["world"])
        for key in ("time", "robot_pose"):
            if key not in message:
                raise SchemaError(f"give either 'world', or 'time' and 'robot_pose'; {key!r} lacks")
        if self._world is None:
            raise InvalidInputError("send a whole 'world' first: start or reset")
        return self._changed(self._world, message)

    def _changed(self, world: World, message: Mapping[str, Any]) -> World:
        seen = self._seen(world.movables, message)
        known = self._known
        if "added" in message:
            added = movables_from_list(message["added"])
            for one in added.ids.tolist():
                if one in self._index:
                    raise InvalidInputError(
                        f"added has the id {one}, which is known already: give its pose in "
                        "'poses', or a whole 'world' if its outline has changed"
                    )
            check_shapes(added)
            seen = seen.updated(added)
            known = known.updated(added)
        world = replace(
            world,
            time=message["time"],
            robot_pose=message["robot_pose"],
            robot_twist=message.get("robot_twist", _AT_REST),
            movables=seen,
        )
        check_motion(world)
        return self._keep(world, known)

    def _seen(self, last: Movables, message: Mapping[str, Any]) -> Movables:
        """The known objects that a message gives poses of; all where they were if it gives none."""
        if "poses" not in message:
            if "ids" in message or "twists" in message:
                raise SchemaError("'ids' and 'twists' need 'poses', one [x, y, theta] for each")
            return last
        objects = self._known
        if "ids" in message:
            objects = self._chosen(message["ids"])
        rows: dict[str, FloatArray] = {}
        for name in ("poses", "twists"):
            if name not in message:
                continue
            rows[name] = array(name, message[name], (None, 3))
            if len(rows[name]) != len(objects):
                raise InvalidInputError(
                    f"{name} must have one row for each of {len(objects)} objects, got "
                    f"{len(rows[name])}: those of 'ids', or without 'ids' all that are known, in "
                    "the order of the worlds"
                )
        return objects.moved_to(**rows)

    def _chosen(self, value: Any) -> Movables:
        ids = array("ids", value, (None,), dtype=np.int64).tolist()
        for place, one in enumerate(ids):
            if one not in self._index:
                raise InvalidInputError(
                    f"ids[{place}] is {one}, which no world had: give its outline in 'added' "
                    f"(known: {short(sorted(self._index))})"
                )
        if len(set(ids)) < len(ids):
            ((most, _),) = Counter(ids).most_common(1)
            raise InvalidInputError(f"ids must be distinct, got {most} more than once")
        if ids == list(self._index):
            return self._known
        return self._known.select([self._index[one] for one in ids])

    def _keep(self, world: World, known: Movables) -> World:
        """Go on from a world, and from all objects that are known by then."""
        if len(known) > MAX_OBJECTS:
            raise InvalidInputError(
                f"a client may make {MAX_OBJECTS:,} objects known, got {len(known):,}: send a "
                "whole 'world' to begin anew"
            )
        if known is not self._known:
            self._known = known
            self._index = {one: place for place, one in enumerate(known.ids.tolist())}
        self._world = world
        return world


def check_scale(world: World) -> None:
    """Refuse a world whose map, goal, robot or objects are too large, far or fast.

    Raises:
        InvalidInputError: naming what is, the number, and the greatest one.
    """
    static = world.static
    goal = world.goal
    robot = world.robot
    _within("static.bounds", static.bounds, FARTHEST, "m")
    for name, lines in (("static.polygons", static.polygons), ("robot.parts", robot.contact_parts)):
        for line in lines:
            _within(name, line, FARTHEST, "m")
    _within("static.segments", static.segments, FARTHEST, "m")
    _within("static.radii", static.radii, FARTHEST, "m")
    _within("goal", _goal_points(world), FARTHEST, "m")
    if isinstance(goal, GoalDisc):
        _within("goal.radius", goal.radius, FARTHEST, "m")
    _within("robot.max_speed", robot.max_speed, FASTEST, "m/s", LEAST)
    _within("robot.min_speed", robot.min_speed, FASTEST, "m/s")
    _within("robot.max_turn_rate", robot.max_turn_rate, FASTEST, "rad/s", LEAST)
    _within("robot.mass", robot.mass, HEAVIEST, "kg", LEAST)
    changes = [robot.max_acceleration, robot.max_turn_acceleration]
    _within("accelerations of the robot", changes, np.inf, "m/s², rad/s²", LEAST)
    check_shapes(world.movables)
    check_motion(world)


def check_shapes(movables: Movables) -> None:
    """Refuse objects whose outlines are too large, or masses too large or small.

    Raises:
        InvalidInputError: as `check_scale`.
    """
    _within("the outline of an object", movables.vertices, FARTHEST, "m")
    _within("masses of objects", movables.masses, HEAVIEST, "kg", LEAST)


def check_motion(world: World) -> None:
    """Refuse a world whose robot or objects are too far or too fast, at the cost of a look.

    Raises:
        InvalidInputError: as `check_scale`.
    """
    assert world.robot_twist is not None
    _within("robot_pose", world.robot_pose, FARTHEST, "m, rad")
    _within("robot_twist", world.robot_twist, FASTEST, "m/s, rad/s")
    radius = world.robot.circumscribed_radius
    reach = world.static.bounds.reshape(2, 2)
    corners = np.vstack([reach, world.robot_pose[:2], _goal_points(world)])
    wide = float((corners.max(axis=0) - corners.min(axis=0)).max())
    if wide > WIDEST * radius:
        raise InvalidInputError(
            f"bounds, robot and goal may be {WIDEST:,.0f} times as far apart as the robot's "
            f"circumscribed radius, got {wide:g} m and {radius:g} m"
        )
    _within("poses of objects", world.movables.poses, FARTHEST, "m, rad")
    _within("twists of objects", world.movables.twists, FASTEST, "m/s, rad/s")


def _goal_points(world: World) -> FloatArray:
    goal = world.goal
    if isinstance(goal, GoalDisc):
        return goal.center
    if isinstance(goal, ObjectGoals):
        return goal.poses[:, :2]
    return goal.point if isinstance(goal, GoalLine) else goal.polygon


def _within(name: str, values: ArrayLike, most: float, unit: str, least: float = 0.0) -> None:
    sizes: FloatArray = np.abs(values)
    largest = sizes.max(initial=0.0)
    smallest = sizes.min(initial=np.inf)
    if largest > most:
        raise InvalidInputError(f"{name} must be at most {most:g} [{unit}], got {largest:g}")
    if smallest < least:
        raise InvalidInputError(f"{name} must be at least {least:g} [{unit}], got {smallest:g}")
