"""Pictures of a run, drawn without a screen."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from pushplan.evaluation.rows import ResultRow
from pushplan.evaluation.run_record import RunRecord
from pushplan.evaluation.statistics import estimate
from pushplan.evaluation.summary import values_of
from pushplan.evaluation.tables import heading
from pushplan.metrics import Role, metric_names
from pushplan.world.files import write_atomic

# Okabe and Ito's colours, told apart by colour-blind readers too
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C6D31")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
PANEL = (4.6, 3.9)
"""Width and height of one panel [inch]."""
_DPI = 130


def write_plots(run: RunRecord, folder: Path) -> dict[str, Path]:
    """Draw everything that the rows allow.

    Returns:
        Caption -> path of a PNG file.
    """
    plots: dict[str, Path] = {}
    for kind, drawn in (
        ("Efficiency against effort", _tradeoff(run)),
        ("Scores of every episode", _spread(run)),
        ("Time of a planning call", _planning_time(run)),
    ):
        if drawn is not None:
            name, figure = drawn
            plots[kind] = folder / name
            write_atomic(plots[kind], _png(figure))
    return plots


def _tradeoff(run: RunRecord) -> tuple[str, Figure] | None:
    """E against I: one dot an episode, the mean with its intervals."""

    def draw(axes: Any, rows: Sequence[ResultRow]) -> None:
        kind = "nav" if values_of(rows, "E_nav") else "manip"
        names = (f"I_{kind}", f"E_{kind}")
        for i, label in enumerate(run.policies):
            mine = [r for r in rows if r.policy == label]
            points = [
                (x, y)
                for r in mine
                if (x := getattr(r, names[0])) is not None
                and (y := getattr(r, names[1])) is not None
            ]
            if not points:
                continue
            xy = np.array(points, dtype=float)
            style = {"color": COLOURS[i % 8], "marker": MARKERS[(i + i // 8) % 8]}
            axes.scatter(*xy.T, s=16, alpha=0.35, linewidths=0, **style)
            across, up = estimate(xy[:, 0]), estimate(xy[:, 1])
            axes.errorbar(
                across.mean,
                up.mean,
                xerr=[[across.mean - across.low], [across.high - across.mean]],
                yerr=[[up.mean - up.low], [up.high - up.mean]],
                markersize=9,
                markeredgecolor="black",
                ecolor="black",
                elinewidth=1.2,
                capsize=3,
                linestyle="none",
                label=label,
                zorder=5,
                **style,
            )
        axes.set_xlabel(f"effort {names[0]} (1 = pushed nothing)")
        axes.set_ylabel(f"efficiency {names[1]} (1 = shortest path)")
        axes.margins(0.08)
        axes.set_xlim(right=1.02)
        axes.set_ylim(top=max(1.03, axes.get_ylim()[1]))

    if not any(values_of(run.rows, name) for name in ("I_nav", "I_manip")):
        return None
    return "tradeoff.png", _panels(run, draw, legend=True)


def _spread(run: RunRecord) -> tuple[str, Figure] | None:
    """A box and all dots for each policy, one row of panels a metric."""
    metrics = [name for name in metric_names(Role.SCORE, Role.DETAIL) if values_of(run.rows, name)]
    if not metrics:
        return None
    settings = list(run.titles)
    figure = Figure(figsize=(PANEL[0] * len(settings), 2.6 * len(metrics) + 0.4))
    grid = figure.subplots(len(metrics), len(settings), squeeze=False)
    rng = np.random.default_rng(0)
    for column, setting in enumerate(settings):
        rows = run.rows_of(setting)
        for line, name in enumerate(metrics):
            axes = grid[line][column]
            _boxes(axes, run.policies, rows, name, rng)
            if line == 0:
                axes.set_title(run.titles[setting], fontsize=9)
            if column == 0:
                axes.set_ylabel(heading(name))
            if line < len(metrics) - 1:
                axes.tick_params(labelbottom=False)
    figure.tight_layout()
    return "scores.png", figure


def _boxes(
    axes: Any, labels: Sequence[str], rows: Sequence[ResultRow], name: str, rng: Any
) -> None:
    for i, label in enumerate(labels):
        values = np.array(values_of([r for r in rows if r.policy == label], name))
        if len(values) == 0:
            continue
        colour = COLOURS[i % 8]
        axes.boxplot(
            [values],
            positions=[i],
            widths=0.55,
            showfliers=False,
            patch_artist=True,
            boxprops={"facecolor": colour + "30", "edgecolor": colour},
            medianprops={"color": colour, "linewidth": 2},
            whiskerprops={"color": colour},
            capprops={"color": colour},
        )
        places = i + rng.uniform(-0.18, 0.18, len(values))
        axes.scatter(places, values, s=9, color=colour, alpha=0.55, linewidths=0, zorder=3)
    steep = len(labels) > 3
    axes.set_xticks(
        range(len(labels)),
        labels,
        fontsize=8,
        rotation=25 if steep else 0,
        ha="right" if steep else "center",
    )
    axes.set_xlim(-0.6, len(labels) - 0.4)
    _quiet(axes)


def _planning_time(run: RunRecord) -> tuple[str, Figure] | None:
    """Fraction of planning calls that took at most so long."""
    if not values_of(run.rows, "plan_time_median_s"):
        return None

    def draw(axes: Any, rows: Sequence[ResultRow]) -> None:
        for i, label in enumerate(run.policies):
            mine = [r for r in rows if r.policy == label and r.plan_time_max_s is not None]
            times = np.sort(np.concatenate([_calls(run, row) for row in mine] or [[]]))
            if len(times) == 0:
                continue
            fractions = np.arange(1, len(times) + 1) / len(times)
            text = f"{label} ({len(times)} calls)"
            axes.step(1e3 * times, fractions, where="post", color=COLOURS[i % 8], label=text)
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter("{x:g}")
        axes.set_ylim(0.0, 1.02)
        axes.set_xlabel("time of a planning call [ms]")
        axes.set_ylabel("fraction of calls")

    return "planning_time.png", _panels(run, draw, legend=True)


def _calls(run: RunRecord, row: ResultRow) -> Any:
    """Times of all planning calls of an episode [s], from its trace where there is one."""
    if row.trace_file and run.path is not None and (path := run.path / row.trace_file).is_file():
        with np.load(path, allow_pickle=False) as data:
            return np.maximum(data["plan_times_s"], 1e-6)
    return np.array([row.plan_time_median_s, row.plan_time_max_s])


def _panels(
    run: RunRecord, draw: Callable[[Any, Sequence[ResultRow]], None], *, legend: bool
) -> Figure:
    """One panel a setting."""
    settings = list(run.titles)
    columns = min(3, len(settings))
    lines = math.ceil(len(settings) / columns)
    figure = Figure(figsize=(max(5.6, PANEL[0] * columns), PANEL[1] * lines + 0.5))
    grid = figure.subplots(lines, columns, squeeze=False, sharex=True, sharey=True).ravel()
    for axes in grid[len(settings) :]:
        axes.set_visible(False)
    for axes, setting in zip(grid, settings, strict=False):
        draw(axes, run.rows_of(setting))
        axes.set_title(run.titles[setting], fontsize=9)
        _quiet(axes)
    if legend:
        found = dict[str, Any]()
        for axes in grid:
            for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
                found.setdefault(label if len(settings) == 1 else label.split(" (")[0], handle)
        figure.legend(
            found.values(),
            found.keys(),
            loc="outside lower center",
            ncols=min(4, len(found)),
            fontsize=8,
            frameon=False,
        )
        figure.set_layout_engine("constrained")
    return figure


def _quiet(axes: Any) -> None:
    axes.grid(alpha=0.25, linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    FigureCanvasAgg(figure)
    figure.savefig(buffer, format="png", dpi=_DPI)
    return buffer.getvalue()
