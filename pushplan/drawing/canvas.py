"""From metres to pixels, with smooth edges."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw

from pushplan.drawing.palette import Color
from pushplan.world import Unseen
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import arc_lengths

SMOOTHING = 2
"""Everything is drawn this many times larger and then averaged."""
THIN = 3
"""Edges up to this width [px, before smoothing] need no round joints."""
_UNSEEN_ALPHA = 70  # of 255, at which unseen places are shaded
NOMINAL_PX = 600.0
"""Longer side of a picture to which widths of lines refer [px]."""


class Canvas:
    """A picture of a rectangle of the world, y upwards.

    Widths are in pixels of a picture whose longer side has `NOMINAL_PX`.

    Args:
        bounds: (4,) x_min, y_min, x_max, y_max [m].
        size_px: longer side of the finished picture [px].
        background: colour.

    Attributes:
        unit: pixels of the finished picture in one of the nominal picture.
        pixels_per_metre: scale of the finished picture [px/m].
    """

    def __init__(self, bounds: FloatArray, size_px: int, background: Color) -> None:
        sides: list[float] = (bounds[2:] - bounds[:2]).tolist()
        self.scale = SMOOTHING * size_px / max(sides)
        self.bounds = bounds
        self.unit = size_px / NOMINAL_PX
        self.pixels_per_metre = self.scale / SMOOTHING
        # even sides, as video codecs want them
        width, height = (
            2 * SMOOTHING * max(1, round(side * self.scale / 2 / SMOOTHING)) for side in sides
        )
        self.image = Image.new("RGB", (width, height), background)
        self.draw = ImageDraw.Draw(self.image)

    def metres(self, width_px: float) -> float:
        """Length of a width in the world [m]."""
        return width_px * self.unit / self.pixels_per_metre

    def pixels(self, points: FloatArray) -> list[tuple[float, float]]:
        """World points (N, 2) [m] as pixel coordinates."""
        moved = (points - self.bounds[[0, 3]]) * np.array([self.scale, -self.scale])
        return [(x, y) for x, y in moved.tolist()]

    def polygon(
        self, corners: FloatArray, fill: Color | None, edge: Color, width_px: float = 0.0
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
        self, center: FloatArray, radius_m: float, fill: Color, edge: Color, width_px: float = 0.0
    ) -> None:
        """A disc about ``center`` (2,) [m]."""
        (x, y) = self.pixels(center[None])[0]
        r = radius_m * self.scale
        box = (x - r, y - r, x + r, y + r)
        self.draw.ellipse(box, fill=fill, outline=edge, width=self._width(width_px))

    def shade(self, unseen: Unseen, color: Color) -> None:
        """Lay a colour thinly over what nobody has seen."""
        height, width = (
            round(count * unseen.resolution * self.scale) for count in unseen.cells.shape
        )
        cells = np.where(unseen.cells[::-1], np.uint8(_UNSEEN_ALPHA), np.uint8(0))
        mask = Image.fromarray(cells).resize(
            (max(width, 1), max(height, 1)), Image.Resampling.NEAREST
        )
        left, low = unseen.origin.tolist()
        top = low + unseen.cells.shape[0] * unseen.resolution
        (x, y) = self.pixels(np.array([[left, top]]))[0]
        self.image.paste(color, (round(x), round(y)), mask)

    def finish(self) -> Image.Image:
        """The smooth picture at its final size."""
        return self.image.reduce(SMOOTHING)

    def _width(self, width_px: float) -> int:
        if width_px <= 0.0:
            return 0
        return max(1, round(width_px * self.unit * SMOOTHING))

    def line(self, points: FloatArray, color: Color, width_px: float, dash_m: float = 0.0) -> None:
        """An open line through (N, 2) points [m], dashed if ``dash_m`` is positive."""
        if len(points) < 2:
            return
        if dash_m <= 0.0:
            self.stroke(points, color, width_px)
            return
        along = arc_lengths(points)
        length = float(along[-1])
        for start in np.arange(0.0, length, 2.0 * dash_m):  # gaps are as long as dashes
            inner = along[(along > start) & (along < start + dash_m)]
            at = np.concatenate([[start], inner, [min(start + dash_m, length)]])
            dash = np.column_stack([np.interp(at, along, one) for one in points.T])
            self.stroke(dash, color, width_px)

    def thick_segment(self, ends: FloatArray, radius_m: float, color: Color) -> None:
        """A segment (4,) x1, y1, x2, y2 [m] with round ends."""
        a = ends[:2]
        b = ends[2:]
        along = b - a
        length = float(np.hypot(along[0], along[1]))
        if length > 0.0:
            side = radius_m * np.array([-along[1], along[0]]) / length
            self.polygon(np.array([a + side, b + side, b - side, a - side]), color, color)
        for end in (a, b):
            self.disc(end, radius_m, color, color)
