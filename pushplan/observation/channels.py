"""Image observations; a new channel is a function and a line in the table."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from pushplan.core import observation as core
from pushplan.geometry import geodesic_field
from pushplan.geometry.shadows import BendDistances, bend_distances
from pushplan.world import Goal, StaticMap, UnknownNameError, World
from pushplan.world.checked_fields import CheckedFields, Each, Limits
from pushplan.world.checks import FloatArray, expect, frozen
from pushplan.world.outline import transform

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

    @functools.cached_property
    def numbers(self) -> FloatArray:
        """(7,) pose of the window, rows, columns, and the two steps, as the core reads them."""
        return np.array([*self.pose, self.rows, self.cols, self.step_up, self.step_across])

    @property
    def finest(self) -> float:
        """The shorter side of a pixel [m]."""
        return min(self.step_up, self.step_across)


def draw_ray(image: Image, x: float, y: float, dx: float, dy: float, value: int) -> None:
    """Draw a line one pixel wide from a point to the edge of the image.

    Args:
        image: (H, W), changed in place.
        x: column where it starts [px], also outside the image.
        y: row where it starts [px], also outside the image.
        dx: its direction along the columns; not zero together with dy.
        dy: its direction along the rows.
        value: what the pixels are set to.
    """
    if abs(dx) < abs(dy):  # one pixel in each row then
        draw_ray(image.T, y, x, dy, dx, value)
        return
    first = math.floor(x)
    cols = np.arange(image.shape[1])
    cols = cols[cols >= first] if dx > 0.0 else cols[cols <= first]
    along = np.where(cols == first, 0.0, (cols + 0.5 - x) / dx)
    rows = np.floor(y + along * dy)
    inside = (rows >= 0) & (rows < image.shape[0])
    image[rows[inside].astype(np.int64), cols[inside]] = value


def fill_hidden(image: Image, view: View, source: BendDistances, per_metre: float) -> None:
    """Overwrite the pixels that the robot does not see by the length of the way to them.

    Args:
        image: (H, W), changed in place.
        view: the window.
        source: distances of the static map.
        per_metre: value of a pixel that is 1 m away; what passes 255, or is cut off, becomes 255.
    """
    x, y, _ = view.world.robot_pose.tolist()
    core.fill_hidden(
        image,
        view.numbers,
        x,
        y,
        source.loops,
        source.offsets,
        source.table,
        source.grid.origin,
        source.grid.resolution,
        *source.in_sight(x, y),
        per_metre,
    )


MOVABLE = 128
"""Value of movable things in the occupancy channel."""


def footprint(image: Image, view: View) -> None:
    """Draw the robot, 255."""
    robot = view.world.robot
    vertices = frozen(transform(view.world.robot_pose, robot.vertices))
    core.fill_parts(image, view.numbers, vertices, robot.offsets, 255)


def movable(image: Image, view: View) -> None:
    """Draw everything that may be pushed, 255."""
    _fill_movables(image, view, 255)


def static(image: Image, view: View) -> None:
    """Draw everything that never moves, 255."""
    _fill_static(image, view)


def occupancy(image: Image, view: View) -> None:
    """Both: what never moves at 255, what may be pushed at 128."""
    _fill_movables(image, view, MOVABLE)
    _fill_static(image, view)


def goal_distance(image: Image, view: View) -> None:
    """Shortest-path distance to the goal around what is static.

    0 at the goal, 255 at the farthest place from which there is a way, and where there is none.
    """
    values, origin, step = _distance_raster(view.world.static, view.world.goal, view.finest)
    core.sample(image, view.numbers, values, origin[0], origin[1], step)


def robot_distance(image: Image, view: View) -> None:
    """Shortest-path distance from the robot's origin around what is static.

    The same value is the same distance in every frame: 255 is the diagonal of the window, or
    more. What is static, and where no way leads inside the bounds, is 255 too. Pixels that the
    robot sees are exact; elsewhere the error is below one pixel.
    """
    per_metre = 255.0 / math.hypot(view.rows * view.step_up, view.cols * view.step_across)
    # column and row of the robot's origin [px] are the same in every frame
    eye = (0.5 * view.cols, 0.5 * view.rows + view.shift / view.step_up)
    image[:] = _straight(view.rows, view.cols, view.step_up, view.step_across, *eye, per_metre)
    static_map = view.world.static
    if not static_map.is_empty:
        fill_hidden(image, view, bend_distances(static_map, view.finest), per_metre)
        _fill_static(image, view)


def heading_line(image: Image, view: View) -> None:
    """A line one pixel wide from the robot's origin along its heading to the edge, 255."""
    x, y, heading = view.world.robot_pose.tolist()
    ahead = [x + view.finest * math.cos(heading), y + view.finest * math.sin(heading)]
    points = np.array([[x, y], ahead])
    core.to_pixels(view.numbers, points, points)
    (col, row), (next_col, next_row) = points.tolist()
    draw_ray(image, col, row, next_col - col, next_row - row, 255)


def unseen(image: Image, view: View) -> None:
    """Draw where nobody has looked yet, 255; nothing in a world that is seen as a whole."""
    hidden = view.world.unseen
    if hidden is not None:
        values = frozen(np.where(hidden.cells, np.uint8(255), np.uint8(0)))
        x, y = hidden.origin.tolist()
        core.sample(image, view.numbers, values, x, y, hidden.resolution)


CHANNELS: dict[str, Callable[[Image, View], None]] = {
    "footprint": footprint,
    "movable": movable,
    "static": static,
    "occupancy": occupancy,
    "goal_distance": goal_distance,
    "robot_distance": robot_distance,
    "heading_line": heading_line,
    "unseen": unseen,
}
"""Name -> function that writes a channel into a zeroed (H, W) uint8 image."""


def _fill_movables(image: Image, view: View, value: int) -> None:
    objects = view.world.movables
    owners = objects.part_owners
    shapes = objects.poses[owners], objects.part_vertices, objects.part_offsets
    core.fill_bodies(image, view.numbers, *shapes, objects.radii[owners], value)


def _fill_static(image: Image, view: View) -> None:
    core.fill_parts(image, view.numbers, *view.world.static.packed, 255)


@functools.lru_cache(maxsize=16)
def _straight(
    rows: int,
    cols: int,
    step_up: float,
    step_across: float,
    eye_col: float,
    eye_row: float,
    per_metre: float,
) -> Image:
    """Straight distance of each pixel from the robot."""
    up = (np.arange(rows) + 0.5 - eye_row) * step_up
    across = (np.arange(cols) + 0.5 - eye_col) * step_across
    scaled = np.rint(per_metre * np.hypot(up[:, None], across[None, :]))
    return frozen(np.minimum(scaled, 255.0).astype(np.uint8))


@functools.lru_cache(maxsize=16)
def _distance_raster(
    static_map: StaticMap, goal: Goal, step: float
) -> tuple[Image, FloatArray, float]:
    """The goal distance over the whole map as 0..255, with its corner and the side of a cell."""
    field = geodesic_field(static_map, goal, resolution=step)
    reached = field.values[np.isfinite(field.values)]
    farthest = float(reached.max()) if len(reached) else 0.0
    scaled = np.where(np.isfinite(field.filled), field.filled / (farthest or 1.0), 1.0)
    raster = np.rint(255.0 * np.clip(scaled, 0.0, 1.0)).astype(np.uint8)
    return frozen(raster), field.grid.origin, field.grid.resolution


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
