"""Figures of a study at the widths of a paper: no text overlaps, none is cut off, no marker is."""

from __future__ import annotations

import itertools
import re
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PathCollection
from matplotlib.text import Text
from synthetic_rows import many_rows

from pushplan.drawing import save_figure
from pushplan.evaluation import Results
from pushplan.evaluation.report.plots import FIGURES

LONG = "a_very_long_policy_name@push_weight-0.25@clearance-0.125@sticks-x"


def study(policies: int, settings: int, long: bool) -> Results:
    """A run with scores at their limits and planning times over five decades."""
    rows = []
    for row in many_rows(policies * settings * 6, policies).rows:
        number = int(row.policy.removeprefix("policy-"))
        place, seed = row.seed % settings, row.seed // settings
        setting = f"kitchens {place} of a very long-name=3 with_more,words" if long else f"s{place}"
        scores = {name: value - 0.08 * place for name, value in row.metrics.items()}
        at_limit = {"E_nav": 1.0, "I_nav": 1.0} if seed % 2 else scores
        rows.append(
            replace(
                row,
                policy=f"{LONG[:60]}{number}" if long else f"p{number}",
                scenario=f"{setting}/{seed}-{row.scenario}-{row.seed}",
                metrics={**at_limit, "path_length_m": 1e3 + 1e2 * seed, "steps": 100},
                plan_calls=2,
                plan_time_median_s=1e-4 * 10.0 ** (number % 3),
                plan_time_max_s=10.0,
            )
        )
    return Results(tuple(rows))


def shown_texts(figure: Any, renderer: Any) -> list[tuple[str, Any]]:
    """Every text that is drawn, with its box; labels of ticks outside the view are not drawn."""
    boxes = []
    for axes in figure.axes:
        for axis, low, high in zip(
            (axes.xaxis, axes.yaxis), axes.viewLim.min, axes.viewLim.max, strict=True
        ):
            low, high = sorted((low, high))
            for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
                inside = low - 1e-9 <= tick.get_loc() <= high + 1e-9
                tick.label1.set_visible(tick.label1.get_visible() and inside)
    for text in figure.findobj(Text):
        owner = text.axes
        if text.get_text() and text.get_visible() and (owner is None or owner.get_visible()):
            boxes.append((text.get_text(), text.get_window_extent(renderer)))
    return [(text, box) for text, box in boxes if box.width > 0.0]


@pytest.mark.parametrize(
    "width",
    [3.3, *(pytest.param(width, marks=pytest.mark.slow) for width in (None, 7.0))],
)
@pytest.mark.parametrize("name", FIGURES)
@pytest.mark.parametrize(
    ("policies", "settings", "long"),
    [
        (2, 3, True),
        pytest.param(3, 1, False, marks=pytest.mark.slow),
        pytest.param(9, 4, True, marks=pytest.mark.slow),
        pytest.param(20, 1, True, marks=pytest.mark.slow),
        pytest.param(2, 24, True, marks=pytest.mark.slow),
    ],
)
def test_no_text_overlaps_and_nothing_is_cut_off(
    name: str, width: float | None, policies: int, settings: int, long: bool
) -> None:
    figure = study(policies, settings, long).figure(name)
    if width is not None:
        figure.set_figwidth(width)
    canvas = FigureCanvasAgg(figure)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        canvas.draw()
    renderer = canvas.get_renderer()
    texts = shown_texts(figure, renderer)
    assert len(texts) > policies
    page = figure.bbox
    for text, box in texts:
        inside = page.x0 <= box.x0 and box.x1 <= page.x1 and page.y0 <= box.y0 and box.y1 <= page.y1
        assert inside, f"{text!r} is cut off: {box} in {page}"
    for (one, box), (other, other_box) in itertools.combinations(texts, 2):
        assert not box.padded(-0.5).overlaps(other_box.padded(-0.5)), f"{one!r} over {other!r}"
    for axes in figure.axes:
        if axes.get_visible():
            assert min(axes.bbox.width, axes.bbox.height) > 0.3 * figure.dpi
            clouds = [found for found in axes.collections if isinstance(found, PathCollection)]
            means = [bar.lines[0] for bar in axes.containers]
            assert not any(artist.get_clip_on() for artist in (*means, *clouds))
            for mean in means:  # nor is one outside of its axes
                (x,), (y,) = mean.get_xdata(), mean.get_ydata()
                assert axes.viewLim.padded(1e-9).contains(x, y)


@pytest.mark.parametrize("name", FIGURES)
@pytest.mark.parametrize(("policies", "settings"), [(2, 3), (3, 1)])
def test_a_pdf_is_no_wider_than_an_article_and_every_axis_has_a_scale(
    name: str, policies: int, settings: int, tmp_path: Path
) -> None:
    figure = study(policies, settings, False).figure(name)
    save_figure(tmp_path / "a.pdf", figure)
    box = re.search(rb"/MediaBox \[ 0 0 ([0-9.]+) ", (tmp_path / "a.pdf").read_bytes())
    assert box is not None and float(box[1]) / 72.0 * 72.27 <= 345.0
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    shown_texts(figure, canvas.get_renderer())
    for axes in filter(
        lambda axes: axes.get_visible() and axes.xaxis.get_ticklabels(), figure.axes
    ):
        ticks = [tick.label1 for tick in axes.xaxis.get_major_ticks()]
        numbers = {label.get_text() for label in ticks if label.get_visible()} - {""}
        assert len(numbers) >= 3, (axes.get_xlabel(), axes.viewLim)
