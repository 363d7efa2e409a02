"""Doubts about a world whose values look like millimetres or degrees."""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from pushplan.errors import InvalidInputError
from pushplan.world.checks import FloatArray
from pushplan.world.goals import GoalDisc, GoalPose, ObjectGoals
from pushplan.world.outline import flatten, outline_boxes
from pushplan.world.scene import World

_MOST_TURNS = 2
_MOST_LENGTHS = 1_000


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
        warnings.warn(warning, stacklevel=1)  # from one place, so that each text is shown once


def check_length(world: World, length: float) -> None:
    """Warn of a path of a ``length`` [m] that is a thousand times that of the robot of a world."""
    for doubt in _length("the path has a length of {}", length, world):
        warnings.warn(UnitsWarning(doubt), stacklevel=1)


def _length(text: str, length: float, world: World) -> list[str]:
    size = 2.0 * world.robot.circumscribed_radius
    if length <= _MOST_LENGTHS * size:
        return []
    return [
        f"{text.format(f'{length:,.6g} m')}, {length / size:,.0f} robot lengths: are these metres?"
    ]


def _outside(world: World, cropped: bool) -> Iterator[str]:
    static = world.static
    objects = world.movables
    corners = objects.vertices_world
    named = {"movables": outline_boxes(corners, objects.offsets)}
    named["robot.parts"] = outline_boxes(*flatten([np.concatenate(world.robot_outline_world())]))
    if isinstance(world.goal, GoalDisc):
        named["goal.center"] = np.tile(world.goal.center, 2)[None]
    if not cropped:
        ends = static.segments.reshape(-1, 2, 2)
        named["static.polygons"] = outline_boxes(*flatten(static.polygons))
        thick = static.radii[:, None]
        named["static.segments"] = np.hstack([ends.min(axis=1) - thick, ends.max(axis=1) + thick])
    reach = 2.0 * world.robot.circumscribed_radius  # sensors see a little beyond the bounds
    low, high = static.bounds.reshape(2, 2) + [[-reach], [reach]]
    for key, boxes in named.items():
        away = (boxes[:, :2] > high) | (boxes[:, 2:] < low)
        found = boxes[away.any(axis=1)]
        if len(found):
            yield (
                f"{key} has {len(found)} of {len(boxes)} outside static.bounds "
                f"{static.bounds.tolist()}, the first from {found[0, :2].round(3).tolist()} to "
                f"{found[0, 2:].round(3).tolist()}: are these metres?"
            )


def _angles(world: World) -> Iterator[str]:
    assert world.robot_twist is not None
    goal = world.goal
    named: dict[str, ArrayLike] = {
        "robot.pose[2] [rad]": world.robot_pose[2],
        "robot.twist[2] [rad/s]": world.robot_twist[2],
        "robot.max_turn_rate [rad/s]": world.robot.max_turn_rate,
        "movables.pose[2] [rad]": world.movables.poses[:, 2],
        "movables.twist[2] [rad/s]": world.movables.twists[:, 2],
        "goal.heading [rad]": goal.heading if isinstance(goal, GoalPose) else 0.0,
        "goal.places.pose[2] [rad]": goal.poses[:, 2] if isinstance(goal, ObjectGoals) else 0.0,
    }
    for key, values in named.items():
        angles: FloatArray = np.atleast_1d(values)
        k = int(np.abs(angles).argmax()) if len(angles) else 0
        if len(angles) and abs(angles[k]) > _MOST_TURNS * 2.0 * np.pi:
            where = key.replace("movables", f"movables[{k}]").replace("places", f"places[{k}]")
            yield f"{where} is {angles[k]:g}, more than {_MOST_TURNS} turns: are these degrees?"
