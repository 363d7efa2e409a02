"""The window that an image observation looks through."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pushplan.world import World
from pushplan.world.checks import FloatArray

Image = np.ndarray[tuple[int, int], np.dtype[np.uint8]]


@dataclass(frozen=True)
class View:
    """A window on the world: where its pixels are."""

    world: World  # observed scene
    # (3,) middle of the window [m], and the direction [rad] that is up in the image; left in the
    # image is a quarter turn counter-clockwise from it
    pose: FloatArray
    rows: int  # [px]
    cols: int  # [px]
    step_up: float  # length of a pixel up the image [m]
    step_across: float  # length of a pixel across it [m]
    shift: float  # distance of the middle up the image from the robot [m]

    @cached_property
    def numbers(self) -> FloatArray:
        """(7,) pose of the window, rows, columns, and the two steps, as the core reads them."""
        return np.array([*self.pose, self.rows, self.cols, self.step_up, self.step_across])

    @property
    def finest(self) -> float:
        """The shorter side of a pixel [m]."""
        return min(self.step_up, self.step_across)
