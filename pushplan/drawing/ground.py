"""The floor with goal and walls: what stays the same from frame to frame."""

from __future__ import annotations

import functools
import math

import numpy as np
from PIL import Image

from pushplan.drawing.canvas import Canvas
from pushplan.drawing.palette import Palette
from pushplan.world import (
    ClearanceArea,
    Goal,
    GoalDisc,
    GoalLine,
    GoalPose,
    ObjectGoals,
    StaticMap,
)
from pushplan.world.checks import FloatArray

Bounds = tuple[float, ...]


@functools.lru_cache(maxsize=8)
def ground_picture(
    static: StaticMap, goal: Goal, palette: Palette, shown: Bounds, size_px: int
) -> Image.Image:
    """Draw it on a canvas; the picture is kept: draw on a copy.

    Args:
        static: walls.
        goal: where something has to go.
        palette: colours.
        shown: x_min, y_min, x_max, y_max of the picture [m].
        size_px: longer side of the picture [px].
    """
    canvas = Canvas(np.array(shown), size_px, palette.floor)
    draw_ground(canvas, static, goal, palette)
    return canvas.image


def draw_ground(canvas: Canvas, static: StaticMap, goal: Goal, palette: Palette) -> None:
    """Draw it on any canvas."""
    fill, edge = palette.goal
    if isinstance(goal, GoalDisc):
        canvas.disc(goal.center, max(goal.radius, canvas.metres(3.0)), fill, edge, 1.5)
        if isinstance(goal, GoalPose) and goal.heading_tolerance < math.pi:
            canvas.polygon(goal.arrow(max(goal.radius, canvas.metres(14.0))), edge, edge)
    elif isinstance(goal, GoalLine):
        reach = 2.0 * float(np.hypot(*(static.bounds[2:] - static.bounds[:2])))
        along = reach * np.array([-goal.normal[1], goal.normal[0]])
        a = goal.point - along
        b = goal.point + along
        beyond = reach * goal.normal
        canvas.polygon(np.array([a, b, b + beyond, a + beyond]), fill, fill)
        canvas.line(np.stack([a, b]), edge, 2.5)
    elif isinstance(goal, ClearanceArea):
        _clearance_area(canvas, goal, palette)
    elif isinstance(goal, ObjectGoals):
        floor = StaticMap.build(bounds=static.bounds)
        for place in (*goal.places, goal.robot):
            if place is not None:
                draw_ground(canvas, floor, place, palette)
    else:
        canvas.polygon(goal.polygon, fill, edge, 3.0)
    for polygon in static.polygons:
        canvas.polygon(polygon, palette.wall, palette.wall)
    for line, radius in zip(static.segments, static.radii, strict=True):
        canvas.thick_segment(line, max(float(radius), canvas.metres(1.5)), palette.wall)


def _clearance_area(canvas: Canvas, goal: ClearanceArea, palette: Palette) -> None:
    """Open edges are thick and have arrows that point out; closed ones are thin and dashed."""
    fill, edge = palette.goal
    canvas.polygon(goal.polygon, fill, fill)
    ends = np.roll(goal.polygon, -1, axis=0)
    spacing = canvas.metres(40.0)
    for a, b, is_open in zip(goal.polygon, ends, goal.open_edges, strict=True):
        if not is_open:
            canvas.line(np.stack([a, b]), palette.wall, 1.5, dash_m=0.2 * spacing)
            continue
        canvas.line(np.stack([a, b]), edge, 3.5)
        length = float(np.hypot(*(b - a)))
        along: FloatArray = (b - a) / length
        half_width = 0.13 * spacing * along
        height = 0.22 * spacing * np.array([along[1], -along[0]])
        count = max(1, round(length / spacing))
        for fraction in np.arange(0.5, count) / count:
            base = a + fraction * (b - a) + 0.2 * height
            arrow = np.array([base - half_width, base + half_width, base + height])
            canvas.polygon(arrow, edge, edge)
