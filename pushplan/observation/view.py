"""The window that an image observation looks through."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pushplan.observation import view_kernels
from pushplan.observation.view_kernels import Image
from pushplan.world import World
from pushplan.world.checks import FloatArray, IntArray
from pushplan.world.movables import Movables


@dataclass(frozen=True)
class View:
    """A window on the world: where its pixels are."""

    world: World  # what is looked at
    # (3,) middle of the window [m], and the direction [rad] that is up in the image; left in the
    # image is a quarter turn counter-clockwise from it
    pose: FloatArray
    rows: int  # [px]
    cols: int  # [px]
    step_up: float  # length of a pixel up the image [m]
    step_across: float  # length of a pixel across it [m]
    shift: float  # how far the middle lies up the image from the robot [m]

    @cached_property
    def numbers(self) -> FloatArray:
        """(7,) pose of the window, rows, columns, and the two steps, as kernels read them."""
        return np.array([*self.pose, self.rows, self.cols, self.step_up, self.step_across])

    @property
    def finest(self) -> float:
        """The shorter side of a pixel [m]."""
        return min(self.step_up, self.step_across)

    def pixels(self, points: FloatArray) -> FloatArray:
        """World points (N, 2) [m] as column and row [px]."""
        spots = np.empty_like(points)
        view_kernels.to_pixels(self.numbers, points, spots)
        return spots

    def fill_movables(self, image: Image, objects: Movables, value: int = 255) -> None:
        """Fill the outlines of objects."""
        view_kernels.fill_bodies(
            image,
            self.numbers,
            objects.poses,
            objects.vertices,
            objects.offsets,
            objects.radii,
            value,
        )

    def fill_parts(
        self, image: Image, vertices: FloatArray, offsets: IntArray, value: int = 255
    ) -> None:
        """Fill convex polygons given in the world frame."""
        view_kernels.fill_parts(image, self.numbers, vertices, offsets, value)

    def sample(self, image: Image, values: Image, origin: FloatArray, step: float) -> None:
        """Read a raster in the world frame at every pixel; outside it its border counts."""
        view_kernels.sample(image, self.numbers, values, origin[0], origin[1], step)
