"""A World as a figure for a document: axes in metres, a legend, PNG, SVG or PDF."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from pushplan.drawing.canvas import NOMINAL_PX, Canvas
from pushplan.drawing.ground import draw_ground
from pushplan.drawing.legend import Entry, legend_of
from pushplan.drawing.palette import SERIES, Color, palette_of
from pushplan.drawing.top_view import LONGEST, draw_moving, view_bounds
from pushplan.files.output_files import write_atomic
from pushplan.imports.on_demand import need
from pushplan.world import InvalidInputError, Plan, World
from pushplan.world.checks import FloatArray, array, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMN = 3.3
"""Width of a column of a two-column paper [inch]."""
TEXT = 4.75
"""Width of the text of LaTeX's class ``article`` [inch]."""
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
# around the axes [inch]
_LEFT = 0.55
_RIGHT = 0.16
_GAP = 0.08
_LOWEST = 0.4  # that is left for a low scene, whose axis has a label
_TITLE = 0.15
_BELOW = 0.4
_ENTRY = (1.09, 0.18)  # of the legend: width and height [inch]


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
    entries: dict[str, Entry] = {}
    for panel in panels:
        shown = legend_of(
            panel.world,
            plan=panel.plan,
            trail=panel.trail is not None,
            object_trails=panel.object_trails is not None,
            pushes=bool(panel.pushes),
        )
        entries.update((one.label, one) for one in shown)
    across = max(1, int(width_in / _ENTRY[0]))
    boxes = [np.array(view_bounds(panel.world, 600, None)) for panel in panels]
    side = width_in / columns - _LEFT - _RIGHT
    sizes = [_size(box[2:] - box[:2], side) for box in boxes]
    above = _GAP + _TITLE * max(len(panel.title.splitlines()) for panel in panels)
    cells = [max(high, _LOWEST) for _, high in sizes]
    lines = [max(cells[i : i + columns]) for i in range(0, len(panels), columns)]
    below = _ENTRY[1] * -(-len(entries) // across) + _GAP
    height = below + sum(lines) + len(lines) * (above + _BELOW)
    with matplotlib.rc_context(STYLE):
        figure: Figure = matplotlib.figure.Figure(figsize=(width_in, height))
        for n, (panel, box) in enumerate(zip(panels, boxes, strict=True)):
            row, column = divmod(n, columns)
            top = height - sum(lines[:row]) - row * _BELOW - (row + 1) * above
            wide, high = sizes[n]
            left = column * width_in / columns + _LEFT + 0.5 * (side - wide)
            low = top - 0.5 * (cells[n] + high)
            place = (left / width_in, low / height, wide / width_in, high / height)
            axes = figure.add_axes(place)
            _draw(axes, panel, box, max(wide, high))
            axes.set_xlabel("x [m]" if n + columns >= len(panels) else "")
            axes.set_ylabel("" if column else "y [m]", labelpad=1.0)
        handles = [_handle(entry) for entry in entries.values()]
        figure.legend(handles=handles, loc="lower center", ncols=across, frameon=False)
    return figure


def _size(sides: FloatArray, width_in: float) -> tuple[float, float]:
    """Width and height [inch] of a scene with such sides in a cell; tall ones are narrower."""
    height = min(width_in * float(sides[1] / sides[0]), LONGEST * width_in)
    return height * float(sides[0] / sides[1]), height


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


class _AxesCanvas(Canvas):
    """Axes of Matplotlib, on which one shape is drawn over the other."""

    def __init__(self, axes: Any, bounds: FloatArray, inches: float) -> None:
        self.bounds = bounds
        self.unit = 1.0
        self.pixels_per_metre = NOMINAL_PX / float((bounds[2:] - bounds[:2]).max())
        self._axes = axes
        self._order = 1.0
        self._points = 72.0 * inches / NOMINAL_PX  # of a pixel

    def polygon(
        self, corners: FloatArray, fill: Color | None, edge: Color, width_px: float = 0.0
    ) -> None:
        self._add(need("matplotlib.patches").Polygon(corners), fill, edge, width_px)

    def disc(
        self, center: FloatArray, radius_m: float, fill: Color, edge: Color, width_px: float = 0.0
    ) -> None:
        self._add(need("matplotlib.patches").Circle(center, radius_m), fill, edge, width_px)

    def stroke(self, points: FloatArray, color: Color, width_px: float) -> None:
        (line,) = self._axes.plot(*points.T, color=color, linewidth=self._points * width_px)
        self._raise(line)

    def _add(self, patch: Any, fill: Color | None, edge: Color, width_px: float) -> None:
        patch.set(
            facecolor=fill or "none",
            edgecolor=edge if width_px else "none",
            linewidth=self._points * width_px,
        )
        self._raise(self._axes.add_patch(patch))

    def _raise(self, artist: Any) -> None:
        self._order += 1e-4
        artist.set_zorder(self._order)


def _draw(axes: Any, panel: Panel, box: FloatArray, inches: float) -> None:
    world = panel.world
    palette = palette_of(world)
    axes.set(xlim=box[[0, 2]], ylim=box[[1, 3]], aspect="equal", facecolor=palette.floor)
    axes.set_title(panel.title)
    axes.tick_params(length=2.5, width=0.6)
    axes.locator_params(steps=[1, 2, 5, 10])
    canvas = _AxesCanvas(axes, box, inches)
    draw_ground(canvas, world.static, world.goal, palette)
    draw_moving(canvas, world, panel.plan, panel.trail, panel.object_trails)
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


def _handle(entry: Entry) -> Any:
    """Return the symbol beside a label in the legend."""
    if entry.line:
        style: Any = (0, (3, 2)) if entry.dashed else "-"
        line = need("matplotlib.lines").Line2D
        return line([], [], color=entry.edge, linewidth=1.3, linestyle=style, label=entry.label)
    patch = need("matplotlib.patches").Patch
    return patch(
        facecolor=entry.fill or "none", edgecolor=entry.edge, linewidth=0.8, label=entry.label
    )
