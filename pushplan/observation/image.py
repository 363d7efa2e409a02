"""`ImageObservation`: what is around the robot, as images that turn with it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from pushplan.observation.channels import CHANNELS
from pushplan.observation.view import View
from pushplan.world import InvalidInputError, UnknownNameError, World
from pushplan.world.checks import integer, number


@dataclass(frozen=True)
class ImageObservation:
    """Egocentric image channels (Bench-Push, Table II).

    The robot is in the middle and faces up: row 0 is ahead of it, column 0 to its left.

    Args:
        channels: names from `pushplan.observation.CHANNELS`, in the order of the result.
        window: length ahead to behind, and left to right [m].
        pixels: rows and columns.

    Raises:
        UnknownNameError: if there is no such channel.
        InvalidInputError: if a size is not positive.
    """

    channels: tuple[str, ...] = ("footprint", "movable", "static", "goal_distance")
    window: tuple[float, float] = (12.0, 12.0)
    pixels: tuple[int, int] = (192, 192)

    low: ClassVar[int] = 0
    high: ClassVar[int] = 255
    dtype: ClassVar[np.dtype[np.uint8]] = np.dtype(np.uint8)

    def __post_init__(self) -> None:
        if isinstance(self.channels, str) or len(self.channels) == 0:
            raise InvalidInputError(f"channels must be a list of names, got {self.channels!r}")
        for name in self.channels:
            if name not in CHANNELS:
                raise UnknownNameError("channel", name, CHANNELS)
        if len(self.window) != 2 or len(self.pixels) != 2:
            raise InvalidInputError(
                f"window and pixels need two sides each, got {self.window!r} and {self.pixels!r}"
            )
        for side in self.window:
            number("window", side, low=0.0, open_low=True)
        for count in self.pixels:
            integer("pixels", count, low=1, high=4096)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Channels, rows, columns."""
        return len(self.channels), *self.pixels

    def observe(self, world: World) -> NDArray[np.uint8]:
        """The channels (C, H, W), 0 to 255."""
        image = np.zeros(self.shape, np.uint8)
        rows, cols = self.pixels
        view = View(world, rows, cols, self.window[0] / rows, self.window[1] / cols)
        for i, name in enumerate(self.channels):
            CHANNELS[name](image[i], view)
        return image
