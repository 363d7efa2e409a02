"""The figure that a paper shows: success and scores with 95 % intervals, by policy and by suite."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure

from pushplan.drawing.figure import COLUMN
from pushplan.evaluation.report.plot_style import LINE, dots, interval, tidy, unclipped, wrapped
from pushplan.evaluation.statistics.stored_run import StoredRun
from pushplan.evaluation.statistics.summary import PolicySummary
from pushplan.metrics import Role, metric_names


def draw_intervals(run: StoredRun) -> Figure:
    """A line for each policy in each setting, a panel for success and each kind of score.

    Success has Wilson's interval, a mean that of the bootstrap, as in the tables.
    """
    columns: dict[str, list[str]] = {}
    for name in metric_names(Role.SCORE):
        if any(name in summary.metrics for summary in run.summary()):
            columns.setdefault(name[0], []).append(name)
    found = {(one.setting, one.policy): one for one in run.summary()}
    figure = Figure(figsize=(COLUMN, 1.0), layout="constrained")
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
            height = place(wrapped(policy))
            for axes, names in zip(panels, [[], *columns.values()], strict=True):
                _bar(axes, found[setting, policy], names, height, index)
    figure.set_figheight(LINE * below + 0.5)
    for axes, names in zip(panels, [["success"], *columns.values()], strict=True):
        axes.set_xlabel(names[0] if len(names) == 1 else names[0][0])
        axes.locator_params(axis="x", nbins=1, min_n_ticks=1)
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
