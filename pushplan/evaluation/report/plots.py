"""Pictures of a run, drawn without a screen."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from pushplan.drawing.figure import COLUMN, STYLE, TEXT, save_figure
from pushplan.drawing.palette import DASHES, MARKERS, SERIES
from pushplan.evaluation.report.tables import heading
from pushplan.evaluation.statistics.aggregates import performance_profile
from pushplan.evaluation.statistics.estimates import Estimate, Proportion, estimate
from pushplan.evaluation.statistics.stored_run import StoredRun
from pushplan.evaluation.statistics.summary import PolicySummary, grouped, values_of
from pushplan.evaluation.store.rows import ResultRow
from pushplan.metrics import Role, metric_names

NAME_LETTERS = 16
"""Letters of a policy's name on a line, so that figures of one column have room beside them."""

LINE = 0.15
"""Height of a line of text [inch]."""
PANEL = (COLUMN, 2.9)
"""Width and height of one panel [inch]: a column of a paper, with letters of 8 points."""
TITLE_LETTERS = 18
"""Letters of a title on a line above one of two panels of one column."""
_MANY = 300  # so many dots of a policy in a panel are drawn as an image
_SETTINGS = 6  # of more, figures with a panel for each show all together
_TRACES = 300  # of so many episodes every planning call is read from the trace


def write_plots(run: StoredRun, folder: Path, formats: Sequence[str] = ()) -> dict[str, Path]:
    """Draw everything that the rows allow, with where the rows come from in the files.

    Figures show how episodes differ: there are none if no policy has two in a setting.

    Args:
        run: the rows.
        folder: where the files go.
        formats: endings without the dot, of `FORMATS`, to write beside SVG.

    Returns:
        Caption -> path of an SVG file.
    """
    endings = [f".{one}" for one in formats]
    source = json.dumps({"runs": run.about.get("runs", []), "policies": run.about.get("policies")})
    plots: dict[str, Path] = {}
    if max(map(len, grouped(run.rows).values()), default=0) < 2:
        return plots
    for name, (caption, _) in FIGURES.items():
        if (figure := draw(run, name)) is None:
            continue
        plots[caption] = folder / f"{name}.svg"
        for ending in dict.fromkeys((".svg", *endings)):
            path = folder / f"{name}{ending}"
            save_figure(path, figure, title=caption, source=source)
    return plots


def draw(run: StoredRun, name: str) -> Figure | None:
    """One of `FIGURES`; None if the rows have nothing for it."""
    with rc_context(STYLE):
        many = len(run.titles) > _SETTINGS and name in ("tradeoff", "scores", "planning_time")
        figure: Figure | None = FIGURES[name][1](run.pooled if many else run)
    return figure


def _tradeoff(run: StoredRun) -> Figure | None:
    """E against I: one dot an episode, the mean with its intervals."""

    def cloud(axes: Any, rows: Sequence[ResultRow], index: int, label: str) -> None:
        kind = "nav" if values_of(rows, "E_nav") else "manip"
        pairs = [(getattr(row, f"I_{kind}"), getattr(row, f"E_{kind}")) for row in rows]
        xy = np.array([pair for pair in pairs if None not in pair], dtype=float)
        if len(xy) == 0:
            return
        points = _cloud(axes, xy[:, 0], xy[:, 1], index, s=10, alpha=0.35)
        across = estimate(values_of(rows, f"I_{kind}"))
        up = estimate(values_of(rows, f"E_{kind}"))  # failed runs have no I
        bar = axes.errorbar(
            across.mean,
            up.mean,
            xerr=interval(across),
            yerr=interval(up),
            markersize=6,
            markeredgecolor="black",
            ecolor="black",
            elinewidth=1.0,
            capsize=2,
            linestyle="none",
            label=_with_failures(run.rows, label),
            zorder=5,
            **dots(index),
        )
        unclipped(points, bar.lines[0])
        axes.margins(0.08)
        axes.locator_params(nbins=4, min_n_ticks=3)

    labels = ("effort I (1 = pushed nothing)", "efficiency E (1 = shortest path)")
    figure = _panels(run, ("I_nav", "I_manip"), cloud, labels)
    if figure is not None:  # after all panels, which share their limits
        figure.axes[0].set_xlim(right=1.02)
        figure.axes[0].set_ylim(top=max(1.03, figure.axes[0].get_ylim()[1]))
    return figure


