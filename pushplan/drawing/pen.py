"""The few shapes that pictures are made of, for any surface."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np

from pushplan.world.checks import FloatArray
from pushplan.world.polyline import arc_lengths

Color = tuple[int, int, int]


class Pen(ABC):
    """Draws on a rectangle of the world, y upwards; widths are in pixels of the picture."""

    bounds: FloatArray
    """(4,) x_min, y_min, x_max, y_max [m]."""

    @property
    @abstractmethod
    def pixels_per_metre(self) -> float:
        """Scale of the finished picture [px/m]."""

    @abstractmethod
    def polygon(
        self, corners: FloatArray, fill: Color | None, edge: Color, width_px: float
    ) -> None:
        """A closed polygon with corners (N, 2) [m]."""

    @abstractmethod
    def stroke(self, points: FloatArray, color: Color, width_px: float) -> None:
        """An open line through (N, 2) points [m]."""

    @abstractmethod
    def disc(
        self, center: FloatArray, radius_m: float, fill: Color | None, edge: Color, width_px: float
    ) -> None:
        """A disc about ``center`` (2,) [m]."""

    def line(self, points: FloatArray, color: Color, width_px: float, dash_m: float = 0.0) -> None:
        """An open line through (N, 2) points [m], dashed if ``dash_m`` is positive."""
        if len(points) < 2:
            return
        pieces: Sequence[FloatArray] = [points] if dash_m <= 0.0 else _dashes(points, dash_m)
        for piece in pieces:
            self.stroke(piece, color, width_px)

    def thick_segment(self, ends: FloatArray, radius_m: float, color: Color) -> None:
        """A segment (4,) x1, y1, x2, y2 [m] with round ends."""
        a, b = ends[:2], ends[2:]
        along = b - a
        length = float(np.hypot(along[0], along[1]))
        if length > 0.0:
            side = radius_m * np.array([-along[1], along[0]]) / length
            self.polygon(np.array([a + side, b + side, b - side, a - side]), color, color, 0.0)
        for end in (a, b):
            self.disc(end, radius_m, color, color, 0.0)


def _dashes(points: FloatArray, dash_m: float) -> list[FloatArray]:
    """Cut a line into dashes of this length with gaps as long."""
    along = arc_lengths(points)
    pieces = []
    for start in np.arange(0.0, float(along[-1]), 2.0 * dash_m):
        inner = along[(along > start) & (along < start + dash_m)]
        at = np.concatenate([[start], inner, [min(start + dash_m, float(along[-1]))]])
        pieces.append(np.column_stack([np.interp(at, along, points[:, axis]) for axis in range(2)]))
    return pieces
