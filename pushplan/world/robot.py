"""Robot as a planner sees it: a footprint, a mass, and the ways in which it may move."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from pushplan.errors import InvalidInputError
from pushplan.world.checked_fields import (
    CheckedFields,
    Limits,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
)
from pushplan.world.checks import ArrayRecord, FloatArray, IntArray, choice, frozen, number
from pushplan.world.convex_shapes import shapes_of
from pushplan.world.outline import flatten, grown_outline, inscribed_radius, signed_area


class Drive(enum.StrEnum):
    """Kind of motion that the robot is capable of."""

    CONSTANT_SPEED = "constant_speed"
    """Always forward at ``max_speed``; only the turn rate is free (Maze robot, ship)."""
    DIFFERENTIAL = "differential"
    """Forward speed in [min_speed, max_speed] and turn rate are free; may turn on the spot."""
    OMNIDIRECTIONAL = "omnidirectional"
    """Velocity in any direction up to ``max_speed``, and turn rate, are free."""
    CAR = "car"
    """Forward speed in [min_speed, max_speed] is free; turns on ``min_turning_radius`` at best."""


Acceleration = Annotated[float, Limits(0.0, open_low=True, finite=False)]


@dataclass(frozen=True, eq=False)
class RobotModel(ArrayRecord, CheckedFields):
    """Footprint, mass and motion limits of a robot. Body frame: x forward, y left.

    Args:
        parts: parts of the footprint as drawn, each (N, 2) corners in the body frame [m]; concave
            ones are kept as the convex parts of which they are the union.
        mass: mass as the metrics count it [kg].
        drive: how it may move.
        max_speed: greatest forward speed [m/s]; the speed itself for a constant-speed drive.
        max_turn_rate: greatest turn rate to either side [rad/s].
        min_speed: least forward speed [m/s], negative if it may reverse, else 0; a constant-speed
            drive has none other than ``max_speed``, an omnidirectional one its negative.
        max_acceleration: greatest change of the speed [m/s²]; infinite where speed can jump.
        max_turn_acceleration: greatest change of the turn rate [rad/s²].
        min_turning_radius: of a car, to the body origin, at any speed [m]; 0 for other drives.
        wheel_separation: distance between the driven wheels [m], 0 if there are none.
        contact_radius: distance [m] from the drawn parts at which they touch others: they are
            rounded by it. `contact_parts` are grown by it, and everything but files reads those.
        wheel_parts: how many of the last parts are wheels, which push objects but do not count at
            what is static; planners and planar simulators heed it.
        name: for logs and pictures.

    Raises:
        InvalidInputError: if a part has no area or a limit has no sense.
    """

    field_prefix = "robot."

    parts: tuple[FloatArray, ...]
    mass: PositiveFloat
    drive: Drive
    max_speed: PositiveFloat
    max_turn_rate: PositiveFloat
    min_speed: float = 0.0
    max_acceleration: Acceleration = math.inf
    max_turn_acceleration: Acceleration = math.inf
    min_turning_radius: NonNegativeFloat = 0.0
    wheel_separation: NonNegativeFloat = 0.0
    contact_radius: NonNegativeFloat = 0.0
    wheel_parts: NonNegativeInt = 0
    name: str = "robot"

    def __post_init__(self) -> None:
        if not isinstance(self.parts, list | tuple) or not self.parts:
            raise InvalidInputError("robot.parts must be a non-empty list of convex outlines")
        super().__post_init__()
        put = object.__setattr__
        cut = shapes_of("robot.parts", self.parts, lambda i: f"robot.parts[{i}]")
        # the largest first, as it may be a chassis
        cut = [tuple(sorted(pieces, key=signed_area, reverse=True)) for pieces in cut]
        put(self, "parts", tuple(part for pieces in cut for part in pieces))
        put(self, "drive", Drive(choice("drive", self.drive, [d.value for d in Drive])))
        if self.drive is Drive.CONSTANT_SPEED:
            put(self, "min_speed", self.max_speed)
        elif self.drive is Drive.OMNIDIRECTIONAL:
            put(self, "min_speed", -self.max_speed)
        else:  # it has to be able to stop
            number("robot.min_speed", self.min_speed, high=0.0)
        if self.wheel_parts >= len(cut):
            raise InvalidInputError(
                f"robot.wheel_parts must be less than the number of parts, {len(cut)}, "
                f"got {self.wheel_parts}"
            )
        put(self, "wheel_parts", sum(map(len, cut[len(cut) - self.wheel_parts :])))
        if (self.drive is Drive.CAR) != (self.min_turning_radius > 0.0):
            raise InvalidInputError(
                "robot.min_turning_radius must be positive for a car and 0 for other drives, "
                f"got {self.min_turning_radius:g} for the drive {self.drive.value!r}"
            )

    @classmethod
    def from_outline(cls, outline: ArrayLike, **limits: object) -> RobotModel:
        """A robot whose footprint is one outline (N, 2) [m]; the rest as in the class."""
        return cls(parts=(outline,), **limits)  # type: ignore[arg-type]

    def inflated(self, margin: float) -> RobotModel:
        """The same robot with every part grown by ``margin`` [m], with sharp corners.

        Whoever plans with it also predicts that it pushes with this footprint; `World.margin`
        keeps away from what is static alone.

        Raises:
            InvalidInputError: if the margin is negative or not finite.
        """
        margin = number("margin", margin, low=0.0)
        if margin == 0.0:
            return self
        return replace(self, parts=tuple(grown_outline(part, margin) for part in self.parts))

    @cached_property
    def contact_parts(self) -> tuple[FloatArray, ...]:
        """Parts of the footprint as others touch them: grown by the contact radius, not rounded."""
        if self.contact_radius == 0.0:
            return self.parts
        return tuple(frozen(grown_outline(part, self.contact_radius)) for part in self.parts)

    @property
    def wall_parts(self) -> tuple[FloatArray, ...]:
        """The contact parts that count at what is static: all but the wheels."""
        return self.contact_parts[: len(self.parts) - self.wheel_parts]

    @cached_property
    def _flat(self) -> tuple[FloatArray, IntArray]:
        return flatten(self.contact_parts)

    @property
    def vertices(self) -> FloatArray:
        """(V, 2) corners of all contact parts in the body frame [m], one after the other."""
        return self._flat[0]

    @property
    def offsets(self) -> IntArray:
        """(P + 1,) where each part starts in `vertices`."""
        return self._flat[1]

    @cached_property
    def circumscribed_radius(self) -> float:
        """Radius [m] of the disc about the body origin that holds the footprint."""
        return float(np.hypot(self.vertices[:, 0], self.vertices[:, 1]).max())

    @cached_property
    def inscribed_radius(self) -> float:
        """Radius [m] of the largest disc about the body origin inside one part, 0 if none."""
        return max(map(inscribed_radius, self.contact_parts))

    @property
    def turning_radius(self) -> float:
        """Least turning radius [m]: a car's own, that of other drives at full speed."""
        return self.min_turning_radius or self.max_speed / self.max_turn_rate

    @property
    def slides(self) -> bool:
        """True if the robot moves in any direction, whatever its heading."""
        return self.drive is Drive.OMNIDIRECTIONAL

    @property
    def curves_back(self) -> bool:
        """True for a car that may reverse: its shortest curves lead ahead and back."""
        return self.drive is Drive.CAR and self.min_speed < 0.0

    @property
    def turns_on_spot(self) -> bool:
        """True if the robot may turn without driving."""
        return self.drive in (Drive.DIFFERENTIAL, Drive.OMNIDIRECTIONAL)

    @property
    def can_stop(self) -> bool:
        """True if the robot may stand."""
        return self.drive is not Drive.CONSTANT_SPEED
