"""`ImageObservation`: what is around the robot, as images."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from pushplan.observation.channels import CHANNELS, View
from pushplan.world import UnknownNameError, World
from pushplan.world.checked_fields import CheckedFields, Each, Limits
from pushplan.world.checks import expect


@dataclass(frozen=True)
class ImageObservation(CheckedFields):
    """Image channels around the robot (Bench-Push, Table II).

    By default the robot is in the middle and faces up: row 0 is ahead of it, column 0 to its left.

    Args:
        channels: names from `pushplan.observation.CHANNELS`, in the order of the result.
        window: height and width of what is seen [m].
        pixels: rows and columns.
        north_up: keep the world's axes, with +y up and +x to the right, instead of turning with
            the robot.
        shift: how far the middle of the window lies up the image from the robot [m]; a positive
            shift shows more of what is ahead.

    Raises:
        UnknownNameError: if there is no such channel.
        InvalidInputError: if a size is not positive or the shift is not finite.
    """

    channels: Annotated[tuple[str, ...], Each()] = (
        "footprint",
        "movable",
        "static",
        "goal_distance",
    )
    window: Annotated[tuple[float, float], Each(Limits(0.0, open_low=True))] = (12.0, 12.0)
    pixels: Annotated[tuple[int, int], Each(Limits(1, 4096))] = (192, 192)
    north_up: bool = False
    shift: float = 0.0

    low: ClassVar[int] = 0
    high: ClassVar[int] = 255
    dtype: ClassVar[np.dtype[np.uint8]] = np.dtype(np.uint8)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in self.channels:
            if name not in CHANNELS:
                raise UnknownNameError("channel", name, CHANNELS)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Channels, rows, columns."""
        return len(self.channels), *self.pixels

    def view(self, world: World) -> View:
        """Return the view of an image of a world, which says where its pixels are."""
        x, y, heading = expect("world", world, World).robot_pose.tolist()
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