def _with_failures(rows: Sequence[ResultRow], policy: str) -> str:
    """The label of a policy, and how many of its runs failed, since these have no score I."""
    failed = sum(row.failed for row in rows if row.policy == policy)
    return f"{policy} ({failed} failed)" if failed else policy


def _cloud(axes: Any, x: Any, y: Any, index: int, **style: Any) -> Any:
    """A dot for each episode of a policy."""
    many = len(x) > _MANY
    return axes.scatter(x, y, linewidths=0, rasterized=many, **style, **dots(index))


def _spread(run: StoredRun) -> Figure | None:
    """A box and all dots for each policy: a panel a metric, the settings below each other."""
    metrics = [name for name in metric_names(Role.SCORE, Role.DETAIL) if values_of(run.rows, name)]
    if not metrics:
        return None
    columns = {
        setting: [name for name in metrics if values_of(run.rows_of(setting), name)]
        for setting in run.titles
    }
    heights = []
    for setting, names in columns.items():
        lines = sum(wrapped(label).count("\n") + 1.3 for label in run.policies_in(setting))
        heights.append(math.ceil(len(names) / 2) * (LINE * lines + 0.5) + 0.4)
    figure = Figure(figsize=(TEXT, sum(heights)), layout="constrained")
    parts = figure.subfigures(len(columns), 1, squeeze=False, height_ratios=heights)[:, 0]
    rng = np.random.default_rng(0)
    for part, (setting, names) in zip(parts, columns.items(), strict=True):
        part.suptitle(wrapped(run.titles[setting], 2 * TITLE_LETTERS), fontsize=8.0)
        grid = _grid(part, len(names), sharex=False)
        for axes, name in zip(grid, names, strict=False):
            _boxes(axes, run.policies_in(setting), run.rows_of(setting), name, rng)
            axes.set_xlabel(wrapped(heading(name), TITLE_LETTERS))
    return figure


def _grid(figure: Any, count: int, *, sharex: bool = True) -> Any:
    """So many axes, two beside each other, with shared scores."""
    columns = min(2, count)
    grid = figure.subplots(
        math.ceil(count / columns), columns, squeeze=False, sharex=sharex, sharey=True
    ).ravel()
    for axes in grid[count:]:
        axes.set_visible(False)
        grid[count - columns].tick_params(labelbottom=True)  # it has nothing below it
    return grid


def _boxes(
    axes: Any, policies: Mapping[str, int], rows: Sequence[ResultRow], name: str, rng: Any
) -> None:
    """The values of a metric by policy; ``policies`` gives each its place in the palette."""
    for i, (label, place) in enumerate(policies.items()):
        values = np.array(values_of([r for r in rows if r.policy == label], name))
        if len(values) == 0:
            continue
        colour = dots(place)["color"]
        axes.boxplot(
            [values],
            positions=[i],
            widths=0.55,
            orientation="horizontal",
            showfliers=False,
            patch_artist=True,
            boxprops={"facecolor": colour + "30", "edgecolor": colour},
            medianprops={"color": colour, "linewidth": 2},
            whiskerprops={"color": colour},
            capprops={"color": colour},
        )
        places = i + rng.uniform(-0.18, 0.18, len(values))
        unclipped(_cloud(axes, values, places, place, s=6, alpha=0.55, zorder=3))
    axes.set_yticks(range(len(policies)), list(map(wrapped, policies)), fontsize=7.0)
    axes.set_ylim(len(policies) - 0.4, -0.6)
    axes.locator_params(axis="x", nbins=3, min_n_ticks=3)
    tidy(axes)


