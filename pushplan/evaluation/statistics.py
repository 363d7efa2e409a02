"""Estimates with intervals. Deterministic: resampling draws from a fixed stream."""

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


@dataclass(frozen=True)
class Estimate:
    """Location and spread of a sample.

    Attributes:
        count: sample size.
        mean: arithmetic mean.
        sd: standard deviation with n - 1 in the denominator; 0 for one value.
        median: 50th percentile.
        low: lower end of the 95 % interval of the mean.
        high: its upper end.
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
        sd=float(sample.std(ddof=1)) if len(sample) > 1 else 0.0,
        median=float(np.median(sample)),
        low=low,
        high=high,
        highest=float(sample.max()),
    )


def bootstrap_interval(
    values: Sequence[float] | FloatArray, *, level: float = 0.95, resamples: int = RESAMPLES
) -> tuple[float, float]:
    """Bias-corrected and accelerated bootstrap interval of the mean.

    Efron, Better Bootstrap Confidence Intervals, JASA 82 (1987). A sample without spread has an
    interval without width.

    Args:
        values: the sample, finite and not empty.
        level: confidence level in (0, 1).
        resamples: how many samples are drawn with replacement.
    """
    sample = np.asarray(values, dtype=np.float64)
    mean = float(sample.mean())
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
    half = (
        z / scale * math.sqrt(fraction * (1.0 - fraction) / count + z * z / (4.0 * count * count))
    )
    low = 0.0 if successes == 0 else centre - half
    high = 1.0 if successes == count else centre + half
    return Proportion(count, fraction, low, high)
