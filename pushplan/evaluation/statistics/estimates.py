"""Estimates with intervals, and tests of paired differences.

Deterministic: resampling draws from a fixed stream.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pushplan.world import InvalidInputError, stream
from pushplan.world.checks import FloatArray, array

RESAMPLES = 9999
MANY = 1000
"""From so many values on the interval of a mean is Student's, which is as wide by then."""
_BATCH = 2_000_000  # values drawn at a time
ENOUGH = 10
"""Nothing is called significant with fewer pairs."""
LEVEL = 0.05
"""Family-wise error rate."""
POWER = 0.8
_EFFICIENCY = 3.0 / math.pi  # of the signed-rank test beside the t-test, normal differences
_EQUAL = 1e-12


@dataclass(frozen=True)
class Estimate:
    """Location and spread of a sample.

    Attributes:
        count: sample size.
        mean: arithmetic mean.
        sd: standard deviation with n - 1 in the denominator; NaN for one value.
        median: 50th percentile.
        low: lower end of the 95 % interval of the mean; NaN for one value.
        high: its upper end; NaN for one value.
        highest: greatest value.
    """

    count: int
    mean: float
    sd: float
    median: float
    low: float
    high: float
    highest: float


@dataclass(frozen=True)
class Proportion:
    """A fraction of successes with its Wilson 95 % interval."""

    count: int
    fraction: float
    low: float
    high: float


def estimate(values: Sequence[float] | FloatArray) -> Estimate:
    """Mean, spread, median and bootstrap interval of a sample.

    Raises:
        InvalidInputError: if the sample is empty or not finite.
    """
    sample: FloatArray = array("sample", np.asarray(values, dtype=np.float64), (None,))
    if len(sample) == 0:
        raise InvalidInputError("an estimate needs at least one value")
    low, high = bootstrap_interval(sample)
    return Estimate(
        count=len(sample),
        mean=float(sample.mean()),
        sd=float(sample.std(ddof=1)) if len(sample) > 1 else math.nan,
        median=float(np.median(sample)),
        low=low,
        high=high,
        highest=float(sample.max()),
    )


def bootstrap_interval(
    values: Sequence[float] | FloatArray, *, level: float = 0.95, resamples: int = RESAMPLES
) -> tuple[float, float]:
    """Bias-corrected and accelerated bootstrap interval of the mean.

    Efron, Better Bootstrap Confidence Intervals, JASA 82 (1987). Several values without spread have
    an interval without width. One value says nothing about the spread: both ends are NaN.

    Args:
        values: the sample, finite and not empty.
        level: confidence level in (0, 1).
        resamples: how many samples are drawn with replacement.
    """
    sample = np.asarray(values, dtype=np.float64)
    mean = float(sample.mean())
    if len(sample) == 1:
        return math.nan, math.nan
    if np.ptp(sample) <= 1e-12 * max(1.0, abs(mean)):
        return mean, mean
    from scipy import stats  # takes a second to import, and only tables need it

    if len(sample) >= MANY:
        half = stats.t.ppf(0.5 + 0.5 * level, len(sample) - 1) * stats.sem(sample)
        return mean - float(half), mean + float(half)
    found = stats.bootstrap(
        (sample,),
        np.mean,
        n_resamples=resamples,
        confidence_level=level,
        method="BCa",
        batch=max(1, _BATCH // len(sample)),
        random_state=stream(0, "bootstrap"),
    )
    return float(found.confidence_interval.low), float(found.confidence_interval.high)


def wilson(successes: int, count: int, *, z: float = 1.959963984540054) -> Proportion:
    """Fraction of successes with Wilson's score interval (JASA 22, 1927).

    Raises:
        InvalidInputError: if there are more successes than trials, or no trial.
    """
    if not 0 <= successes <= count or count == 0:
        raise InvalidInputError(f"need 0 <= successes <= trials > 0, got {successes} of {count}")
    fraction = successes / count
    scale = 1.0 + z * z / count
    centre = (fraction + z * z / (2.0 * count)) / scale
    variance = fraction * (1.0 - fraction) / count + z * z / (4.0 * count * count)
    half = z / scale * math.sqrt(variance)
    low = 0.0 if successes == 0 else centre - half
    high = 1.0 if successes == count else centre + half
    return Proportion(count, fraction, low, high)


def signed_rank_test(gaps: FloatArray) -> tuple[float, float]:
    """Test whether paired differences lie to one side of 0, and how far.

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
    """Return the number of pairs that separate two policies if the observed effect holds.

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
