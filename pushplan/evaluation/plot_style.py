"""How the figures of a run tell policies apart: colour, marker and dashes, in their order."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from pushplan.drawing.figure import COLUMN
from pushplan.drawing.palette import DASHES, MARKERS, SERIES

PANEL = (COLUMN, 2.9)
"""Width and height of one panel [inch]: a column of a paper, with letters of 8 points."""


def dots(index: int) -> dict[str, Any]:
    """Colour and marker of a policy; they repeat together after 64 policies."""
    count = len(SERIES)
    return {
        "color": SERIES[index % count],
        "marker": MARKERS[(index + index // count) % len(MARKERS)],
    }


def line(index: int) -> dict[str, Any]:
    """Colour and dashes of a policy."""
    count = len(SERIES)
    return {
        "color": SERIES[index % count],
        "linestyle": DASHES[(index + index // count) % len(DASHES)],
    }


def interval(mean: float, low: float, high: float) -> list[list[float]]:
    """An interval as Matplotlib's error bars take it."""
    return [[max(0.0, mean - low)], [max(0.0, high - mean)]]


def abreast(width: float, labels: Iterable[str]) -> int:
    """How many entries of a legend stand side by side in a width [inch]."""
    longest = max((len(label) for label in labels), default=0)
    return max(1, int(width / (0.55 + 0.062 * longest)))


def tidy(axes: Any) -> None:
    """A faint grid behind everything, and no frame at the top and on the right."""
    axes.grid(alpha=0.25, linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
