from __future__ import annotations

import numpy as np
import pytest
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st

from pushplan.evaluation.statistics.aggregates import (
    interquartile_mean,
    performance_profile,
    probability_of_improvement,
)
from pushplan.evaluation.statistics.estimates import (
    ENOUGH,
    MANY,
    bootstrap_interval,
    holm,
    pairs_needed,
    signed_rank_test,
)
from pushplan.world import InvalidInputError

P_VALUES = st.lists(st.floats(0.0, 1.0), min_size=1, max_size=30)


def test_holm_by_hand() -> None:
    # Holm (1979): 3 x 0.01, then 2 x 0.02, then the maximum so far
    assert holm([0.02, 0.01, 0.03]) == pytest.approx([0.04, 0.03, 0.04])
    assert holm([0.9, 0.6]) == [1.0, 1.0]
    assert holm([]) == []


@given(P_VALUES)
def test_holm_lies_between_no_correction_and_bonferroni(p_values: list[float]) -> None:
    corrected = np.array(holm(p_values))
    raw = np.array(p_values)
    assert (raw <= corrected + 1e-15).all()
    assert (corrected <= np.minimum(len(raw) * raw, 1.0) + 1e-15).all()
    assert (np.diff(corrected[np.argsort(raw, kind="stable")]) >= 0.0).all()


def test_signed_rank_test_by_hand() -> None:
    # ranks 1 to 4, one of them negative: W+ = 9, W- = 1
    p_value, effect = signed_rank_test(np.array([-1.0, 2.0, 3.0, 4.0]))
    assert effect == pytest.approx(0.8)
    assert p_value == pytest.approx(0.25)  # 2 (2 / 2^4): subsets of ranks with a sum of at most 1


def test_success_is_compared_by_its_signs() -> None:
    gaps = np.array([1.0] * 8 + [-1.0] * 2 + [0.0] * 40)
    p_value, effect = signed_rank_test(gaps)
    assert p_value == scipy.stats.binomtest(8, 10).pvalue
    assert effect == pytest.approx(0.6)
    assert signed_rank_test(np.zeros(5)) == (1.0, 0.0)


@settings(max_examples=40)
@given(st.lists(st.floats(-10.0, 10.0), min_size=1, max_size=6))
def test_the_other_way_round_is_the_same_test(values: list[float]) -> None:
    is_the_same_the_other_way_round(values)


@pytest.mark.slow
@settings(max_examples=40)
@given(st.lists(st.floats(-10.0, 10.0), min_size=7, max_size=25))
def test_the_other_way_round_is_the_same_test_of_many_pairs(values: list[float]) -> None:
    is_the_same_the_other_way_round(values)


def is_the_same_the_other_way_round(values: list[float]) -> None:
    gaps = np.array(values)
    p_value, effect = signed_rank_test(gaps)
    assert 0.0 <= p_value <= 1.0 and -1.0 <= effect <= 1.0
    assert signed_rank_test(-gaps) == pytest.approx((p_value, -effect))


@pytest.mark.parametrize("shift", [0.3, pytest.param(0.6, marks=pytest.mark.slow)])
def test_with_the_pairs_that_are_needed_the_test_rejects_in_eight_of_ten(shift: float) -> None:
    rng = np.random.default_rng(1)
    pilot = rng.normal(size=20_000)
    count = pairs_needed((pilot - pilot.mean()) / pilot.std(ddof=1) + shift)
    assert count is not None
    found = [signed_rank_test(rng.normal(shift, 1.0, count))[0] < 0.05 for _ in range(600)]
    assert np.mean(found) == pytest.approx(0.8, abs=0.05)


def test_no_number_of_pairs_separates_equal_policies() -> None:
    assert pairs_needed(np.zeros(20)) is None
    assert pairs_needed(np.array([1.0, -1.0])) is None
    assert pairs_needed(np.array([0.3])) is None
    assert pairs_needed(np.full(3, 0.5)) == ENOUGH
    gaps = np.random.default_rng(0).normal(0.2, 1.0, 50)
    one, many = pairs_needed(gaps), pairs_needed(gaps, tests=20)
    assert one is not None and many is not None and one < many


def test_interquartile_mean_by_hand_and_by_scipy() -> None:
    # the middle four of 1 to 8 over both settings
    found = interquartile_mean([np.array([1.0, 8.0, 3.0, 6.0]), np.array([2.0, 7.0, 4.0, 5.0])])
    assert found.value == 4.5
    sample = np.random.default_rng(0).gamma(2.0, size=60)
    found = interquartile_mean([sample])
    theirs = scipy.stats.bootstrap(
        (sample,), lambda x, axis: scipy.stats.trim_mean(x, 0.25, axis=axis), method="percentile"
    ).confidence_interval
    width = theirs.high - theirs.low
    assert (found.low, found.high) == pytest.approx((theirs.low, theirs.high), abs=0.08 * width)


def test_episodes_are_drawn_within_their_setting() -> None:
    # settings far apart, nothing varies within: there is nothing to be unsure about
    found = interquartile_mean([np.full(9, 0.1), np.full(9, 0.9)])
    assert found.low == found.value == found.high == pytest.approx(0.5)


def test_probability_of_improvement_by_hand() -> None:
    # setting 1: 3 of 4 pairs above; setting 2: all equal
    found = probability_of_improvement(
        [np.array([2.0, 4.0]), np.array([1.0])], [np.array([1.0, 3.0]), np.array([1.0])]
    )
    assert found.value == pytest.approx((0.75 + 0.5) / 2)
    rng = np.random.default_rng(2)
    one, two = rng.normal(0.3, 1.0, 30), rng.normal(size=40)
    statistic = scipy.stats.mannwhitneyu(one, two).statistic
    assert probability_of_improvement([one], [two]).value == pytest.approx(statistic / 1200)


def test_performance_profile_by_hand() -> None:
    profile = performance_profile(
        [np.array([0.2, 0.6]), np.array([0.5, 0.5, 0.9])], np.array([0.0, 0.5, 0.95])
    )
    assert profile.fractions == pytest.approx([1.0, (1 / 2 + 1 / 3) / 2, 0.0])
    assert (profile.low <= profile.fractions).all() and (profile.fractions <= profile.high).all()


def test_settings_without_scores_are_refused() -> None:
    with pytest.raises(InvalidInputError, match="at least one score"):
        interquartile_mean([np.array([1.0]), np.array([])])
    with pytest.raises(InvalidInputError, match="same settings"):
        probability_of_improvement([np.array([1.0])], [])


def test_large_samples_have_the_interval_of_the_bootstrap() -> None:
    sample = np.random.default_rng(0).gamma(2.0, size=MANY)
    theirs = scipy.stats.bootstrap((sample,), np.mean, method="BCa", n_resamples=4999, batch=500)
    low, high = theirs.confidence_interval
    assert bootstrap_interval(sample) == pytest.approx((low, high), abs=0.05 * (high - low))
