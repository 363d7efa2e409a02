"""`PushPrimitive`: one row of the table of pushes that the search for pushes tries."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from pushplan.world.checked_fields import CheckedFields, NonNegativeFloat, NonNegativeInt, OneOf

SHIFTS = (0.0, 0.4, -0.4, 0.75, -0.75)
"""Places of the robot's middle beside the object, in half widths of the bumper."""


@dataclass(frozen=True)
class PushPrimitive(CheckedFields):
    """Pushes of one object: every combination of lean, shift and gain.

    Args:
        controller: ``"line"`` drives straight ahead, across an open edge of a clearance area;
            ``"path"`` steers the object along its shortest path to the goal; ``"arc"`` drives short
            arcs, ahead and back, that only relocate the object.
        leans: headings of the robot against the edge's normal, or the start of the path [deg].
        shifts: places of the robot's middle left of the object's [half widths of the bumper].
        gains: of the pushing controller that follows the path.
        clearance: distance that the path keeps from what is static [half widths of the bumper]; 0
            for 0.75 radii of the object.
        deep: whether the path goes to the middle of a receptacle instead of its nearest place.
        partners: by how many of its neighbours, the nearest ones, the path leads past, to take one
            along.
        frictions: coefficients between robot and object with which it has to succeed as well, see
            `RearrangementConfig`.
        below: an object that has so many pushes already is left out.
    """

    controller: Annotated[str, OneOf(("line", "path", "arc"))]
    leans: tuple[float, ...] = (0.0,)
    shifts: tuple[float, ...] = SHIFTS
    gains: tuple[float, ...] = (1.5,)
    clearance: NonNegativeFloat = 1.08
    deep: bool = False
    partners: NonNegativeInt = 0
    frictions: tuple[float, ...] = ()
    below: NonNegativeInt = 2

    field_prefix: ClassVar[str] = "push primitive "


_ANY = 1000

PRIMITIVES = (
    PushPrimitive("line", below=_ANY),
    PushPrimitive("line", leans=(20.0, -20.0, 40.0, -40.0), shifts=(0.0,), below=_ANY),
    PushPrimitive("path"),
    PushPrimitive("path", clearance=0.0),
    PushPrimitive("path", deep=True, shifts=(0.0,), below=_ANY),
    PushPrimitive("path", partners=4, below=_ANY),
    *(
        PushPrimitive(
            "path",
            (lean, -lean),
            gains=(0.5, 1.5),
            clearance=clearance,
            frictions=(0.0, 0.4),
            below=1,
        )
        for lean in (20.0, 40.0, 60.0, 80.0)
        for clearance in (1.08, 0.0)
    ),
    PushPrimitive(
        "arc",
        leans=(0.0, *(sign * lean for lean in range(15, 151, 15) for sign in (1.0, -1.0))),
        shifts=(*SHIFTS, 1.1, -1.1, 1.35, -1.35),
        below=1,
    ),
)
"""The table, simplest first."""