def _profiles(run: StoredRun) -> Figure | None:
    """Performance profiles with bands (Agarwal et al., 2021), one panel a score."""
    kinds = [name for name in metric_names(Role.SCORE) if values_of(run.rows, name)]
    if not kinds:
        return None
    thresholds = np.linspace(0.0, 1.0, 101)
    groups = grouped(run.rows).items()

    def panel(axes: Any, name: str) -> None:
        for i, label in enumerate(run.policies):
            values = [values_of(rows, name) for (_, policy), rows in groups if policy == label]
            strata = [np.array(one) for one in values if one]
            if not strata:
                continue
            found = performance_profile(strata, thresholds)
            shown = _with_failures(run.rows, label)
            axes.step(thresholds, found.fractions, where="post", label=shown, **line(i))
            band = {"step": "post", "color": line(i)["color"], "alpha": 0.18, "linewidth": 0}
            axes.fill_between(thresholds, found.low, found.high, **band)
        axes.set_xlabel(f"{heading(name)} above")
        axes.set_ylim(0.0, 1.02)
        axes.locator_params(axis="x", nbins=3, min_n_ticks=3)

    return _sheet(kinds, panel, "fraction of episodes", sharex=False)


def _planning_time(run: StoredRun) -> Figure | None:
    """Fraction of planning calls that took at most so long; deadlines are dotted.

    Of long runs, each episode counts with its median and its slowest call.
    """
    read = len(run.rows) <= _TRACES

    def curve(axes: Any, rows: Sequence[ResultRow], index: int, label: str) -> None:
        mine = [row for row in rows if row.plan_time_median_s is not None]
        times = np.sort(np.concatenate([_calls(run, row, read) for row in mine] or [[]]))
        if len(times) == 0:
            return
        fractions = np.arange(1, len(times) + 1) / len(times)
        shown = np.unique(np.linspace(0, len(times) - 1, 500).round().astype(int))
        axes.step(1e3 * times[shown], fractions[shown], where="post", label=label, **line(index))
        if (deadline := run.about.get("deadlines", {}).get(label)) is not None:
            axes.axvline(1e3 * deadline, color=line(index)["color"], linestyle=":", linewidth=1.0)
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(numticks=4))
        axes.xaxis.set_minor_formatter("")
        axes.xaxis.set_major_formatter("{x:g}")
        axes.set_ylim(0.0, 1.02)

    labels = ("time of a planning call [ms]", "fraction of calls")
    return _panels(run, ("plan_time_median_s",), curve, labels)


def _calls(run: StoredRun, row: ResultRow, read: bool) -> Any:
    """Times of all planning calls of an episode [s], from its trace where there is one."""
    if read and (episode := run.episode(row)) is not None:
        return np.maximum(episode.plan_times_s, 1e-6)
    times = (row.plan_time_median_s, row.plan_time_max_s)
    return np.array([time for time in times if time is not None])


def _panels(
    run: StoredRun,
    names: Sequence[str],
    draw: Callable[[Any, Sequence[ResultRow], int, str], None],
    labels: tuple[str, str],
) -> Figure | None:
    """One panel for each setting that has values of one of these columns.

    Args:
        run: the rows.
        names: columns.
        draw: called with axes, the rows of a policy in the setting, its place and its label.
        labels: of the two axes.
    """
    settings = [one for one in run.titles if any(values_of(run.rows_of(one), n) for n in names)]
    if not settings:
        return None

    def panel(axes: Any, setting: str) -> None:
        rows = run.rows_of(setting)
        for label, place in run.policies_in(setting).items():
            draw(axes, [row for row in rows if row.policy == label], place, label)
        axes.set_title(wrapped(run.titles[setting], TITLE_LETTERS))
        if setting in settings[-2:]:
            axes.set_xlabel(wrapped(labels[0], TITLE_LETTERS))

    return _sheet(settings, panel, labels[1])


