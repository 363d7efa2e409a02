"""`ImageObservation`: what is around the robot, as images."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from pushplan.observation.channels import CHANNELS
from pushplan.observation.view import View
from pushplan.world import InvalidInputError, UnknownNameError, World
from pushplan.world.checked_fields import CheckedFields
from pushplan.world.checks import integer, number


@dataclass(frozen=True)
class ImageObservation(CheckedFields):
    """Image channels around the robot (Bench-Push, Table II).

    By default the robot is in the middle and faces up: row 0 is ahead of it, column 0 to its left.

    Args:
        channels: names from `pushplan.observation.CHANNELS`, in the order of the result.
        window: height and width of what is seen [m].
        pixels: rows and columns.
        north_up: whether the image keeps the world's axes, with +y up and +x to the right,
            instead of turning with the robot.
        shift: how far the middle of the window lies up the image from the robot [m]; a positive
            shift shows more of what is ahead.

    Raises:
        UnknownNameError: if there is no such channel.
        InvalidInputError: if a size is not positive or the shift is not finite.
    """

    channels: tuple[str, ...] = ("footprint", "movable", "static", "goal_distance")
    window: tuple[float, float] = (12.0, 12.0)
    pixels: tuple[int, int] = (192, 192)
    north_up: bool = False
    shift: float = 0.0

    low: ClassVar[int] = 0
    high: ClassVar[int] = 255
    dtype: ClassVar[np.dtype[np.uint8]] = np.dtype(np.uint8)

    def __post_init__(self) -> None:
        super().__post_init__()
        put = object.__setattr__
        if isinstance(self.channels, str) or not isinstance(self.channels, Sequence):
            raise InvalidInputError(f"channels must be a list of names, got {self.channels!r}")
        put(self, "channels", tuple(self.channels))
        if len(self.channels) == 0:
            raise InvalidInputError("channels must name at least one channel")
        for name in self.channels:
            if name not in CHANNELS:
                raise UnknownNameError("channel", name, CHANNELS)
        for name in ("window", "pixels"):
            sides = getattr(self, name)
            if isinstance(sides, str) or not isinstance(sides, Sequence) or len(sides) != 2:
                raise InvalidInputError(f"{name} needs two sides, height and width, got {sides!r}")
            put(self, name, tuple(sides))
        for side in self.window:
            number("window", side, low=0.0, open_low=True)
        for count in self.pixels:
            integer("pixels", count, low=1, high=4096)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Channels, rows, columns."""
        return len(self.channels), *self.pixels

    def view(self, world: World) -> View:
        """Return the view of an image of a world, which says where its pixels are."""
        x, y, heading = world.robot_pose.tolist()
        up = 0.5 * math.pi if self.north_up else heading
        pose = np.array([x + self.shift * math.cos(up), y + self.shift * math.sin(up), up])
        (rows, cols) = self.pixels
        (height, width) = self.window
        return View(world, pose, rows, cols, height / rows, width / cols, self.shift)

    def observe(self, world: World) -> NDArray[np.uint8]:
        """The channels (C, H, W), 0 to 255."""
        image = np.zeros(self.shape, np.uint8)
        view = self.view(world)
        for i, name in enumerate(self.channels):
            CHANNELS[name](image[i], view)
        return image
