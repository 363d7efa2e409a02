"""A picture of a push: the box's offset and the friction cone's margin over time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pushplan.evaluation.plots import COLOURS
from pushplan.planners.pushing.push_log import PushLog
from pushplan.world import InvalidInputError
from pushplan.world.checks import FloatArray


def push_figure(logs: PushLog | Mapping[str, PushLog], safe: float = 0.6) -> Figure:
    """Offset on the bumper, angle against it, and unused fraction of the friction cone.

    Save it with ``figure.savefig(path)``. Lines are interrupted while the box is not pushed.

    Args:
        logs: one push, or several by name.
        safe: fraction of half the bumper that is shaded, see `PushingConfig.safe`.

    Raises:
        InvalidInputError: if there is no push to draw.
    """
    named = {"": logs} if isinstance(logs, PushLog) else dict(logs)
    if not named or not all(isinstance(log, PushLog) for log in named.values()):
        raise InvalidInputError("push_figure needs at least one PushLog")
    with_path = any(np.isfinite(log.lateral).any() for log in named.values())
    figure = Figure(figsize=(7.2, 6.4 if with_path else 5.0), layout="constrained")
    rows: Any = figure.subplots(4 if with_path else 3, 1, sharex=True)
    for i, (name, log) in enumerate(named.items()):
        style = {"color": COLOURS[i % len(COLOURS)], "linewidth": 1.3, "label": name or None}
        rows[0].plot(log.times, _shown(log, log.offset), **style)
        rows[1].plot(log.times, np.degrees(_shown(log, log.angle)), **style)
        rows[2].plot(log.times, _shown(log, log.margin), **style)
        if with_path:
            rows[3].plot(log.times, _shown(log, log.lateral), **style)
    rows[0].axhspan(-safe, safe, color="0.93", zorder=0)
    for end in (-1.0, 1.0):
        rows[0].axhline(end, color="0.4", linewidth=0.8, linestyle="--")
    rows[0].set_ylim(-1.15, 1.15)
    rows[0].set_ylabel("offset\n[half bumpers]")
    rows[1].set_ylabel("angle on the\nbumper [°]")
    rows[2].axhspan(-1.1, 0.0, color="#D55E00", alpha=0.10, zorder=0)
    rows[2].set_ylim(-1.1, 1.1)
    rows[2].set_ylabel("margin of the\nfriction cone")
    if with_path:
        rows[3].axhline(0.0, color="0.4", linewidth=0.8)
        rows[3].set_ylabel("distance from\nthe path [m]")
    rows[-1].set_xlabel("time [s]")
    for axes in rows:
        axes.grid(alpha=0.25, linewidth=0.6)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    if any(named):
        rows[0].legend(
            loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, fontsize=8, frameon=False
        )
    return figure


def _shown(log: PushLog, values: FloatArray) -> FloatArray:
    return np.where(log.touching, values, np.nan)