def _sheet(
    names: Sequence[str], panel: Callable[[Any, str], None], label: str, *, sharex: bool = True
) -> Figure:
    """A panel for each name, two beside each other, with one label on the left and a legend."""
    columns = min(2, len(names))
    size = (min(PANEL[0] * columns, TEXT), PANEL[1] * math.ceil(len(names) / columns))
    figure = Figure(figsize=size, layout="constrained")
    for axes, name in zip(_grid(figure, len(names), sharex=sharex), names, strict=False):
        panel(axes, name)
        tidy(axes)
    figure.supylabel(label, fontsize=8.0)
    add_legend(figure)
    return figure


def _intervals(run: StoredRun) -> Figure:
    """A line for each policy in each setting, a panel for success and each kind of score.

    Success has Wilson's interval, a mean that of the bootstrap, as in the tables.
    """
    columns: dict[str, list[str]] = {}
    for name in metric_names(Role.SCORE):
        if any(name in summary.metrics for summary in run.summary()):
            columns.setdefault(name[0], []).append(name)
    found = {(one.setting, one.policy): one for one in run.summary()}
    figure = Figure(figsize=(TEXT, 1.0), layout="constrained")
    panels = figure.subplots(1, 1 + len(columns), squeeze=False, sharey=True)[0]
    ticks: dict[float, str] = {}
    below = 0.0  # lines of text

    def place(text: str) -> float:
        nonlocal below
        middle = below + 0.5 * (text.count("\n") + 1)
        below = 2.0 * middle - below + 0.15
        ticks[middle] = text
        return middle

    for setting, title in run.titles.items():
        if len(run.titles) > 1:
            place(wrapped(title))
        for policy, index in run.policies_in(setting).items():
            height = place(wrapped(_with_failures(run.rows_of(setting), policy)))
            for axes, names in zip(panels, [[], *columns.values()], strict=True):
                _bar(axes, found[setting, policy], names, height, index)
    figure.set_figheight(LINE * below + 0.5)
    for axes, names in zip(panels, [["success"], *columns.values()], strict=True):
        axes.set_xlabel(names[0] if len(names) == 1 else names[0][0])
        axes.locator_params(axis="x", nbins=3, min_n_ticks=3)
        axes.xaxis.set_major_formatter("{x:g}")
        axes.margins(x=0.08)
        tidy(axes)
        axes.tick_params(axis="y", length=0)
    panels[0].set_xlim(-0.06, 1.06)
    panels[0].set_yticks(list(ticks), list(ticks.values()), fontsize=7.0)
    panels[0].set_ylim(below, 0.0)
    shown = {wrapped(title) for title in run.titles.values()}
    for label in panels[0].get_yticklabels():
        label.set_fontweight("bold" if label.get_text() in shown else "normal")
    return figure


def _bar(axes: Any, summary: PolicySummary, names: Sequence[str], place: float, index: int) -> None:
    """Success, or the one of these scores that the policy has in the setting."""
    shown = [summary.metrics[name] for name in names if name in summary.metrics]
    if names and not shown:
        return
    bar = axes.errorbar(
        shown[0].mean if shown else summary.success.fraction,
        place,
        xerr=interval(shown[0] if shown else summary.success),
        markersize=4.5,
        elinewidth=1.1,
        capsize=2,
        linestyle="none",
        **dots(index),
    )
    unclipped(bar.lines[0])


FIGURES = {
    "intervals": ("Success and scores with 95 % intervals", _intervals),
    "tradeoff": ("Efficiency against effort", _tradeoff),
    "scores": ("Scores of every episode", _spread),
    "profiles": ("Share of episodes above each score, all settings alike", _profiles),
    "planning_time": ("Time of a planning call", _planning_time),
}
"""Name -> caption, and what draws it."""


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
    """An interval as Matplotlib's error bars take it; NaN, which draws none, if there is none."""
    middle = one.mean if isinstance(one, Estimate) else one.fraction
    # in this order NaN stays NaN
    return [[max(middle - one.low, 0.0)], [max(one.high - middle, 0.0)]]


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
