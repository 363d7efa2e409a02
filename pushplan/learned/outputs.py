"""Conversion of network outputs into actions."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pushplan.world import InvalidInputError
from pushplan.world.checked_fields import CheckedFields, Each, Limits, NonNegativeFloat, PositiveInt
from pushplan.world.checks import choice

MODES = {"turn_rate": 1, "velocity": 2, "wheels": 2, "heading": 1, "waypoint": 2}
"""Action modes of `pushplan.envs` and the number of elements of an action."""

OUTPUTS = ("continuous", "direction", "pixel_values", "chunk")
CHOOSING = ("direction", "pixel_values")
"""Outputs that `ActionSpec.choose` makes a choice of."""
NEIGHBOURS = 1.0 / 32.0
"""Radius around a tried pixel that `ActionSpec.choose` leaves out, in sides of the map."""
APART = 0.3
"""Angle that `ActionSpec.choose` keeps from a tried direction [rad]."""


class BadOutputError(InvalidInputError):
    """A network gave something that is no action."""


@dataclass(frozen=True)
class ActionSpec(CheckedFields):
    """Format of a network's output, and its meaning.

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
    shape: Annotated[tuple[int, ...], Each(Limits(1, 4096))]
    repeat: PositiveInt = 1
    window: NonNegativeFloat = 0.0
    step: NonNegativeFloat = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        choice("action mode", self.mode, tuple(MODES))
        choice("output", self.output, OUTPUTS)
        self._check_together()

    def _check_together(self) -> None:
        wanted = {"direction": "heading", "pixel_values": "waypoint"}.get(self.output, self.mode)
        if self.mode != wanted:
            raise InvalidInputError(
                f"output {self.output!r} belongs to action mode {wanted!r}, not {self.mode!r}"
            )
        size = MODES[self.mode]
        rows = self.shape[:1]
        wanted_shape = {"direction": (2,), "chunk": (*rows, size), "continuous": (size,)}
        if self.output == "pixel_values":
            fits = len(self.shape) == 2
        else:
            fits = self.shape == wanted_shape[self.output]
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
            BadOutputError: if it is not finite or has another shape.
        """
        if self.output in CHOOSING:
            return self.chosen(self.choose(output))
        actions = np.clip(self._checked(output), -1.0, 1.0).astype(np.float32)
        if self.output == "chunk":
            chunk: NDArray[np.float32] = actions[: self.repeat]
            return chunk
        return self._held(actions)

    def choose(self, output: ArrayLike, tried: Collection[Any] = ()) -> Any:
        """The best pixel of ``pixel_values`` or the angle of a ``direction``.

        Args:
            output: values of the pixels, or the vector.
            tried: what to leave out: pixels, each with its neighbours up to `NEIGHBOURS` of the
                map's side away, or angles, from which the least turn keeps `APART`; if nothing is
                left then, none is left out.

        Returns:
            Row and column of the pixel, or the angle in the robot's frame [rad].

        Raises:
            InvalidInputError: if the output is another one.
            BadOutputError: as `steps`.
        """
        if self.output not in CHOOSING:
            raise InvalidInputError(f"output {self.output!r} has nothing to choose from")
        values = self._checked(output)
        if self.output == "direction":
            return _best_angle(math.atan2(float(values[1]), float(values[0])), tried)
        up, side = (int(NEIGHBOURS * pixels) for pixels in self.shape)
        open_ = np.ones(values.shape, dtype=np.bool_)
        for row, col in tried:
            open_[max(row - up, 0) : row + up + 1, max(col - side, 0) : col + side + 1] = False
        if open_.any():
            values = np.where(open_, values, -np.inf)
        return divmod(int(np.argmax(values)), self.shape[1])

    def chosen(self, choice: Any) -> NDArray[np.float32]:
        """(repeat, n) the actions that drive to the middle of a pixel, or go along an angle."""
        if self.output == "direction":
            action = [math.remainder(choice, math.tau) / math.pi]
        else:
            action = [
                1.0 - 2.0 * (at + 0.5) / count for at, count in zip(choice, self.shape, strict=True)
            ]
        return self._held(np.array(action, dtype=np.float32))

    def _held(self, action: NDArray[np.float32]) -> NDArray[np.float32]:
        return np.tile(action, (self.repeat, 1))

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


def _best_angle(wanted: float, tried: Collection[float]) -> float:
    """The angle nearest to a wanted one [rad] that keeps `APART` from all that were tried."""
    least = APART - 1e-9
    beside = (old + side for old in tried for side in (APART, -APART))
    free = [
        angle
        for angle in (wanted, *beside)
        if all(abs(math.remainder(angle - old, math.tau)) >= least for old in tried)
    ]
    return min(free, key=lambda a: abs(math.remainder(a - wanted, math.tau)), default=wanted)
