"""One clear top-down picture of a world, the same for every simulator."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw, ImageFont

from pushplan.drawing.canvas import Canvas
from pushplan.drawing.ground import Bounds, ground_picture
from pushplan.drawing.palette import FLOOR_PALETTE, Palette, palette_of
from pushplan.world import ObjectGoals, Plan, StaticMap, World
from pushplan.world.checks import FloatArray, array, frozen, integer, number
from pushplan.world.outline import transform

Font = ImageFont.FreeTypeFont | ImageFont.ImageFont
LONG = 2.5
LONGEST = 1.6
"""Of a world whose longer side is more than `LONG` times the shorter one, a film shows `LONGEST`
times the shorter side."""
SHORT = 6.0
"""Length of the dashes of a plan at least, at 600 px [px]."""
RIM = 0.02
"""Fraction of the longer side that walls outside the bounds add to a picture on each side."""


def draw_world(
    world: World,
    *,
    size_px: int = 600,
    view: float | None = None,
    plan: Plan | None = None,
    trail: ArrayLike | None = None,
    object_trails: ArrayLike | None = None,
    text: Sequence[str] | str | None = None,
) -> NDArray[np.uint8]:
    """Draw a world from above.

    A world with a goal line and nothing static is drawn as water with ice on it; what nobody has
    seen is grey.

    Args:
        world: what to draw; objects on casters are light, the others dark.
        size_px: longer side of the picture [px].
        view: length of the world's longer side that is shown [m], all of it by default; the
            picture then follows the robot. Films take that of `film_view`.
        plan: drawn as a dashed line, with the paths on which it expects objects to be pushed and
            their outlines at the end.
        trail: (N, 2) or (N, 3) positions where the robot has been [m].
        object_trails: (N, K, 3) poses that the objects have had.
        text: lines for the top left corner.

    Returns:
        (H, W, 3) picture.

    Raises:
        InvalidInputError: if a size is not positive or a trail has the wrong shape.
    """
    size_px = integer("size_px", size_px, low=16, high=8192)
    shown = view_bounds(world, size_px, view)
    palette = palette_of(world)
    ground = ground_picture(world.static, world.goal, palette, shown, size_px)
    canvas = Canvas(np.array(shown), size_px, palette.floor)
    canvas.image.paste(ground)
    if world.unseen is not None:
        canvas.shade(world.unseen, palette.unseen)
    draw_moving(canvas, world, plan, trail, object_trails)
    picture = canvas.finish()
    if text:
        lines = [text] if isinstance(text, str) else list(map(str, text))
        _write(lines, picture, canvas.unit)
    return np.asarray(picture)


def draw_moving(
    canvas: Canvas,
    world: World,
    plan: Plan | None,
    trail: ArrayLike | None,
    object_trails: ArrayLike | None,
) -> None:
    """Draw robot, objects, plan and paths of `draw_world` over the ground."""
    palette = palette_of(world)
    objects = world.movables
    if object_trails is not None:
        paths: FloatArray = array("object_trails", object_trails, (None, len(objects), 3))
        for k in range(len(objects)):
            canvas.line(paths[:, k, :2], palette.ghost, 1.5)
    if isinstance(world.goal, ObjectGoals):
        for part in world.goal_polygons:
            canvas.polygon(part, None, palette.goal[1], 1.5)
        places = world.goal.assigned(objects.ids, objects.poses)
        for k in np.flatnonzero(places >= 0).tolist():
            line = np.stack([objects.poses[k, :2], world.goal.poses[places[k], :2]])
            canvas.line(line, palette.goal[1], 1.0, dash_m=canvas.metres(SHORT))
    reach = canvas.bounds
    middles = objects.poses[:, :2]
    radii = objects.radii[:, None]
    seen = ((middles + radii > reach[:2]) & (middles - radii < reach[2:])).all(axis=1)
    for k in np.flatnonzero(seen).tolist():
        fill, edge = palette.wheeled if objects.wheeled[k] else palette.box
        if objects.fixed[k]:
            fill, edge = palette.fixed
        pose = objects.poses[k]
        parts = objects.parts(k)
        if len(parts) == 1:
            canvas.polygon(transform(pose, parts[0]), fill, edge, palette.box_edge_px)
            continue
        rings = objects.rings(k)
        if len(rings) > 1:  # shows which legs are of one table
            canvas.polygon(transform(pose, objects.outline(k)), None, palette.ghost, 1.0)
        for part in parts:
            canvas.polygon(transform(pose, part), fill, fill)
        for ring in rings:
            canvas.polygon(transform(pose, ring), None, edge, palette.box_edge_px)
    for poses, rings in pushed(world, plan):  # and where the plan expects them at its end
        canvas.line(poses[:, :2], palette.prediction, 1.5)
        for ring in rings:
            canvas.polygon(transform(poses[-1], ring), None, palette.prediction, 2.0)
    if trail is not None:
        points = np.atleast_2d(np.asarray(trail, dtype=np.float64))
        canvas.line(array("trail", points[:, :2], (None, 2)), palette.trail, 2.5)
    if plan is not None:
        dash = max(0.25 * world.robot.circumscribed_radius, canvas.metres(SHORT))
        canvas.line(plan.poses[:, :2], palette.plan, 2.0, dash_m=dash)
    _robot(canvas, world, palette)


def film_view(world: World) -> float | None:
    """Length of the world's longer side that a film shows [m]; None for all of it."""
    short, long = sorted((world.static.bounds[2:] - world.static.bounds[:2]).tolist())
    return LONGEST * short if long > LONG * short else None


