"""The window that an image observation looks through.

To kernels a ``view`` is (7,): pose of the window, rows, columns, and the two steps, see
`View.numbers`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry import fill_convex
from pushplan.geometry.transforms import transform_points
from pushplan.world import World
from pushplan.world.checks import FloatArray, IntArray

Image = np.ndarray[tuple[int, int], np.dtype[np.uint8]]


@kernel(allocates=True)
def to_pixels(view: FloatArray, points: FloatArray, out: FloatArray) -> None:
    """World points (N, 2) [m] to column and row [px]."""
    c = np.cos(view[2])
    s = np.sin(view[2])
    for i in range(points.shape[0]):
        dx = points[i, 0] - view[0]
        dy = points[i, 1] - view[1]
        out[i, 0] = 0.5 * view[4] - (c * dy - s * dx) / view[6]
        out[i, 1] = 0.5 * view[3] - (c * dx + s * dy) / view[5]


@kernel(allocates=True)
def fill_parts(
    image: Image, view: FloatArray, vertices: FloatArray, offsets: IntArray, value: int
) -> None:
    """Fill convex polygons (V, 2) of the world frame."""
    spots = np.empty_like(vertices)
    to_pixels(view, vertices, spots)
    for k in range(offsets.shape[0] - 1):
        fill_convex(image, spots[offsets[k] : offsets[k + 1]], value)


@kernel(allocates=True)
def fill_bodies(
    image: Image,
    view: FloatArray,
    poses: FloatArray,
    vertices: FloatArray,
    offsets: IntArray,
    radii: FloatArray,
    value: int,
) -> None:
    """Fill the outlines of the bodies that the window may show."""
    reach = 0.5 * np.hypot(view[3] * view[5], view[4] * view[6])
    corners = np.empty_like(vertices)
    spots = np.empty_like(vertices)
    for k in range(poses.shape[0]):
        far = reach + radii[k]
        if (poses[k, 0] - view[0]) ** 2 + (poses[k, 1] - view[1]) ** 2 > far * far:
            continue
        a = offsets[k]
        b = offsets[k + 1]
        transform_points(poses[k], vertices[a:b], corners[a:b])
        to_pixels(view, corners[a:b], spots[a:b])
        fill_convex(image, spots[a:b], value)


@kernel(allocates=True)
def sample(
    image: Image, view: FloatArray, values: Image, ox: float, oy: float, step: float
) -> None:
    """Read a raster with its first corner at ox, oy and cells of ``step`` [m] at every pixel."""
    c = np.cos(view[2])
    s = np.sin(view[2])
    rows, cols = values.shape
    up = view[5] / step
    across = view[6] / step
    # raster coordinates of the first pixel, and how they change along rows and columns
    front = 0.5 * (view[3] - 1.0) * up
    left = 0.5 * (view[4] - 1.0) * across
    u0 = (view[0] - ox) / step + c * front - s * left
    v0 = (view[1] - oy) / step + s * front + c * left
    for r in range(image.shape[0]):
        u = u0 - r * up * c
        v = v0 - r * up * s
        for q in range(image.shape[1]):
            j = min(max(int(np.floor(u + q * across * s)), 0), cols - 1)
            i = min(max(int(np.floor(v - q * across * c)), 0), rows - 1)
            image[r, q] = values[i, j]


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
        """(7,) pose of the window, rows, columns, and the two steps, as kernels read them."""
        return np.array([*self.pose, self.rows, self.cols, self.step_up, self.step_across])

    @property
    def finest(self) -> float:
        """The shorter side of a pixel [m]."""
        return min(self.step_up, self.step_across)
