"""Gates: what changed from one run to another, judged with its noise in mind."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pushplan.cli import main
from pushplan.evaluation import ResultRow, compare_runs
from pushplan.evaluation.report.comparing import read_rules
from pushplan.evaluation.store.rows import rows_csv
from pushplan.world import InvalidInputError, PushplanError, UnknownNameError


def rows(shift: float = 0.0, slower: float = 1.0, seeds: range = range(30), noise: float = 0.0):
    rng = np.random.default_rng(len(seeds) + int(1e6 * abs(shift) + 1e3 * noise))
    base = np.random.default_rng(0).uniform(0.6, 0.9, 1000)
    return [
        ResultRow(
            policy="mine",
            task="maze",
            simulator="pymunk",
            scenario=f"maze-5-{seed}",
            seed=seed,
            status="done",
            reason="goal",
            success=True,
            metrics={"E_nav": float(np.clip(base[seed] + shift + rng.normal(0, noise), 0, 1))},
            plan_time_median_s=0.01 * slower * (1.0 + base[seed]),
            job=str(seed),
        )
        for seed in seeds
    ]


def write(path: Path, found: list[ResultRow]) -> Path:
    path.write_text(rows_csv(found))
    return path


@pytest.fixture
def old(tmp_path: Path) -> Path:
    return write(tmp_path / "old.csv", rows())


@pytest.mark.parametrize(
    ("change", "rule", "verdict"),
    [
        ({}, "E_nav<-0.01", "ok"),
        ({"shift": -0.05, "noise": 0.01}, "E_nav<-0.01", "regressed"),
        ({"shift": -0.05, "noise": 0.01}, "E_nav<-0.2", "ok"),
        ({"shift": -0.01, "noise": 0.05}, "E_nav<-0.01", "unclear"),
        ({"shift": 0.05, "noise": 0.01}, "E_nav<-0.01", "ok"),
        ({"slower": 1.5}, "plan_time>+20%", "regressed"),
        ({"slower": 1.1}, "plan_time>+20%", "ok"),
        ({"slower": 0.5}, "plan_time_median_s>0.001", "ok"),
        ({"seeds": range(5), "shift": -0.05}, "E_nav<-0.01", "unclear"),
        ({"seeds": range(100, 140), "shift": -0.3, "noise": 0.01}, "E_nav<-0.1", "regressed"),
        ({"seeds": range(100, 140)}, "E_nav<-0.2", "ok"),
    ],
)
def test_a_verdict_needs_the_whole_interval(
    old: Path, tmp_path: Path, change: dict[str, float], rule: str, verdict: str
) -> None:
    new = write(tmp_path / "new.csv", rows(**change))
    (found,) = compare_runs(old, new, rule)
    assert found.verdict == verdict, found
    assert found.low <= found.change <= found.high
    assert found.paired == (change.get("seeds", range(30)).start == 0)
    code = main(["runs", "compare", str(old), str(new), "--fail-on", rule])
    assert code == (1 if verdict == "regressed" else 0)
    strict = main(["runs", "compare", str(old), str(new), "--fail-on", rule, "--strict"])
    assert strict == (0 if verdict == "ok" else 1)


def test_a_policy_that_is_gone_closes_the_gate(old: Path, tmp_path: Path) -> None:
    new = write(tmp_path / "new.csv", [replace(row, policy="other") for row in rows()])
    (found,) = compare_runs(old, new, "E_nav<-0.01")
    assert found.verdict == "missing" and math.isnan(found.new)
    assert main(["runs", "compare", str(old), str(new), "--fail-on", "E_nav<-0.01"]) == 1
    assert main(["runs", "compare", str(old), str(new)]) == 0


def test_json_is_json(old: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    new = write(tmp_path / "new.csv", [replace(row, policy="other") for row in rows()])
    main(["runs", "compare", str(old), str(new), "--fail-on", "E_nav<-0.01", "--json"])
    (found,) = json.loads(capsys.readouterr().out)
    assert found["rule"] == "E_nav<-0.01" and found["new"] is None


def test_rules_that_are_none(old: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for text in ("E_nav", "E_nav=3", "E_nav<", "E_nav<1.2.3", "", "E_nav<-0.01,,"):
        with pytest.raises(InvalidInputError, match="rule"):
            read_rules(text)
    with pytest.raises(UnknownNameError, match="did you mean 'E_nav'"):
        read_rules("E_nab<0.1")
    with pytest.raises(PushplanError):
        compare_runs(old, old.parent / "none.csv", "E_nav<0")
    (old.parent / "bad.csv").write_text("a,b\n1,2\n")
    assert main(["runs", "compare", str(old), str(old.parent / "bad.csv")]) == 2
    assert "no results.csv" in capsys.readouterr().err
    with pytest.raises(InvalidInputError, match="nothing can be compared"):
        compare_runs(old, old, "S_manip<0")
