from __future__ import annotations

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from pushplan.evaluation import bootstrap_interval, wilson
from pushplan.evaluation.statistics.estimates import estimate
from pushplan.world import InvalidInputError


@pytest.mark.parametrize("count", [8, 30, 200])
def test_bootstrap_agrees_with_scipy(count: int) -> None:
    sample = np.random.default_rng(count).gamma(2.0, size=count)
    theirs = scipy.stats.bootstrap((sample,), np.mean, method="BCa", n_resamples=9999)
    width = theirs.confidence_interval.high - theirs.confidence_interval.low
    ours = bootstrap_interval(sample)
    assert ours == pytest.approx(tuple(theirs.confidence_interval), abs=0.06 * width)


def test_bootstrap_repeats_exactly() -> None:
    sample = np.random.default_rng(0).normal(size=50)
    assert bootstrap_interval(sample) == bootstrap_interval(sample.copy())


@given(st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=20))
def test_an_interval_lies_within_the_sample(values: list[float]) -> None:
    found = estimate(values)
    slack = 1e-9 * (1.0 + max(abs(v) for v in values))
    assert min(values) - slack <= found.low <= found.high <= max(values) + slack
    assert np.isfinite([found.mean, found.sd, found.median]).all()


def test_bootstrap_covers_the_true_mean() -> None:
    rng = np.random.default_rng(3)
    intervals = [bootstrap_interval(rng.normal(1.0, 2.0, 40), resamples=999) for _ in range(200)]
    assert 0.88 <= np.mean([low <= 1.0 <= high for low, high in intervals]) <= 0.99


@pytest.mark.parametrize(("successes", "count"), [(0, 10), (3, 10), (10, 10), (47, 50)])
def test_wilson_agrees_with_scipy(successes: int, count: int) -> None:
    theirs = scipy.stats.binomtest(successes, count).proportion_ci(method="wilson")
    ours = wilson(successes, count)
    assert (ours.low, ours.high) == pytest.approx(tuple(theirs), abs=1e-12)
    assert ours.fraction == successes / count


def test_nothing_cannot_be_estimated() -> None:
    with pytest.raises(InvalidInputError):
        estimate([])
    with pytest.raises(InvalidInputError):
        wilson(0, 0)
