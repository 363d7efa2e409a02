"""Experiment files: read at once and completely, run, continued, and refused in one line."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import pytest
import yaml

from pushplan.cli import main
from pushplan.evaluation import Experiment, UnusablePolicyError, bench
from pushplan.planners import make_planner, make_policy
from pushplan.world import InvalidInputError, PushplanError, SchemaError, UnknownNameError

METRIC = '''
def turns(episode):
    """How often a step was taken."""
    return float(len(episode.times) - 1)
'''
STUDY: dict[str, Any] = {
    "schema": "pushplan-experiment/1",
    "suites": ["maze-2d-3", {"suite": "maze-2d-5", "episodes": 2, "seed": 40}],
    "policies": [
        "straight",
        {"policy": "straight", "label": "s", "sweep": {"spacing": [0.1, 0.5]}},
    ],
    "episodes": 1,
    "metrics": ["my.py:turns", "steps"],
}


@pytest.fixture
def study(tmp_path: Path) -> Path:
    (tmp_path / "my.py").write_text(METRIC)
    path = tmp_path / "study.yaml"
    path.write_text(yaml.safe_dump(STUDY))
    return path


def test_every_policy_meets_every_scenario(study: Path) -> None:
    experiment = Experiment.load(study)
    labels = ["straight", "s@spacing-0.1", "s@spacing-0.5"]
    assert [spec.label for spec in experiment.policies] == labels
    assert [spec.make().planner.spacing for spec in experiment.policies[1:]] == [0.1, 0.5]
    seeds = [(job.policy.label, job.scenario.seed) for job in experiment.jobs]
    assert seeds == [(label, seed) for seed in (0, 40, 41) for label in labels]
    assert Experiment.from_dict(STUDY, study.parent).jobs == experiment.jobs


@pytest.mark.usefixtures("empty_figures")
def test_a_study_runs_from_the_command_line_and_goes_on(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study.write_text(yaml.safe_dump({**STUDY, "suites": ["maze-2d-3"]}))
    out = tmp_path / "run"
    command = ["experiment", str(study), "--workers", "0", "--out", str(out)]
    assert main([*command, "--check"]) == 0
    assert "3 jobs" in capsys.readouterr().out and not out.exists()
    assert main(command) == 0
    said = capsys.readouterr().out
    assert "my.py:turns" in said and "report.html" in said
    study.write_text(yaml.safe_dump({**STUDY, "suites": ["maze-2d-3"], "episodes": 2}))
    results = Experiment.load(study).run(out, workers=0)
    assert len(results.rows) == 6
    alone = Experiment.load(study).run(workers=0)
    assert [(r.policy, r.seed, r.E_nav) for r in alone.rows] == [
        (r.policy, r.seed, r.E_nav) for r in results.rows
    ]


def changed(**entries: Any) -> dict[str, Any]:
    return {**copy.deepcopy(STUDY), **entries}


@pytest.mark.parametrize(
    ("data", "kind", "words"),
    [
        ([], SchemaError, "must be a mapping"),
        (changed(schema="pushplan-experiment/9"), SchemaError, "pushplan-experiment/1"),
        (changed(extra=1), SchemaError, "unknown key in experiment 'extra'"),
        (changed(suites=[]), SchemaError, "at least one entry"),
        (changed(suites=["maze-2d-4"]), UnknownNameError, "maze-2d-3"),
        (changed(suites=[{"suite": "smoke", "scenarios": "x"}]), SchemaError, "either 'suite'"),
        (changed(suites=[{"scenarios": "gone.yaml"}]), SchemaError, "gone.yaml"),
        (changed(suites=[3]), SchemaError, "suite must be a mapping"),
        (changed(policies=["stright"]), UnknownNameError, "straight"),
        (changed(policies=["straight", "straight"]), InvalidInputError, "label=policy"),
        (changed(policies=[{"policy": "gtsp-mpc"}]), UnusablePolicyError, "cannot run maze"),
        (
            changed(policies=[{"policy": "straight", "parameters": {"spacin": 1}}]),
            UnusablePolicyError,
            "spacing",
        ),
        (
            changed(policies=[{"policy": "straight", "parameters": {"spacing": -1}}]),
            UnusablePolicyError,
            "spacing",
        ),
        (
            changed(policies=[{"policy": "straight", "sweep": {"spacing": list(range(2000))}}]),
            SchemaError,
            "1000 policies",
        ),
        (changed(policies=[{"policy": "straight", "sweep": {"spacing": 1}}]), SchemaError, "list"),
        (changed(metrics=["stps"]), UnknownNameError, "steps"),
        (changed(metrics=["my.py:gone"]), InvalidInputError, "gone"),
        (changed(metrics="steps"), SchemaError, "list of texts"),
        (changed(episodes=0), InvalidInputError, "at least 1"),
        (changed(episodes=float("nan")), InvalidInputError, "episodes"),
        (changed(timeout_s=-1), InvalidInputError, "timeout_s"),
    ],
)
def test_what_is_wrong_is_said_before_anything_runs(
    data: Any, kind: type[PushplanError], words: str, study: Path, capsys: Any
) -> None:
    with pytest.raises(kind, match=words):
        Experiment.from_dict(data, study.parent)
    study.write_text(yaml.safe_dump(data))
    assert main(["experiment", str(study), "--check"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_a_policy_that_fits_some_suites_runs_there(study: Path) -> None:
    data = changed(suites=["maze-2d-3", "ship-ice-2d-20"], policies=["straight", "gtsp-mpc"])
    data["suites"].append("area-clearing-2d-10")
    experiment = Experiment.from_dict(data, study.parent)
    assert {("maze-2d-3", "gtsp-mpc"), ("ship-ice-2d-20", "gtsp-mpc")} <= set(experiment.skipped)
    assert ("area-clearing-2d-10", "gtsp-mpc") not in experiment.skipped
    assert len(experiment.jobs) == 6 - len(experiment.skipped)


def test_a_policy_takes_fields_of_its_planners_config() -> None:
    assert make_policy("push-aware", push_weight=2.0).planner.config.push_weight == 2.0
    assert make_planner("push-aware", push_weight=2.0).config.push_weight == 2.0
    with pytest.raises(UnknownNameError, match="push_weight"):
        make_policy("push-aware", push_wight=2.0)


def test_bench_takes_several_suites() -> None:
    found = bench("maze-2d-3, maze-2d-5", "straight", episodes=2, seed=1000, workers=0)
    assert len(found.rows) == 4 and found.about["configuration"]["suite"] == "maze-2d-3,maze-2d-5"


def test_a_suite_may_name_its_policies() -> None:
    data = {
        "schema": "pushplan-experiment/1",
        "suites": ["maze-2d-3", {"suite": "maze-2d-5", "policies": ["random"]}],
        "policies": ["straight", "random"],
        "episodes": 1,
    }
    jobs = Experiment.from_dict(data).jobs
    assert [job.policy.label for job in jobs] == ["straight", "random", "random"]
    data["suites"] = [{"suite": "maze-2d-5", "policies": ["randon"]}]
    with pytest.raises(UnknownNameError, match="did you mean 'random'"):
        Experiment.from_dict(data)


def test_only_what_was_asked_for_is_left_out() -> None:
    data = {
        "schema": "pushplan-experiment/1",
        "suites": [
            {"suite": "maze-2d-3", "policies": ["straight"]},
            {"suite": "area-clearing-2d-10", "policies": ["gtsp"]},
        ],
        "policies": ["straight", "gtsp"],
        "episodes": 1,
    }
    experiment = Experiment.from_dict(data)
    assert len(experiment.jobs) == 2 and not experiment.skipped
    data["suites"].pop()
    data["suites"].append({"suite": "maze-2d-5", "policies": ["gtsp"]})
    with pytest.raises(UnusablePolicyError, match="gtsp"):
        Experiment.from_dict(data)


@pytest.mark.usefixtures("empty_figures")
@pytest.mark.parametrize(
    ("traces", "kept"),
    [pytest.param("all", 2, marks=pytest.mark.slow), ("failures", 1), ("none", 0)],
)
def test_only_wanted_episodes_are_kept(tmp_path: Path, traces: str, kept: int) -> None:
    data = {
        "schema": "pushplan-experiment/1",
        "suites": ["maze-2d-3"],
        "policies": ["straight", "random"],
        "episodes": 1,
        "traces": traces,
    }
    results = Experiment.from_dict(data).run(tmp_path, workers=0)
    assert [row.success for row in results.rows] == [False, True]
    assert len(list((tmp_path / "episodes").iterdir())) == kept
    assert sum(results.episode(row) is not None for row in results.rows) == kept
    assert results.report().is_file()
    with pytest.raises(InvalidInputError, match="traces"):
        Experiment.from_dict({**data, "traces": "some"})
    with pytest.raises(InvalidInputError, match="misfits"):
        Experiment.from_dict({**data, "misfits": "some"})