def view_bounds(world: World, size_px: int, view: float | None) -> Bounds:
    """Return the part of the world that is shown: x_min, y_min, x_max, y_max [m]."""
    box = _with_walls(world.static)
    low = box[:2].copy()
    high = box[2:].copy()
    sides = high - low
    axis = int(np.argmax(sides))
    length = math.inf
    if view is not None:
        length = number("view", view, low=0.0, open_low=True)
    if length < sides[axis]:
        start = float(world.robot_pose[axis]) - 0.5 * length
        start = min(max(start, float(low[axis])), float(high[axis]) - length)
        pixel = max(length, float(sides[1 - axis])) / size_px
        # by whole pixels, so that still things look the same in every frame
        low[axis] += pixel * round((start - float(low[axis])) / pixel)
        high[axis] = low[axis] + length
    return (*low.tolist(), *high.tolist())


@functools.lru_cache(maxsize=8)
def _with_walls(static: StaticMap) -> FloatArray:
    """The bounds and a little of the walls around them: (4,) x_min, y_min, x_max, y_max [m]."""
    box: FloatArray = static.bounds
    if static.is_empty:
        return box
    corners = np.concatenate(static.convex_parts)
    rim = RIM * float((box[2:] - box[:2]).max())
    low = np.clip(corners.min(axis=0), box[:2] - rim, box[:2])
    high = np.clip(corners.max(axis=0), box[2:], box[2:] + rim)
    return frozen(np.concatenate([low, high]))


def pushed(world: World, plan: Plan | None) -> list[tuple[FloatArray, tuple[FloatArray, ...]]]:
    """The objects that a plan expects to move: (N, 3) poses and outlines (V, 2) of each."""
    if plan is None or plan.object_poses is None:
        return []
    objects = world.movables
    poses = plan.object_poses
    if poses.shape[1] != len(objects):  # planners count fixed objects as static
        objects = world.with_fixed_as_static().movables
    if poses.shape[1] != len(objects):
        return []
    ways = np.hypot(*np.moveaxis(poses[-1] - poses[0], -1, 0)[:2])
    moved = np.flatnonzero(ways > 1e-3 * objects.radii)
    return [(poses[:, k], objects.rings(int(k))) for k in moved]


def _robot(canvas: Canvas, world: World, palette: Palette) -> None:
    """The bumper's parts as one shape, the chassis on it, and an arrow; a dot if it is tiny."""
    least = canvas.metres(3.0)
    if world.robot.circumscribed_radius < least:
        canvas.disc(world.robot_pose[:2], least, palette.robot, palette.robot_edge)
        return
    chassis, *bumper = world.robot_outline_world()
    for part in (chassis, *bumper):
        canvas.polygon(part, None, palette.robot_edge, 2.5)
    for part in bumper:
        canvas.polygon(part, palette.bumper, palette.bumper)
    canvas.polygon(chassis, palette.robot, palette.robot_edge, 1.0 if bumper else 0.0)
    size = world.robot.inscribed_radius or 0.5 * world.robot.circumscribed_radius
    arrow = size * np.array([[0.75, 0.0], [-0.45, 0.5], [-0.2, 0.0], [-0.45, -0.5]])
    canvas.polygon(transform(world.robot_pose, arrow), "#ffffff", palette.robot)


def _write(lines: list[str], picture: Image.Image, unit: float) -> None:
    """Lines of text in the top left corner, on a panel that keeps them readable."""
    font = font_of(max(9, round(15 * unit)))
    draw = ImageDraw.Draw(picture, "RGBA")
    pad = round(8 * unit)
    text = "\n".join(lines)
    spacing = round(4 * unit)
    box = draw.multiline_textbbox((2 * pad, 2 * pad), text, font=font, spacing=spacing)
    panel = (box[0] - pad, box[1] - pad, box[2] + pad, box[3] + pad)
    draw.rounded_rectangle(panel, radius=pad, fill=(255, 255, 255, 190))
    draw.multiline_text(
        (2 * pad, 2 * pad), text, font=font, fill=FLOOR_PALETTE.text, spacing=spacing
    )


@functools.cache
def font_of(size: int) -> Font:
    """Pillow's own font in a size [px]."""
    return ImageFont.load_default(size)
