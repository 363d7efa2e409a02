"""How far episodes are from the best known solution of their scenario, and from its bound."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pushplan.evaluation.rows import ResultRow
from pushplan.scenarios.known_bounds import KnownBounds


@dataclass(frozen=True)
class Gap:
    """How far the successful episodes of a policy are from what is known, as fractions.

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
    length, work = row.metrics.get("path_length_m"), row.metrics.get("interaction_work_kg_m")
    if row.failed or not row.success or length is None or work is None:
        return None
    return known.robot_mass * length + work


def gaps(
    rows: Sequence[ResultRow], policies: Sequence[str], bounds: Mapping[str, KnownBounds]
) -> list[Gap]:
    """The gaps of each policy in each setting; none where no bound is known."""
    ratios: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for row in rows:
        if (known := bounds.get(row.scenario)) is None:
            continue
        if (work := total_work(row, known)) is None or known.bound <= 0.0:
            continue
        best = np.nan if known.best is None else work / known.best - 1.0
        pair = (work / known.bound - 1.0, best)
        ratios.setdefault((row.setting, row.policy), []).append(pair)
    found = []
    place = {policy: i for i, policy in enumerate(policies)}
    for setting, policy in sorted(ratios, key=lambda key: (key[0], place.get(key[1], len(place)))):
        to_bound, to_best = np.array(ratios[setting, policy]).T
        seen = to_best[~np.isnan(to_best)]
        mean = float(seen.mean()) if len(seen) else float("nan")
        found.append(Gap(setting, policy, len(to_bound), float(to_bound.mean()), len(seen), mean))
    return found
