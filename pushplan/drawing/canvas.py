"""From metres to pixels, with smooth edges."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw

from pushplan.world.checks import FloatArray
from pushplan.world.polyline import arc_lengths

SMOOTHING = 2
"""Everything is drawn this many times larger and then averaged."""
THIN = 3
"""Edges up to this width [px, before smoothing] need no round joints."""

Color = tuple[int, int, int]


class Canvas:
    """A picture of a rectangle of the world, y upwards.

    Args:
        bounds: (4,) x_min, y_min, x_max, y_max [m].
        size_px: longer side of the finished picture [px].
        background: colour.
        image: a picture of the same rectangle to draw on, instead of an empty one.
    """

    def __init__(
        self,
        bounds: FloatArray,
        size_px: int,
        background: Color,
        image: Image.Image | None = None,
    ) -> None:
        width, height = (float(side) for side in bounds[2:] - bounds[:2])
        self.scale = SMOOTHING * size_px / max(width, height)
        self.bounds = bounds
        self.corner = np.array([bounds[0], bounds[3]])
        if image is None:
            # even sides, as video codecs want them
            shape = [
                2 * SMOOTHING * max(1, round(s * self.scale / 2 / SMOOTHING))
                for s in (width, height)
            ]
            image = Image.new("RGB", (shape[0], shape[1]), background)
        self.image = image
        self.draw = ImageDraw.Draw(image)

    @property
    def pixels_per_metre(self) -> float:
        """Scale of the finished picture [px/m]."""
        return self.scale / SMOOTHING

    def pixels(self, points: FloatArray) -> list[tuple[float, float]]:
        """World points (N, 2) [m] as pixel coordinates."""
        moved = (points - self.corner) * np.array([self.scale, -self.scale])
        return [(x, y) for x, y in moved.tolist()]

    def polygon(
        self, corners: FloatArray, fill: Color | None, edge: Color, width_px: float
    ) -> None:
        """A closed polygon with corners (N, 2) [m]."""
        spots = self.pixels(corners)
        width = self._width(width_px)
        if fill is not None and width <= THIN:
            self.draw.polygon(spots, fill=fill, outline=edge if width else None, width=width)
            return
        if fill is not None:
            self.draw.polygon(spots, fill=fill)
        if width:
            self.draw.line([*spots, spots[0], spots[1]], fill=edge, width=width, joint="curve")

    def line(self, points: FloatArray, color: Color, width_px: float, dash_m: float = 0.0) -> None:
        """An open line through (N, 2) points [m], dashed if ``dash_m`` is positive."""
        if len(points) < 2:
            return
        pieces: Sequence[FloatArray] = [points] if dash_m <= 0.0 else _dashes(points, dash_m)
        for piece in pieces:
            spots = self.pixels(piece)
            self.draw.line(spots, fill=color, width=self._width(width_px), joint="curve")

    def disc(
        self, center: FloatArray, radius_m: float, fill: Color | None, edge: Color, width_px: float
    ) -> None:
        """A disc about ``center`` (2,) [m]."""
        (x, y), r = self.pixels(center[None])[0], radius_m * self.scale
        box = (x - r, y - r, x + r, y + r)
        self.draw.ellipse(box, fill=fill, outline=edge, width=self._width(width_px))

    def thick_segment(self, ends: FloatArray, radius_m: float, color: Color) -> None:
        """A segment (4,) x1, y1, x2, y2 [m] with round ends."""
        a, b = ends[:2], ends[2:]
        along = b - a
        length = float(np.hypot(along[0], along[1]))
        if length > 0.0:
            side = radius_m * np.array([-along[1], along[0]]) / length
            self.draw.polygon(
                self.pixels(np.array([a + side, b + side, b - side, a - side])), fill=color
            )
        for end in (a, b):
            self.disc(end, radius_m, color, color, 0.0)

    def finish(self) -> Image.Image:
        """The smooth picture at its final size."""
        return self.image.reduce(SMOOTHING)

    @staticmethod
    def _width(width_px: float) -> int:
        return max(1, round(width_px * SMOOTHING)) if width_px > 0.0 else 0


def _dashes(points: FloatArray, dash_m: float) -> list[FloatArray]:
    """Cut a line into dashes of this length with gaps as long."""
    along = arc_lengths(points)
    pieces = []
    for start in np.arange(0.0, float(along[-1]), 2.0 * dash_m):
        inner = along[(along > start) & (along < start + dash_m)]
        at = np.concatenate([[start], inner, [min(start + dash_m, float(along[-1]))]])
        pieces.append(np.column_stack([np.interp(at, along, points[:, axis]) for axis in range(2)]))
    return pieces
