"""`WorldFeed`: whole worlds, and worlds of which a message says only what has changed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from pushplan.errors import short
from pushplan.serving.messages import CHANGES
from pushplan.serving.scale import check_motion, check_scale, check_shapes
from pushplan.world import InvalidInputError, Movables, SchemaError, World, world_from_dict
from pushplan.world.checks import FloatArray, array
from pushplan.world.stored.world_files import movables_from_list, robot_from_dict
from pushplan.world.units import check_units

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
