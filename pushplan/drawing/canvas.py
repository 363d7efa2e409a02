"""From metres to pixels, with smooth edges."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw

from pushplan.drawing.pen import Color, Pen
from pushplan.world.checks import FloatArray

SMOOTHING = 2
"""Everything is drawn this many times larger and then averaged."""
THIN = 3
"""Edges up to this width [px, before smoothing] need no round joints."""


class Canvas(Pen):
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

    def stroke(self, points: FloatArray, color: Color, width_px: float) -> None:
        """An open line through (N, 2) points [m]."""
        spots = self.pixels(points)
        self.draw.line(spots, fill=color, width=self._width(width_px), joint="curve")

    def disc(
        self, center: FloatArray, radius_m: float, fill: Color | None, edge: Color, width_px: float
    ) -> None:
        """A disc about ``center`` (2,) [m]."""
        (x, y), r = self.pixels(center[None])[0], radius_m * self.scale
        box = (x - r, y - r, x + r, y + r)
        self.draw.ellipse(box, fill=fill, outline=edge, width=self._width(width_px))

    def finish(self) -> Image.Image:
        """The smooth picture at its final size."""
        return self.image.reduce(SMOOTHING)

    @staticmethod
    def _width(width_px: float) -> int:
        return max(1, round(width_px * SMOOTHING)) if width_px > 0.0 else 0
