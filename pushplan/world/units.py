"""Doubts about a world whose values look like millimetres or degrees."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np

from pushplan.errors import InvalidInputError
from pushplan.world.goals import GoalDisc, GoalPose, ObjectGoals
from pushplan.world.outline import flatten, outline_boxes
from pushplan.world.scene import World

_MOST_TURNS = 2
"""Greatest angle that raises no doubt [turns], and greatest turn rate [turns/s]."""
_MOST_LENGTHS = 1_000
"""Greatest length of a way that raises no doubt [robot lengths]."""


class UnitsWarning(InvalidInputError, UserWarning):
    """A value looks as if it was in other units; an error where a filter of warnings says so."""


def check_units(
    world: World, name: str = "world", *, cropped: bool = False, strict: bool = False
) -> None:
    """Warn of values that are possible, but are mistakes nearly always.

    Args:
        world: the world.
        name: stands before a warning.
        cropped: obstacles may lie outside the bounds, as those of a map of which they are a part.
        strict: raise the first warning as an error.

    Raises:
        UnitsWarning: if ``strict``, or if a filter of warnings makes it an error.
    """
    doubts = [*_outside(world, cropped), *_angles(world)]
    if isinstance(world.goal, GoalDisc):
        way = float(np.hypot(*(world.goal.center - world.robot_pose[:2])))
        doubts += _length("goal.center is {} from robot.pose", way, world)
    for doubt in doubts:
        warning = UnitsWarning(f"{name}: {doubt}")
        if strict:
            raise warning
        # Python shows a text once for each place that warns, so this is the only one.
        warnings.warn(warning, stacklevel=1)


def check_length(world: World, length: float) -> None:
    """Warn of a path of a ``length`` [m] that is a thousand times that of the robot of a world."""
    for doubt in _length("the path has a length of {}", length, world):
        warnings.warn(UnitsWarning(doubt), stacklevel=1)


def _length(text: str, length: float, world: World) -> Iterator[str]:
    times = length / (2.0 * world.robot.circumscribed_radius)
    if times > _MOST_LENGTHS:
        yield f"{text.format(f'{length:,.6g} m')}, {times:,.0f} robot lengths: are these metres?"


def _outside(world: World, cropped: bool) -> Iterator[str]:
    static = world.static
    robot = outline_boxes(*flatten([np.concatenate(world.robot_outline_world())]))
    movables = outline_boxes(world.movables.vertices_world, world.movables.offsets)
    named = {"robot.parts": robot, "movables": movables}
    if isinstance(world.goal, GoalDisc):
        named["goal.center"] = np.tile(world.goal.center, 2)[None]
    if not cropped:
        count = len(static.polygons)
        named["static.polygons"] = static.boxes[:count]
        named["static.segments"] = static.boxes[count:]
    # Sensors see a little beyond the bounds.
    reach = 2.0 * world.robot.circumscribed_radius
    low = static.bounds[:2] - reach
    high = static.bounds[2:] + reach
    for key, boxes in named.items():
        found = boxes[((boxes[:, :2] > high) | (boxes[:, 2:] < low)).any(axis=1)]
        if len(found):
            yield (
                f"{key} has {len(found)} of {len(boxes)} outside static.bounds "
                f"{static.bounds.tolist()}, the first in {found[0].round(3).tolist()}: "
                "are these metres?"
            )


def _angles(world: World) -> Iterator[str]:
    goal = world.goal
    objects = world.movables
    named: dict[str, Any] = {
        "robot.pose": [world.robot_pose],
        "robot.twist": [world.robot_twist],
        "robot.max_turn_rate": [[world.robot.max_turn_rate]],
        "movables.pose": objects.poses,
        "movables.twist": objects.twists,
        "goal.heading": [[goal.heading]] if isinstance(goal, GoalPose) else [],
        "goal.places.pose": goal.poses if isinstance(goal, ObjectGoals) else [],
    }
    for key, rows in named.items():
        angles = np.array([row[-1] for row in rows])
        for k in np.flatnonzero(np.abs(angles) > _MOST_TURNS * 2.0 * np.pi)[:1].tolist():
            where = key.replace("movables", f"movables[{k}]").replace("places", f"places[{k}]")
            yield f"{where} has {angles[k]:g} rad, over {_MOST_TURNS} turns: are these degrees?"
