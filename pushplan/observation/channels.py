"""The channels of image observations, by name. A new one is a function and a line in the table."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np

from pushplan.geometry import geodesic_field
from pushplan.geometry.shadows import bend_distances
from pushplan.observation.rays import draw_ray, fill_hidden
from pushplan.observation.view import Image, View
from pushplan.world import Goal, StaticMap
from pushplan.world.checks import FloatArray, IntArray, frozen
from pushplan.world.outline import flatten, transform

STATIC, MOVABLE = 255, 128
"""Values of static and of movable things in the occupancy channel."""


def footprint(image: Image, view: View) -> None:
    """Where the robot is, 255."""
    robot = view.world.robot
    vertices = frozen(transform(view.world.robot_pose, robot.vertices))
    view.fill_parts(image, vertices, robot.offsets)


def movable(image: Image, view: View) -> None:
    """What may be pushed, 255."""
    view.fill_movables(image, view.world.movables)


def static(image: Image, view: View) -> None:
    """What never moves, 255."""
    view.fill_parts(image, *_static_parts(view.world.static))


def occupancy(image: Image, view: View) -> None:
    """Both: what never moves at 255, what may be pushed at 128."""
    view.fill_movables(image, view.world.movables, MOVABLE)
    view.fill_parts(image, *_static_parts(view.world.static), STATIC)


def goal_distance(image: Image, view: View) -> None:
    """Shortest-path distance to the goal around what is static.

    0 at the goal, 255 at the farthest place from which there is a way, and where there is none.
    """
    view.sample(image, *_distance_raster(view.world.static, view.world.goal, view.finest))


def robot_distance(image: Image, view: View) -> None:
    """Shortest-path distance from the robot's origin around what is static.

    The same value is the same distance in every frame: 255 is the diagonal of the window, or
    more. What is static, and where no way leads inside the bounds, is 255 too. Pixels that the
    robot sees are exact; elsewhere the error is below one pixel.
    """
    per_metre = 255.0 / math.hypot(view.rows * view.step_up, view.cols * view.step_across)
    image[:] = _straight(
        view.rows, view.cols, view.step_up, view.step_across, *_eye(view), per_metre
    )
    static_map = view.world.static
    if len(static_map.polygons) or len(static_map.segments):
        fill_hidden(image, view, bend_distances(static_map, view.finest), per_metre)
        view.fill_parts(image, *_static_parts(static_map), 255)


def heading_line(image: Image, view: View) -> None:
    """A line one pixel wide from the robot's origin along its heading to the edge, 255."""
    x, y, heading = view.world.robot_pose.tolist()
    ahead = [x + view.finest * math.cos(heading), y + view.finest * math.sin(heading)]
    (col, row), (next_col, next_row) = view.pixels(np.array([[x, y], ahead])).tolist()
    draw_ray(image, col, row, next_col - col, next_row - row, 255)


CHANNELS: dict[str, Callable[[Image, View], None]] = {
    "footprint": footprint,
    "movable": movable,
    "static": static,
    "occupancy": occupancy,
    "goal_distance": goal_distance,
    "robot_distance": robot_distance,
    "heading_line": heading_line,
}
"""Name -> function that writes a channel into a zeroed (H, W) uint8 image."""


@functools.lru_cache(maxsize=16)
def _static_parts(static_map: StaticMap) -> tuple[FloatArray, IntArray]:
    return flatten(static_map.convex_parts)


def _eye(view: View) -> tuple[float, float]:
    """Column and row of the robot's origin [px]: the same in every frame."""
    return 0.5 * view.cols, 0.5 * view.rows + view.shift / view.step_up


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
