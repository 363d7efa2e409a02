"""One number for scores over several settings, with stratified bootstrap intervals.

The definitions are those of Agarwal et al., Deep Reinforcement Learning at the Edge of the
Statistical Precipice, NeurIPS 2021 (the library rliable): a setting is a task there, an episode a
run. Deterministic: resampling draws from a fixed stream.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pushplan.world import InvalidInputError, stream
from pushplan.world.checks import FloatArray, array

RESAMPLES = 2000
"""Number of bootstrap samples; down to a tenth of it for more than 10,000 scores."""
_BATCH = 2_000_000  # values drawn at a time
Strata = Sequence[FloatArray]


@dataclass(frozen=True)
class Aggregate:
    """A statistic over all settings with its 95 % interval, NaN if no setting has two values."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Profile:
    """Fractions of episodes that score more than each threshold, with pointwise 95 % bands."""

    thresholds: FloatArray  # (T,)
    fractions: FloatArray  # (T,)
    low: FloatArray  # (T,), NaN if no setting has two values
    high: FloatArray  # (T,)


def interquartile_mean(scores: Strata) -> Aggregate:
    """Mean of the middle half of all episodes of all settings.

    Args:
        scores: (N,) values of each setting.

    Raises:
        InvalidInputError: if a setting has no values, or one that is not finite.
    """
    from scipy import stats

    def middle(drawn: list[list[FloatArray]]) -> FloatArray:
        return np.asarray(stats.trim_mean(np.concatenate(drawn[0], axis=1), 0.25, axis=1))

    return Aggregate(*map(float, _bootstrap([scores], middle)))


def probability_of_improvement(first: Strata, second: Strata) -> Aggregate:
    """Estimate the probability that an episode of the first scores more than one of the second.

    Mean over settings of the Mann-Whitney statistic; a tie counts one half.

    Args:
        first: (N,) values of each setting.
        second: (M,) values of each setting, in the same order.

    Raises:
        InvalidInputError: if there are not as many settings, or one has no finite values.
    """
    if len(first) != len(second):
        raise InvalidInputError(
            f"need the same settings of both policies, got {len(first)} and {len(second)}"
        )

    from scipy import stats

    def exceeds(drawn: list[list[FloatArray]]) -> FloatArray:
        found = []
        for x, y in zip(*drawn, strict=True):
            test = stats.mannwhitneyu(x, y, axis=1, method="asymptotic")
            found.append(test.statistic / (x.shape[1] * y.shape[1]))
        return np.asarray(np.mean(found, axis=0))

    return Aggregate(*map(float, _bootstrap([first, second], exceeds)))


def performance_profile(scores: Strata, thresholds: FloatArray) -> Profile:
    """Fraction of episodes that score more than each threshold, as mean over settings.

    Args:
        scores: (N,) values of each setting.
        thresholds: (T,) increasing.

    Raises:
        InvalidInputError: if a setting has no values, or one that is not finite.
    """

    def fractions(drawn: list[list[FloatArray]]) -> FloatArray:
        return np.asarray(
            np.mean([[(row[:, None] > thresholds).mean(axis=0) for row in x] for x in drawn[0]], 0)
        )

    value, low, high = _bootstrap([scores], fractions, weight=len(thresholds))
    return Profile(np.asarray(thresholds), value, low, high)


def _bootstrap(
    samples: Sequence[Strata],
    statistic: Callable[[list[list[FloatArray]]], FloatArray],
    weight: int = 1,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Value and percentile interval; episodes are drawn within their setting."""
    checked = [[array("scores", x, (None,)) for x in strata] for strata in samples]
    if not all(strata and all(len(x) for x in strata) for strata in checked):
        raise InvalidInputError("every setting needs at least one score")
    rng = stream(0, "bootstrap")
    size = weight * sum(len(x) for strata in checked for x in strata)
    count = int(np.clip(10 * _BATCH // size, RESAMPLES // 10, RESAMPLES))
    batch = min(count, max(1, _BATCH // size))
    found = []
    for begin in range(0, count, batch):
        lines = min(batch, count - begin)
        drawn = [
            [x[rng.integers(len(x), size=(lines, len(x)))] for x in strata] for strata in checked
        ]
        found.append(statistic(drawn))
    value = statistic([[x[None] for x in strata] for strata in checked])[0]
    low, high = np.percentile(np.concatenate(found), (2.5, 97.5), axis=0)
    if all(len(x) == 1 for strata in checked for x in strata):
        low, high = np.full_like((low, high), np.nan)
    return value, low, high
