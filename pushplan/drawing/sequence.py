"""A sequence of pushes drawn over a scene."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from pushplan.drawing.scene import draw_world, view_bounds
from pushplan.world import World
from pushplan.world.checks import FloatArray, array, integer

COLOURS = ((214, 39, 40), (31, 119, 180), (44, 160, 44), (148, 103, 189), (255, 127, 14))
_BETWEEN = (120, 120, 120)


def draw_sequence(
    world: World, paths: Sequence[FloatArray], *, size_px: int = 600
) -> NDArray[np.uint8]:
    """Draw pushes in their order: numbered paths of the robot, joined by grey lines.

    Args:
        world: the scene.
        paths: (N, 2) or (N, 3) poses of the robot in each push [m], in order.
        size_px: longer side of the picture [px].

    Returns:
        (H, W, 3) picture.

    Raises:
        InvalidInputError: if a path has the wrong shape.
    """
    size_px = integer("size_px", size_px, low=16, high=8192)
    lines = [array(f"paths[{n}]", np.asarray(p)[:, :2], (None, 2)) for n, p in enumerate(paths)]
    picture = Image.fromarray(draw_world(world, size_px=size_px))
    x0, y0, x1, y1 = view_bounds(world, size_px, None)
    scale = size_px / max(x1 - x0, y1 - y0)

    def pixel(point: FloatArray) -> tuple[float, float]:
        return float((point[0] - x0) * scale), float((y1 - point[1]) * scale)

    pen, width = ImageDraw.Draw(picture), max(1, size_px // 200)
    here = world.robot_pose[:2]
    for n, line in enumerate(lines):
        colour = COLOURS[n % len(COLOURS)]
        pen.line([pixel(here), pixel(line[0])], fill=_BETWEEN, width=max(1, width // 2))
        pen.line([pixel(point) for point in line], fill=colour, width=width)
        x, y = pixel(line[0])
        r = 3 * width
        pen.ellipse((x - r, y - r, x + r, y + r), fill=colour)
        pen.text((x, y), str(n + 1), fill=(255, 255, 255), anchor="mm")
        here = line[-1]
    return np.asarray(picture)
