"""Paired times: turns, ratios and digests, in this tree against itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.speed.paired import Answer, FailedError, Side, compare, side, table
from benchmarks.speed.paired_worker import digest

ROOT = Path(__file__).parents[1]
SHORT = "sweep: 10 objects, 200 poses"


class Scripted(Side):
    """Answers with times of its own, and writes down who was asked."""

    def __init__(self, name: str, factor: float, result: str, asked: list[str]) -> None:
        self.name = name
        self.factor = factor
        self.result = result
        self.asked = asked

    def run(self, workload: str, calls: int) -> Answer:
        self.asked.append(self.name)
        drift = 1.0 + 0.1 * (len(self.asked) // 2)  # of the machine: the same for both of a pair
        return Answer(self.factor * drift, self.result)


def test_trees_take_turns_and_ratios_are_of_pairs() -> None:
    asked: list[str] = []
    old = Scripted("old", 2.0, "a", asked)
    new = Scripted("new", 1.0, "a", asked)
    found = compare(old, new, SHORT, 4)
    assert asked[4:] == ["old", "new", "new", "old"] * 2
    assert found.same
    assert found.ratio == pytest.approx(0.5, abs=0.03)
    low, high = found.interval
    assert low <= found.ratio <= high < 0.6


@pytest.mark.slow
def test_a_tree_is_as_fast_as_itself_and_gives_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    with side("old", ROOT, None, True) as old, side("new", ROOT, None, True) as new:
        found = compare(old, new, SHORT, 3)
        with pytest.raises(FailedError, match="old tree: KeyError: 'no such work'"):
            compare(old, new, "no such work", 1)
        table(old, new, [SHORT, "no such work"], 2)
    assert found.same
    assert (found.old > 0.0).all() and (found.new > 0.0).all()
    printed = capsys.readouterr().out
    assert f"| {SHORT} |" in printed
    assert "| yes |" in printed
    assert "| no such work | old tree: KeyError" in printed
    assert "Median of 1 ratios" in printed


def test_an_interval_of_equal_times_holds_1() -> None:
    asked: list[str] = []
    sides = [Scripted(name, 1.0, name, asked) for name in ("old", "new")]
    found = compare(*sides, SHORT, 8)
    low, high = found.interval
    assert low <= 1.0 <= high
    assert not found.same


def test_a_folder_without_the_package_is_named(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    with (
        side("old", tmp_path, None, True) as old,
        pytest.raises(SystemExit, match="the process of the old tree has ended"),
    ):
        old.run(SHORT, 1)
    assert f"not from {tmp_path}" in capfd.readouterr().err


def test_a_digest_tells_last_digits_apart() -> None:
    one = np.array([0.1, 0.2])
    assert digest([one, 0.3]) == digest([one.copy(), 0.3])
    assert digest([one, 0.3]) != digest([np.nextafter(one, 1.0), 0.3])
    assert digest([one, 0.1 + 0.2]) != digest([one, 0.3])
