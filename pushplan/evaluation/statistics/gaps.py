"""Gaps of episodes to the best known solution of their scenario, and to its bound."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pushplan.evaluation.statistics.summary import grouped
from pushplan.evaluation.store.rows import ResultRow
from pushplan.scenarios.known_bounds import KnownBounds


@dataclass(frozen=True)
class Gap:
    """Gaps of a policy's successful episodes to the best known and to the bound, as fractions.

    Args:
        setting: the scenarios without their seeds.
        policy: label.
        count: successful episodes of scenarios of which a bound is known.
        to_bound: mean of work / bound - 1.
        with_best: those of which a best known solution is known.
        to_best: mean of work / best known - 1; NaN if there are none. Below 0 where the policy
            found better ones.
    """

    setting: str
    policy: str
    count: int
    to_bound: float
    with_best: int
    to_best: float


def total_work(row: ResultRow, known: KnownBounds) -> float | None:
    """m₀ l₀ + Σ mᵢ lᵢ of an episode that succeeded [kg m], else None."""
    length = row.metrics.get("path_length_m")
    work = row.metrics.get("interaction_work_kg_m")
    if row.failed or not row.success or length is None or work is None:
        return None
    return known.robot_mass * length + work


def gaps(
    rows: Sequence[ResultRow], policies: Sequence[str], bounds: Mapping[str, KnownBounds]
) -> list[Gap]:
    """The gaps of each policy in each setting; none where no bound is known."""
    found = []
    for (setting, policy), group in grouped(rows, policies).items():
        to_bound = []
        to_best = []
        for row in group:
            mine = bounds.get(row.scenario)
            if mine is None or (work := total_work(row, mine)) is None or mine.bound <= 0.0:
                continue
            to_bound.append(work / mine.bound - 1.0)
            if mine.best is not None:
                to_best.append(work / mine.best - 1.0)
        if to_bound:
            mean = float(np.mean(to_best)) if to_best else float("nan")
            to = float(np.mean(to_bound))
            found.append(Gap(setting, policy, len(to_bound), to, len(to_best), mean))
    return sorted(found, key=lambda gap: gap.setting)
