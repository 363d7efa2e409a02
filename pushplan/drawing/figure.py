"""A World as a figure for a document: axes in metres, a legend, PNG, SVG or PDF."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from pushplan.drawing.legend import Entry, legend_of
from pushplan.drawing.palette import SERIES, palette_of
from pushplan.drawing.pen import Color, Pen
from pushplan.drawing.scene import draw_scene, view_bounds
from pushplan.world import InvalidInputError, Plan, World
from pushplan.world.checks import FloatArray, array, number
from pushplan.world.libraries import need
from pushplan.world.output_files import write_atomic

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMN = 3.4
"""Width of a column of a two-column paper [inch]."""
FORMATS = (".png", ".svg", ".pdf")
DPI = 200
STYLE: Any = {
    "font.size": 8.0,
    "axes.grid": False,
    "axes.linewidth": 0.6,
    "axes.prop_cycle": f"cycler(color={list(SERIES)})",
    "axes.titlesize": 8.0,
    "legend.fontsize": 7.5,
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
}
"""Settings of Matplotlib for figures that are printed as they are, one column wide."""
_LEFT, _RIGHT, _TITLE, _BELOW = 0.55, 0.08, 0.15, 0.4  # around the axes [inch]
_ENTRY = (1.12, 0.18)  # of the legend: width and height [inch]
_NOMINAL = 600.0  # the longer side of a picture, to which widths of lines refer [px]


@dataclass(frozen=True, eq=False)
class Panel:
    """One scene of a figure.

    Args:
        world: the scene.
        plan: see `draw_world`.
        trail: see `draw_world`.
        object_trails: see `draw_world`.
        pushes: paths of the robot in each push [m], (N, 2) or (N, 3), in order; they are numbered.
        title: text above it.
    """

    world: World
    plan: Plan | None = None
    trail: ArrayLike | None = None
    object_trails: ArrayLike | None = None
    pushes: Sequence[FloatArray] = ()
    title: str = ""


def draw_figure(*panels: Panel, width_in: float = COLUMN, columns: int | None = None) -> Figure:
    """Draw scenes with axes in metres, and one legend of all that they show below them.

    Args:
        panels: at least one scene.
        width_in: width of the figure [inch].
        columns: scenes side by side; all of them by default.

    Raises:
        InvalidInputError: if there is no panel or a size is not positive.
        MissingDependencyError: without Matplotlib.
    """
    if not panels:
        raise InvalidInputError("a figure needs at least one panel, got none")
    width_in = number("width_in", width_in, low=0.5, high=100.0)
    matplotlib = need("matplotlib")
    need("matplotlib.figure")
    columns = min(len(panels), columns or len(panels))
    entries = {one.label: one for panel in panels for one in _entries(panel)}
    across = max(1, int(width_in / _ENTRY[0]))
    boxes = [np.array(view_bounds(panel.world, 600, None)) for panel in panels]
    side = width_in / columns - _LEFT - _RIGHT
    heights = [side * float((box[3] - box[1]) / (box[2] - box[0])) for box in boxes]
    above = _RIGHT + _TITLE * max(len(panel.title.splitlines()) for panel in panels)
    lines = [max(heights[i : i + columns]) for i in range(0, len(panels), columns)]
    below = _ENTRY[1] * -(-len(entries) // across) + _RIGHT
    height = below + sum(lines) + len(lines) * (above + _BELOW)
    with matplotlib.rc_context(STYLE):
        figure: Figure = matplotlib.figure.Figure(figsize=(width_in, height))
        for n, (panel, box) in enumerate(zip(panels, boxes, strict=True)):
            row, column = divmod(n, columns)
            top = height - sum(lines[:row]) - row * _BELOW - (row + 1) * above
            left, low = column * width_in / columns + _LEFT, top - heights[n]
            place = (left / width_in, low / height, side / width_in, heights[n] / height)
            axes = figure.add_axes(place)
            _draw(axes, panel, box, max(side, heights[n]))
            axes.set_xlabel("x [m]" if n + columns >= len(panels) else "")
            axes.set_ylabel("" if column else "y [m]", labelpad=1.0)
        handles = [_handle(entry) for entry in entries.values()]
        figure.legend(handles=handles, loc="lower center", ncols=across, frameon=False)
    return figure


def save_figure(path: str | Path, figure: Figure, *, title: str = "", source: str = "") -> None:
    """Write a figure to a ``.png``, ``.svg`` or ``.pdf`` file, the same bytes each time.

    Args:
        path: the file.
        figure: of Matplotlib.
        title: goes into the file's metadata.
        source: where its numbers come from; goes there too.

    Raises:
        InvalidInputError: if the ending is another one, or the file cannot be written.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in FORMATS:
        raise InvalidInputError(f"a figure file ends in {' or '.join(FORMATS)}, got {path.name!r}")
    known: dict[str, Any] = {"Title": title, "Creator": "pushplan"}
    undated: dict[str, dict[str, Any]] = {
        ".svg": {"Date": None, "Description": source},
        ".png": {"Description": source},
    }
    more = undated.get(ending, {"CreationDate": None, "Subject": source})
    buffer = io.BytesIO()
    try:
        with need("matplotlib").rc_context({**STYLE, "svg.hashsalt": title}):
            figure.savefig(buffer, format=ending[1:], dpi=DPI, metadata={**known, **more})
        write_atomic(path, buffer.getvalue())
    except (OSError, ValueError) as error:  # a text with two $ may be no mathematics
        raise InvalidInputError(f"cannot write {path}: {error}") from error


