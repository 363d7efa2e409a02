"""One clear top-down picture of a world, the same for every simulator."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw, ImageFont

from pushplan.drawing.canvas import Canvas, Color
from pushplan.world import ClearanceArea, Goal, GoalDisc, GoalLine, Plan, StaticMap, World
from pushplan.world.checks import FloatArray, array, integer
from pushplan.world.outline import transform

# Okabe and Ito's palette, which colour-blind readers can tell apart, on warm greys
FLOOR: Color = (250, 249, 246)
WALL: Color = (84, 84, 88)
ROBOT: Color = (0, 114, 178)
ROBOT_EDGE: Color = (0, 66, 110)
BOX: Color = (146, 94, 52)
BOX_EDGE: Color = (92, 56, 28)
WHEELED: Color = (226, 192, 140)
WHEELED_EDGE: Color = (150, 112, 62)
GHOST: Color = (214, 160, 116)
GOAL: Color = (206, 236, 222)
GOAL_EDGE: Color = (0, 158, 115)
PLAN: Color = (213, 94, 0)
TRAIL: Color = (86, 180, 233)
TEXT: Color = (40, 40, 44)


def draw_world(
    world: World,
    *,
    size_px: int = 600,
    plan: Plan | None = None,
    trail: ArrayLike | None = None,
    object_trails: ArrayLike | None = None,
    text: Sequence[str] | str | None = None,
) -> NDArray[np.uint8]:
    """Draw a world from above.

    Args:
        world: what to draw; objects on casters are light, the others dark.
        size_px: longer side of the picture [px].
        plan: drawn as a dashed line, with the outlines of where it expects to leave the objects.
        trail: (N, 2) or (N, 3) positions where the robot has been [m].
        object_trails: (N, K, 3) poses that the objects have had.
        text: lines for the top left corner.

    Returns:
        (H, W, 3) picture.

    Raises:
        InvalidInputError: if the size is not positive or a trail has the wrong shape.
    """
    size_px = integer("size_px", size_px, low=16, high=8192)
    canvas = Canvas(
        world.static.bounds, size_px, FLOOR, _ground(world.static, world.goal, size_px).copy()
    )
    unit = size_px / 600.0
    size_m = world.robot.circumscribed_radius
    if object_trails is not None:
        paths: FloatArray = array("object_trails", object_trails, (None, len(world.movables), 3))
        for k in range(paths.shape[1]):
            canvas.line(paths[:, k, :2], GHOST, 1.5 * unit)
    if plan is not None and plan.object_poses is not None:
        _ghosts(canvas, world, plan, unit)
    for k in range(len(world.movables)):
        fill, edge = (WHEELED, WHEELED_EDGE) if world.movables.wheeled[k] else (BOX, BOX_EDGE)
        canvas.polygon(world.movables.outline_world(k), fill, edge, 1.5 * unit)
    if trail is not None:
        points = np.atleast_2d(np.asarray(trail, dtype=np.float64))
        canvas.line(array("trail", points[:, :2], (None, 2)), TRAIL, 2.5 * unit)
    if plan is not None:
        canvas.line(plan.poses[:, :2], PLAN, 2.0 * unit, dash_m=0.25 * size_m)
    _robot(canvas, world, unit)
    picture = canvas.finish()
    if text:
        _write([text] if isinstance(text, str) else list(text), picture, unit)
    return np.asarray(picture)


@functools.lru_cache(maxsize=8)
def _ground(static: StaticMap, goal: Goal, size_px: int) -> Image.Image:
    """The floor with goal and walls, which stay the same from frame to frame."""
    canvas = Canvas(static.bounds, size_px, FLOOR)
    unit = size_px / 600.0
    if isinstance(goal, GoalDisc):
        canvas.disc(goal.center, goal.radius, GOAL, GOAL_EDGE, 1.5 * unit)
    elif isinstance(goal, GoalLine):
        _goal_line(canvas, static, goal, unit)
    else:
        canvas.polygon(
            goal.polygon, GOAL, GOAL_EDGE, 0.0 if isinstance(goal, ClearanceArea) else 2.0 * unit
        )
        if isinstance(goal, ClearanceArea):
            following = np.roll(goal.polygon, -1, axis=0)
            for a, b, is_open in zip(goal.polygon, following, goal.open_edges, strict=True):
                canvas.line(np.stack([a, b]), GOAL_EDGE, 2.5 * unit if is_open else 0.5 * unit)
    for polygon in static.polygons:
        canvas.polygon(polygon, WALL, WALL, 0.0)
    for line, radius in zip(static.segments, static.radii, strict=True):
        canvas.thick_segment(line, max(float(radius), 0.5 / canvas.scale), WALL)
    return canvas.image


def _goal_line(canvas: Canvas, static: StaticMap, goal: GoalLine, unit: float) -> None:
    reach = float(np.hypot(*(static.bounds[2:] - static.bounds[:2])))
    along = reach * np.array([-goal.normal[1], goal.normal[0]])
    a, b = goal.point - along, goal.point + along
    beyond = reach * goal.normal
    canvas.polygon(np.array([a, b, b + beyond, a + beyond]), GOAL, GOAL, 0.0)
    canvas.line(np.stack([a, b]), GOAL_EDGE, 2.0 * unit)


def _ghosts(canvas: Canvas, world: World, plan: Plan, unit: float) -> None:
    """Outlines of where the plan expects to leave the objects that it moves."""
    assert plan.object_poses is not None
    if plan.object_poses.shape[1] != len(world.movables):
        return
    for k in range(len(world.movables)):
        first, last = plan.object_poses[0, k], plan.object_poses[-1, k]
        if np.hypot(*(last - first)[:2]) > 1e-3 * world.movables.radii[k]:
            canvas.polygon(transform(last, world.movables.outline(k)), None, GHOST, 1.5 * unit)


def _robot(canvas: Canvas, world: World, unit: float) -> None:
    parts = world.robot_outline_world()
    for part in parts:
        canvas.polygon(part, None, ROBOT_EDGE, 2.5 * unit)
    for part in parts:
        canvas.polygon(part, ROBOT, ROBOT, 0.0)
    size = world.robot.inscribed_radius or 0.5 * world.robot.circumscribed_radius
    arrow = size * np.array([[0.75, 0.0], [-0.45, 0.5], [-0.2, 0.0], [-0.45, -0.5]])
    canvas.polygon(transform(world.robot_pose, arrow), (255, 255, 255), ROBOT, 0.0)


def _write(lines: list[str], picture: Image.Image, unit: float) -> None:
    """Lines of text in the top left corner, on a panel that keeps them readable."""
    font = _font(max(9, round(15 * unit)))
    draw = ImageDraw.Draw(picture, "RGBA")
    pad = round(8 * unit)
    text = "\n".join(lines)
    spacing = round(4 * unit)
    box = draw.multiline_textbbox((2 * pad, 2 * pad), text, font=font, spacing=spacing)
    panel = (box[0] - pad, box[1] - pad, box[2] + pad, box[3] + pad)
    draw.rounded_rectangle(panel, radius=pad, fill=(255, 255, 255, 225))
    draw.multiline_text((2 * pad, 2 * pad), text, font=font, fill=TEXT, spacing=spacing)


@functools.cache
def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)
