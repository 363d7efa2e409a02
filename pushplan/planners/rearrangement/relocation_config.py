"""`RelocationConfig`: settings of the search for relocations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pushplan.world.checked_fields import (
    CheckedFields,
    NonNegativeFloat,
    PositiveFloat,
    PositiveInt,
)


@dataclass(frozen=True)
class RelocationConfig(CheckedFields):
    """Settings of the search for relocations. Lengths are in circumscribed radii of the robot.

    Args:
        objects: for how many objects, the nearest ones, relocations are looked for at first.
        cell: side of a cell of `PushCostToGo`.
        drag_cost: what a metre of an object's way costs on which the robot does not fit behind it,
            in metres pushed.
        starts: from how many places round the object a drive may begin, those of the table of
            primitives not counted.
        curvatures: of the arcs, times the robot's circumscribed radius.
        depth: how many arcs follow one another at most.
        expansions: how many states are driven on from, starts not counted.
        alike: from how many states with the object in the same place it is driven on.
        slack: how much more than the best drive found others may cost that are still looked for.
        enough: margins, over all sides from which a drive helps, after which the search ends.
        sides: how many drives are kept, each from another side.
        errors: of the prediction, that a push home afterwards has to stand: along x and y
            [circumscribed radii], and in heading [rad].
        margins: factors on them; a drive costs a radius more for each that it does not stand.
        horizon: how far a push goes by which it is seen that the object can be pushed home.
        least: by how much an object has to be moved for it to count.
        spacing: how far an object moves on until it is looked at anew.
        gain: by how much less has to be left to be done for a drive to help where no push home
            follows it.
        near: what is farther from the object does not count for the search.
    """

    objects: PositiveInt = 2
    cell: PositiveFloat = 0.125
    drag_cost: PositiveFloat = 10.0
    starts: PositiveInt = 300
    curvatures: tuple[float, ...] = (0.0, 0.7, -0.7, 1.6, -1.6)
    depth: PositiveInt = 3
    expansions: PositiveInt = 400
    alike: PositiveInt = 3
    slack: NonNegativeFloat = 2.0
    enough: PositiveInt = 24
    sides: PositiveInt = 20
    errors: tuple[tuple[float, float, float], ...] = (
        (0.08, 0.08, 0.15),
        (-0.08, 0.08, -0.15),
        (0.0, -0.1, 0.0),
    )
    margins: tuple[float, ...] = (1.0, 2.0, 3.0)
    horizon: PositiveFloat = 3.0
    least: NonNegativeFloat = 0.15
    spacing: PositiveFloat = 0.05
    gain: NonNegativeFloat = 1.0
    near: PositiveFloat = 8.0

    field_prefix: ClassVar[str] = "relocation "


RELOCATION = RelocationConfig()
"""The default settings."""
