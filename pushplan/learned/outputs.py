"""How the output of a network becomes an action."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pushplan.world import InvalidInputError
from pushplan.world.checked_fields import CheckedFields, NonNegativeFloat, PositiveInt
from pushplan.world.checks import choice, integer, known_keys

MODES = {"turn_rate": 1, "velocity": 2, "wheels": 2, "heading": 1, "waypoint": 2}
"""Action modes of `pushplan.envs` and the number of elements of an action."""

OUTPUTS = ("continuous", "direction", "pixel_values", "chunk")
NEIGHBOURS = 1.0 / 32.0
"""How far around a tried pixel `ActionSpec.pixel` leaves pixels out, in sides of the map."""
APART = 0.3
"""How far `ActionSpec.direction` keeps from a tried direction [rad]."""

_KEYS = ("mode", "output", "shape", "repeat", "window", "step")


class BadOutputError(InvalidInputError):
    """A network gave something that is no action."""


@dataclass(frozen=True)
class ActionSpec(CheckedFields):
    """What a network puts out, and what it means.

    Args:
        mode: the action mode of the environment.
        output: ``"continuous"``: the action itself, clipped to [-1, 1]. ``"direction"``, with mode
            ``heading``: a vector (2,) in the robot's frame, x ahead and y to the left, along which
            the robot goes, but for directions that `NetworkPolicy` leaves out.
            ``"pixel_values"``, with mode ``waypoint``: a value for each pixel of
            a map around the robot, row 0 ahead and column 0 to the left; the robot drives to the
            middle of the pixel with the greatest, of equals the first, without those that
            `NetworkPolicy` leaves out. ``"chunk"``: the actions of the next steps, a row each, of
            which the first ``repeat`` are carried out.
        shape: of the output, without the batch axis.
        repeat: steps of the environment for which a decision stands.
        window: with ``pixel_values``, the side of the map [m], which has to be the task's
            ``waypoint_window``; else 0.
        step: with mode ``heading``, the task's ``heading_step`` [m]; else 0.
    """

    field_prefix = "action."

    mode: str
    output: str
    shape: tuple[int, ...]
    repeat: PositiveInt = 1
    window: NonNegativeFloat = 0.0
    step: NonNegativeFloat = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        choice("action mode", self.mode, tuple(MODES))
        choice("output", self.output, OUTPUTS)
        if isinstance(self.shape, str) or not hasattr(self.shape, "__iter__"):
            raise InvalidInputError(f"action.shape must be a list of numbers, got {self.shape!r}")
        shape = tuple(integer("action.shape", n, low=1, high=4096) for n in self.shape)
        object.__setattr__(self, "shape", shape)
        self._check_together()

    def _check_together(self) -> None:
        wanted = {"direction": "heading", "pixel_values": "waypoint"}.get(self.output, self.mode)
        if self.mode != wanted:
            raise InvalidInputError(
                f"output {self.output!r} belongs to action mode {wanted!r}, not {self.mode!r}"
            )
        if self.output == "pixel_values":
            fits = len(self.shape) == 2
        elif self.output == "chunk":
            fits = len(self.shape) == 2 and self.shape[1] == MODES[self.mode]
        else:
            fits = self.shape == (2 if self.output == "direction" else MODES[self.mode],)
        if not fits:
            raise InvalidInputError(
                f"output {self.output!r} of action mode {self.mode!r} cannot have shape "
                f"{self.shape}"
            )
        if self.output == "chunk" and self.repeat > self.shape[0]:
            raise InvalidInputError(
                f"action.repeat must be at most the {self.shape[0]} actions of a chunk, got "
                f"{self.repeat}"
            )
        for name, needed in (
            ("window", self.output == "pixel_values"),
            ("step", self.mode == "heading"),
        ):
            if needed and getattr(self, name) == 0.0:
                raise InvalidInputError(f"action.{name} must be given for mode {self.mode!r}")

    def steps(self, output: ArrayLike) -> NDArray[np.float32]:
        """(repeat, n) the actions in [-1, 1] of the steps for which an output stands.

        Raises:
            BadOutputError: as `read`.
        """
        if self.output == "chunk":
            return _clipped(self._checked(output)[: self.repeat])
        return self.held(self.read(output))

    def held(self, action: NDArray[np.float32]) -> NDArray[np.float32]:
        """(repeat, n) one action for all steps of a decision."""
        return np.tile(action, (self.repeat, 1))

    def read(self, output: ArrayLike) -> NDArray[np.float32]:
        """The action in [-1, 1] that an output asks for; of a chunk the first.

        Raises:
            BadOutputError: if it is not finite or has another shape.
        """
        if self.output == "pixel_values":
            return self.waypoint(*self.pixel(output))
        if self.output == "direction":
            return self.heading(self.direction(output))
        values = self._checked(output)
        return _clipped(values[0] if self.output == "chunk" else values)

    def pixel(self, output: ArrayLike, tried: Collection[tuple[int, int]] = ()) -> tuple[int, int]:
        """Row and column of the best pixel of ``pixel_values``.

        Args:
            output: values of the pixels.
            tried: pixels to leave out, each with its neighbours up to `NEIGHBOURS` of the map's
                side away; if nothing is left then, none is left out.

        Raises:
            InvalidInputError: if the output is another one.
            BadOutputError: as `read`.
        """
        if self.output != "pixel_values":
            raise InvalidInputError(f"output {self.output!r} has no pixels")
        values = self._checked(output)
        up, side = (int(NEIGHBOURS * pixels) for pixels in self.shape)
        open_ = np.ones(values.shape, dtype=np.bool_)
        for row, col in tried:
            open_[max(row - up, 0) : row + up + 1, max(col - side, 0) : col + side + 1] = False
        if open_.any():
            values = np.where(open_, values, -np.inf)
        row, col = divmod(int(np.argmax(values)), self.shape[1])
        return row, col

    def direction(self, output: ArrayLike, tried: Collection[float] = ()) -> float:
        """The angle of a ``direction`` in the robot's frame [rad].

        Args:
            output: the vector.
            tried: angles to keep `APART` from, by the least turn; if no angle is left then, the
                vector's own is given.

        Raises:
            InvalidInputError: if the output is another one.
            BadOutputError: as `read`.
        """
        if self.output != "direction":
            raise InvalidInputError(f"output {self.output!r} has no direction")
        values = self._checked(output)
        wanted = math.atan2(float(values[1]), float(values[0]))
        least = APART - 1e-9
        beside = (old + side for old in tried for side in (APART, -APART))
        free = [
            angle
            for angle in (wanted, *beside)
            if all(abs(math.remainder(angle - old, math.tau)) >= least for old in tried)
        ]
        return min(free, key=lambda a: abs(math.remainder(a - wanted, math.tau)), default=wanted)

    def _checked(self, output: ArrayLike) -> NDArray[Any]:
        values = np.asarray(output)
        if values.shape != self.shape or values.dtype.kind not in "fiu":
            raise BadOutputError(
                f"the network must give numbers of shape {self.shape}, it gave {values.dtype} of "
                f"shape {values.shape}"
            )
        if not np.isfinite(values).all():
            raise BadOutputError("the network gave values that are not finite")
        return values

    def waypoint(self, row: int, col: int) -> NDArray[np.float32]:
        """(2,) the action that drives to the middle of a pixel."""
        rows, cols = self.shape
        ahead, left = 1.0 - 2.0 * (row + 0.5) / rows, 1.0 - 2.0 * (col + 0.5) / cols
        return np.array([ahead, left], dtype=np.float32)

    def heading(self, angle: float) -> NDArray[np.float32]:
        """(1,) the action that goes along an angle in the robot's frame [rad]."""
        return np.array([math.remainder(angle, math.tau) / math.pi], dtype=np.float32)

    def to_dict(self) -> dict[str, Any]:
        """JSON values."""
        return {**asdict(self), "shape": list(self.shape)}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> ActionSpec:
        """Read what `to_dict` gives.

        Raises:
            SchemaError, InvalidInputError: if a key or a value is wrong.
        """
        known_keys("action", data, _KEYS, ("mode", "output", "shape"))
        return cls(**data)


def _clipped(values: NDArray[Any]) -> NDArray[np.float32]:
    clipped: NDArray[np.float32] = np.clip(values, -1.0, 1.0).astype(np.float32)
    return clipped
