"""Shapes of objects other than boxes, in a square of side 1 about the origin."""

from __future__ import annotations

import numpy as np

from pushplan.world import Movables
from pushplan.world.checks import BoolArray, FloatArray
from pushplan.world.convex_shapes import areas_and_centres, disjoint, shapes_of
from pushplan.world.outline import transform


def _rectangle(x0: float, y0: float, x1: float, y1: float) -> list[list[float]]:
    return [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]


SHAPES = {
    "box": [_rectangle(-0.5, -0.5, 0.5, 0.5)],
    "L": [_rectangle(-0.5, -0.5, 0.5, -0.1), _rectangle(-0.5, -0.1, -0.1, 0.5)],
    "T": [_rectangle(-0.5, 0.1, 0.5, 0.5), _rectangle(-0.2, -0.5, 0.2, 0.1)],
    "U": [
        _rectangle(-0.5, -0.5, 0.5, -0.15),
        _rectangle(-0.5, -0.15, -0.2, 0.5),
        _rectangle(0.2, -0.15, 0.5, 0.5),
    ],
    "chair": [  # two legs and a bar between the other two
        _rectangle(-0.45, 0.3, 0.45, 0.45),
        _rectangle(-0.45, -0.45, -0.3, -0.3),
        _rectangle(0.3, -0.45, 0.45, -0.3),
    ],
    "table": [_rectangle(x, y, x + 0.15, y + 0.15) for x in (-0.5, 0.35) for y in (-0.5, 0.35)],
}
"""Name -> convex parts that touch other things."""
_CUT = dict(zip(SHAPES, shapes_of("shape", list(SHAPES.values())), strict=True))


def objects_of_many_shapes(
    rng: np.random.Generator,
    poses: FloatArray,
    size: float,
    masses: FloatArray,
    wheeled: BoolArray,
    contact_radius: float,
) -> Movables:
    """Objects of random shapes, each in a square of side `size` [m] at a pose (K, 3)."""
    names = list(SHAPES)
    outlines = []
    places = poses.copy()
    for k, choice in enumerate(rng.integers(len(names), size=len(poses)).tolist()):
        parts = _CUT[names[choice]]
        centre = areas_and_centres([disjoint(parts)])[1]
        places[k, :2] = transform(poses[k], size * centre)[0]
        outlines.append([size * (part - centre) for part in parts])
    return Movables.from_outlines(
        outlines, places, masses=masses, wheeled=wheeled, contact_radii=contact_radius
    )
