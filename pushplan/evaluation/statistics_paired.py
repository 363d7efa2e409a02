"""Tests of paired differences: significance, size of the effect, episodes that are missing."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pushplan.world.checks import FloatArray

ENOUGH = 10
"""Nothing is called significant with fewer pairs."""
LEVEL = 0.05
"""Family-wise error rate."""
POWER = 0.8
_EFFICIENCY = 3.0 / math.pi  # of the signed-rank test beside the t-test, normal differences
_EQUAL = 1e-12


def signed_rank_test(gaps: FloatArray) -> tuple[float, float]:
    """Whether paired differences lie to one side of 0, and how far.

    Wilcoxon's signed-rank test, without the differences that are 0. Differences of one size, such
    as those of success, say nothing but their signs: the exact sign test, which is McNemar's.

    Args:
        gaps: (N,) differences.

    Returns:
        Two-sided p value, 1 if all differences are 0; matched-pairs rank-biserial correlation
        (Kerby, The simple difference formula, 2014) in [-1, 1], 0 if all are 0.
    """
    gaps = np.where(np.abs(gaps) <= _EQUAL * max(1.0, float(np.abs(gaps).max())), 0.0, gaps)
    rest = gaps[gaps != 0.0]
    if len(rest) == 0:
        return 1.0, 0.0
    from scipy import stats  # takes a second to import, and only tables need it

    ranks = stats.rankdata(np.abs(rest))
    effect = float(np.sign(rest) @ ranks / ranks.sum())
    if np.ptp(np.abs(rest)) == 0.0:
        return float(stats.binomtest(int((rest > 0.0).sum()), len(rest)).pvalue), effect
    return float(stats.wilcoxon(rest).pvalue), effect


def holm(p_values: Sequence[float]) -> list[float]:
    """P values corrected for the number of tests.

    Holm, A simple sequentially rejective multiple test procedure, Scand. J. Statist. 6 (1979).
    """
    order = np.argsort(p_values, kind="stable")
    scaled = np.asarray(p_values, dtype=np.float64)[order] * np.arange(len(order), 0, -1)
    corrected = np.empty(len(order))
    corrected[order] = np.minimum(np.maximum.accumulate(scaled), 1.0)
    return [float(p) for p in corrected]


def pairs_needed(gaps: FloatArray, tests: int = 1) -> int | None:
    """How many pairs separate two policies whose differences go on as so far.

    Guenther's sample size for a paired t-test (Am. Statist. 35, 1981) at level 0.05 / ``tests``
    and power 0.8, divided by the efficiency of the signed-rank test beside it.

    Args:
        gaps: (N,) differences.
        tests: how many tests the correction counts.

    Returns:
        A total of pairs, those that are there included; None if the mean difference is 0 or there
        are fewer than two.
    """
    mean = float(np.mean(gaps))
    sd = float(np.std(gaps, ddof=1)) if len(gaps) > 1 else math.nan
    if abs(mean) <= _EQUAL * max(1.0, float(np.abs(gaps).max())) or math.isnan(sd):
        return None
    from scipy import stats

    rejects = float(stats.norm.ppf(1.0 - 0.5 * LEVEL / tests))
    detects = float(stats.norm.ppf(POWER))
    count = ((rejects + detects) * sd / mean) ** 2 + 0.5 * rejects**2
    return max(ENOUGH, math.ceil(count / _EFFICIENCY))
