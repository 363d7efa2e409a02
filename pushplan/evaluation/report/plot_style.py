"""Style that all figures of a run share: lines of a policy, names on lines, legends, grids."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure

from pushplan.drawing.figure import COLUMN
from pushplan.drawing.palette import DASHES, MARKERS, SERIES
from pushplan.evaluation.statistics.estimates import Estimate, Proportion

NAME_LETTERS = 16
"""Letters of a policy's name on a line, so that figures of one column have room beside them."""

LINE = 0.15
"""Height of a line of text [inch]."""


def dots(index: int) -> dict[str, Any]:
    """Colour and marker of a policy; they repeat together after 64 policies."""
    return _style(index, "marker", MARKERS)


def line(index: int) -> dict[str, Any]:
    """Colour and dashes of a policy."""
    return _style(index, "linestyle", DASHES)


def _style(index: int, name: str, kinds: Sequence[Any]) -> dict[str, Any]:
    turn, colour = divmod(index, len(SERIES))
    return {"color": SERIES[colour], name: kinds[(index + turn) % len(kinds)]}


def interval(one: Estimate | Proportion) -> list[list[float]]:
    """An interval as Matplotlib's error bars take it."""
    middle = one.mean if isinstance(one, Estimate) else one.fraction
    return [[max(0.0, middle - one.low)], [max(0.0, one.high - middle)]]


def wrapped(text: str, letters: int = NAME_LETTERS) -> str:
    """A name on lines of so many letters, broken behind spaces and signs; no formula of TeX."""
    pieces = re.findall(rf".{{0,{letters - 1}}}[\s@_/,-]|.{{1,{letters}}}", f"{text} ")
    return "\n".join(piece.strip() for piece in pieces).replace("$", r"\$")


def add_legend(figure: Figure) -> None:
    """Name the lines of all axes once, below them; the figure grows by what that takes."""
    found = dict[str, Any]()
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    names = [wrapped(label) for label in found]
    longest = max((len(line) for name in names for line in name.splitlines()), default=0)
    columns = min(len(names), max(1, int(COLUMN / (0.6 + 0.065 * longest))))
    lines = sum(name.count("\n") + 1 for name in names)
    figure.set_figheight(figure.get_figheight() + LINE * (lines / max(columns, 1) + 1.0))
    figure.legend(found.values(), names, loc="outside lower center", ncols=columns, frameon=False)


def unclipped(*artists: Any) -> None:
    """Let markers at the limit of a score be whole."""
    for artist in artists:
        artist.set_clip_on(False)


def tidy(axes: Any) -> None:
    """A faint grid behind everything, and no frame at the top and on the right."""
    axes.grid(alpha=0.25, linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
