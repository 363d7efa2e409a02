"""The channels of image observations, by name. A new one is a function and a line in the table."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from pushplan.geometry import geodesic_field
from pushplan.observation.view import Image, View
from pushplan.world import Goal, StaticMap
from pushplan.world.checks import FloatArray, IntArray, frozen
from pushplan.world.outline import flatten, transform


def footprint(image: Image, view: View) -> None:
    """Where the robot is: always in the middle, facing up."""
    parts = [transform(view.world.robot_pose, part) for part in view.world.robot.parts]
    view.fill_parts(image, *flatten(parts))


def movable(image: Image, view: View) -> None:
    """What may be pushed."""
    view.fill_movables(image, view.world.movables)


def static(image: Image, view: View) -> None:
    """What never moves."""
    view.fill_parts(image, *_static_parts(view.world.static))


def goal_distance(image: Image, view: View) -> None:
    """Shortest-path distance to the goal around what is static.

    0 at the goal, 255 at the farthest place from which there is a way, and where there is none.
    """
    step = min(view.step_ahead, view.step_across)
    view.sample(image, *_distance_raster(view.world.static, view.world.goal, step))


CHANNELS: dict[str, Callable[[Image, View], None]] = {
    "footprint": footprint,
    "movable": movable,
    "static": static,
    "goal_distance": goal_distance,
}
"""Name -> function that writes a channel into a zeroed (H, W) uint8 image."""


@functools.lru_cache(maxsize=16)
def _static_parts(static_map: StaticMap) -> tuple[FloatArray, IntArray]:
    return flatten(static_map.convex_parts)


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