class _AxesPen(Pen):
    """Draws on axes of Matplotlib, one shape over the other."""

    def __init__(self, axes: Any, bounds: FloatArray, inches: float) -> None:
        self.bounds = bounds
        self._axes = axes
        self._points = 72.0 * inches / _NOMINAL  # of a pixel
        self._scale = _NOMINAL / float((bounds[2:] - bounds[:2]).max())
        self._order = 1.0

    @property
    def pixels_per_metre(self) -> float:
        return self._scale

    def polygon(
        self, corners: FloatArray, fill: Color | None, edge: Color, width_px: float
    ) -> None:
        self._add(need("matplotlib.patches").Polygon(corners), fill, edge, width_px)

    def disc(
        self, center: FloatArray, radius_m: float, fill: Color | None, edge: Color, width_px: float
    ) -> None:
        self._add(need("matplotlib.patches").Circle(center, radius_m), fill, edge, width_px)

    def stroke(self, points: FloatArray, color: Color, width_px: float) -> None:
        width = self._points * width_px
        self._axes.plot(*points.T, color=rgb(color), linewidth=width, zorder=self._above())

    def _add(self, patch: Any, fill: Color | None, edge: Color, width_px: float) -> None:
        patch.set(
            facecolor="none" if fill is None else rgb(fill),
            edgecolor=rgb(edge) if width_px else "none",
            linewidth=self._points * width_px,
            zorder=self._above(),
        )
        self._axes.add_patch(patch)

    def _above(self) -> float:
        self._order += 1e-4
        return self._order


def rgb(color: Color) -> tuple[float, ...]:
    """A colour of the palette as Matplotlib takes it."""
    return tuple(value / 255.0 for value in color)


def _entries(panel: Panel) -> list[Entry]:
    return legend_of(
        panel.world,
        plan=panel.plan,
        trail=panel.trail is not None,
        object_trails=panel.object_trails is not None,
        pushes=bool(panel.pushes),
    )


def _draw(axes: Any, panel: Panel, box: FloatArray, inches: float) -> None:
    world = panel.world
    axes.set(xlim=box[[0, 2]], ylim=box[[1, 3]], aspect="equal", facecolor=_floor(world))
    axes.set_title(panel.title)
    axes.tick_params(length=2.5, width=0.6)
    axes.locator_params(steps=[1, 2, 5, 10])
    draw_scene(
        _AxesPen(axes, box, inches),
        world,
        1.0,
        plan=panel.plan,
        trail=panel.trail,
        object_trails=panel.object_trails,
    )
    here = world.robot_pose[:2]
    for n, path in enumerate(panel.pushes):
        line = array(f"pushes[{n}]", np.asarray(path)[:, :2], (None, 2))
        colour = SERIES[n % len(SERIES)]
        axes.plot(*np.stack([here, line[0]]).T, color="0.5", linewidth=0.6, zorder=2.0)
        axes.plot(*line.T, color=colour, linewidth=1.2, zorder=2.1)
        label = {"boxstyle": "circle,pad=0.2", "facecolor": colour, "edgecolor": "none"}
        axes.text(
            *line[0],
            str(n + 1),
            color="white",
            fontsize=5.5,
            ha="center",
            va="center",
            bbox=label,
            zorder=2.2,
        )
        here = line[-1]


def _floor(world: World) -> tuple[float, ...]:
    return rgb(palette_of(world).floor)


def _handle(entry: Entry) -> Any:
    """What stands beside the label in the legend."""
    colours = {key: rgb(c) if c else "none" for key, c in (("f", entry.fill), ("e", entry.edge))}
    if entry.line:
        style: Any = (0, (3, 2)) if entry.dashed else "-"
        line = need("matplotlib.lines").Line2D
        return line([], [], color=colours["e"], linewidth=1.3, linestyle=style, label=entry.label)
    patch = need("matplotlib.patches").Patch
    return patch(facecolor=colours["f"], edgecolor=colours["e"], linewidth=0.8, label=entry.label)
