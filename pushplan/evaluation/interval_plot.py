"""The figure that a paper shows: success and scores with 95 % intervals, by policy and by suite."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib import rcParams
from matplotlib.figure import Figure
from matplotlib.transforms import blended_transform_factory

from pushplan.drawing.figure import COLUMN
from pushplan.evaluation.plot_style import dots, interval, tidy
from pushplan.evaluation.run_record import RunRecord
from pushplan.evaluation.summary import PolicySummary
from pushplan.metrics import Role, metric_names

_LINE = 0.16  # height of a line [inch]
_LETTERS = 46  # of the common size, in the width of the figure


def draw_intervals(run: RunRecord) -> Figure:
    """A line for each policy in each setting, a panel for success and each kind of score.

    Success has Wilson's interval, a mean that of the bootstrap, as in the tables.
    """
    columns: dict[str, list[str]] = {}
    for name in metric_names(Role.SCORE):
        if any(name in summary.metrics for summary in run.summaries):
            columns.setdefault(name[0], []).append(name)
    found = {(one.setting, one.policy): one for one in run.summaries}
    titled = len(run.titles) > 1
    lines = sum(len(run.policies_in(setting)) + titled for setting in run.titles)
    figure = Figure(figsize=(COLUMN, _LINE * lines + 0.5), layout="constrained")
    panels = figure.subplots(1, 1 + len(columns), squeeze=False, sharey=True)[0]
    where = blended_transform_factory(figure.transFigure, panels[0].transData)
    panels[0].set_zorder(1.0)
    panels[0].patch.set_visible(False)
    ticks: dict[int, str] = {}
    for setting, title in run.titles.items():
        if titled:
            place = len(ticks)
            ticks[place] = ""
            box = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
            size = rcParams["font.size"] * min(1.0, _LETTERS / len(title))
            text = panels[0].text(
                0.02, place, title, transform=where, va="center", bbox=box, fontsize=size
            )
            text.set_in_layout(False)  # it reaches over all panels
        for policy, index in run.policies_in(setting).items():
            for axes, names in zip(panels, [[], *columns.values()], strict=True):
                _bar(axes, found[setting, policy], names, len(ticks), index)
            ticks[len(ticks)] = policy
    for axes, names in zip(panels, [["success"], *columns.values()], strict=True):
        axes.set_xlabel(names[0] if len(names) == 1 else names[0][0])
        axes.locator_params(axis="x", nbins=2, steps=[1, 2, 5, 10])
        axes.margins(x=0.08)
        tidy(axes)
    panels[0].set_xlim(-0.06, 1.06)
    panels[0].set_yticks(list(ticks), list(ticks.values()))
    panels[0].set_ylim(lines - 0.4, -0.6)
    for axes in panels:
        axes.tick_params(axis="y", length=0)
    return figure


def _bar(axes: Any, summary: PolicySummary, names: Sequence[str], place: int, index: int) -> None:
    """Success, or the one of these scores that the policy has in the setting."""
    share = summary.success
    mean, low, high = share.fraction, share.low, share.high
    if names:
        scores = [summary.metrics[name] for name in names if name in summary.metrics]
        if not scores:
            return
        mean, low, high = scores[0].mean, scores[0].low, scores[0].high
    axes.errorbar(
        mean,
        place,
        xerr=interval(mean, low, high),
        markersize=4.5,
        elinewidth=1.1,
        capsize=2,
        linestyle="none",
        **dots(index),
    )
