"""A learning curve as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pushplan.training.policies.run import CurvePoint


def draw_curve(
    points: Sequence[CurvePoint], path: str | Path, title: str, *, pairs: bool = False
) -> Path:
    """Draw return and success over decisions, for training and validation."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure: Any = Figure(figsize=(8.0, 3.2), layout="constrained")
    FigureCanvasAgg(figure)
    returns, fractions = figure.subplots(1, 2)
    steps = [point.steps for point in points]
    returns.plot(steps, [p.train_return for p in points], ".-", label="training", lw=1)
    returns.plot(steps, [p.valid_return for p in points], "o-", label="validation", lw=1, ms=3)
    returns.set_ylabel("reward of an episode")
    fractions.plot(steps, [p.train_success for p in points], ".-", label="success, training", lw=1)
    fractions.plot(steps, [p.valid_success for p in points], "o-", label="success", lw=1, ms=3)
    fractions.plot(steps, [p.valid_share for p in points], "--", label="sub-tasks done", lw=1)
    fractions.set_ylim(-0.02, 1.02)
    for axes in (returns, fractions):
        axes.set_xlabel("pairs" if pairs else "decisions")
        axes.locator_params(axis="x", nbins=6)
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8)
    figure.suptitle(title, fontsize=10)
    figure.savefig(str(path), dpi=110)
    return Path(path)
