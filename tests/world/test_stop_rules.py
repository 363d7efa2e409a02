"""Stop rules fire when they say, compose, and can be used again."""

from __future__ import annotations

import math

import pytest

from pushplan.world import (
    Cancellation,
    Deadline,
    FirstSolution,
    InvalidInputError,
    MaxIterations,
)


def test_iterations():
    check = MaxIterations(3).start()
    assert [check(i, math.inf) for i in range(5)] == [False, False, False, True, True]


def test_first_solution():
    check = FirstSolution().start()
    assert not check(10, math.inf)
    assert check(11, 2.0)


def test_a_deadline_counts_from_each_call(monkeypatch):
    now = 100.0
    monkeypatch.setattr("time.perf_counter", lambda: now)
    rule = Deadline(0.03)
    for _ in range(2):
        check = rule.start()
        now += 0.029
        assert not check(0, math.inf)
        now += 0.002
        assert check(0, math.inf)


def test_rules_compose():
    token = Cancellation()
    rule = Deadline(60.0) | MaxIterations(5) | token
    check = rule.start()
    assert not check(4, math.inf)
    assert check(5, math.inf)
    assert rule.seconds == 60.0
    assert not rule.cancelled
    token.cancel()
    assert check(0, math.inf)
    assert rule.cancelled


@pytest.mark.parametrize(
    "build",
    [
        lambda: Deadline(-1),
        lambda: Deadline(math.nan),
        lambda: Deadline("1"),
        lambda: MaxIterations(1.5),
        lambda: MaxIterations(-1),
    ],
)
def test_bad_budgets(build):
    with pytest.raises(InvalidInputError):
        build()
