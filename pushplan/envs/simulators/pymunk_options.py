"""Numerical settings of the Pymunk simulator."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pushplan.world import InvalidInputError
from pushplan.world.checked_fields import CheckedFields, Limits, PositiveInt

_Small = Annotated[float, Limits(0.0, 0.2, open_low=True)]


@dataclass(frozen=True)
class PymunkOptions(CheckedFields):
    """Numerical settings. Lengths are fractions of the objects' median radius.

    Where sizes differ much, four times the least radius counts instead, if that is smaller.

    Args:
        travel: how far the fastest point of the robot may move in one substep. At the default
            (2.8 mm for a 1 m box) boxes end where substeps ten times finer put them to 0.2 % of
            their size (median) and total work agrees to 0.1 %: docs/simulators.md has the table.
        slop: overlap that the contact solver leaves alone. It has to be small against an object,
            because an object rides that far inside its pusher, and not much smaller than
            ``travel``, because an object that is pushed out of contact in each substep is hit
            again in the next and chatters.
        tolerance: overlap at which the robot is held, when something static is involved.
        decay: fraction of its speed that a rolling or floating object may lose in one substep.
        iterations: sweeps of the contact solver in each substep.
        samples: poses recorded in each call of `PymunkSimulator.step`, at even intervals.
        holds_direction: the robot keeps the direction in the world that it had when a
            command began, and turns beside that, as in the code of the 2D benchmark; else its
            velocity turns with it, on an arc.
    """

    field_prefix = "pymunk "

    travel: _Small = 0.008
    slop: _Small = 0.002
    tolerance: _Small = 0.012
    decay: _Small = 0.04
    iterations: PositiveInt = 10
    samples: PositiveInt = 8
    holds_direction: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.tolerance < self.travel + self.slop:
            raise InvalidInputError(
                f"pymunk tolerance must be at least travel + slop = "
                f"{self.travel + self.slop:g}, got {self.tolerance:g}"
            )
