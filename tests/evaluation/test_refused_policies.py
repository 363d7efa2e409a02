"""Policies that are refused before anything runs, decision times, rows of earlier versions."""

from __future__ import annotations

import json
import sqlite3
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from pushplan.cli import main
from pushplan.envs import PushEnv
from pushplan.evaluation import (
    Experiment,
    JobSettings,
    Results,
    UnusablePolicyError,
    bench,
    parse_policies,
)
from pushplan.evaluation.run.compatibility import incompatibility
from pushplan.evaluation.run.policy_specs import PolicySpec
from pushplan.learned.loading import weights_of
from pushplan.learned.onnx_policy import read_specification
from pushplan.scenarios import suite

MINE = """
class Broken:
    def __init__(self):
        raise ValueError("no weights")

class Neither:
    pass

class Stop:
    actions = ("nonsense",)
    def reset(self, world, rng):
        pass
    def act(self, world, observation):
        return [0.0]
"""


def test_the_time_of_a_decision_holds_the_observation_and_no_simulation(tmp_path: Path) -> None:
    results = bench("maze-2d-3", ["straight", "maze-ppo"], episodes=1, workers=0, out=tmp_path)
    for row in results.rows:
        assert row.decision_time_median_s is not None and row.decision_time_mean_s is not None
        assert row.decision_time_max_s is not None and row.steps is not None
        assert 0.0 < row.decision_time_median_s <= row.decision_time_max_s
        assert row.decision_time_mean_s * row.steps < (row.wall_time_s or 0.0)
    network = next(row for row in results.rows if row.policy == "maze-ppo")
    # four steps to a decision: those that repeat it cost next to nothing, and are not in the median
    assert network.decision_time_median_s is not None and network.decision_time_mean_s is not None
    assert network.decision_time_median_s > 30e-6


@pytest.mark.parametrize(
    ("name", "suite_name", "said"),
    [
        ("greedy", "maze-2d-3", "goal for the objects"),
        ("straight", "area-clearing-2d-10", "goal for the robot"),
        ("gtsp-mpc", "ship-ice-2d-10", "velocity"),
        ("maze-ppo", "ship-ice-2d-10", "made for task maze"),
        ("maze-ppo", "maze-3d-3", "made for preset benchmark"),
        ("mine.py:Broken", "maze-2d-3", "ValueError: no weights"),
        ("mine.py:Neither", "maze-2d-3", "neither the methods"),
        ("mine.py:Missing", "maze-2d-3", "Missing"),
        ("mine.py:Stop", "maze-2d-3", "nonsense"),
        ("gone.py:Stop", "maze-2d-3", "no file"),
        ("onnx:gone", "maze-2d-3", "there is no file gone"),
        ("onnx:mine.py", "maze-2d-3", "mine.py"),
        ("sb3:model", "maze-2d-3", "trust"),
    ],
)
def test_what_cannot_run_is_refused_before_anything_runs(
    name: str,
    suite_name: str,
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PUSHPLAN_TRUST_PICKLES", raising=False)
    Path("mine.py").write_text(MINE)
    _untrusted_model(Path("model.zip"))
    assert main(["bench", suite_name, "--policies", name, "--episodes", "2"]) == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1, error
    assert not Path("runs").exists()


def test_a_policy_has_to_suit_one_start_of_a_mixed_suite() -> None:
    results = bench("smoke", ["straight"], episodes=1, workers=0)
    assert len(results.rows) == 1
    starts = suite("smoke").scenarios
    spec = PolicySpec("gtsp", "gtsp")
    fits = [incompatibility(spec, start, JobSettings()) is None for start in starts]
    assert fits == [start.task in ("box_delivery", "area_clearing") for start in starts]


def test_a_check_makes_the_bodies_of_a_start_once_for_each_action_mode(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = []
    reset = PushEnv.reset

    def counted(env: PushEnv, **options: Any) -> Any:
        made.append(env.action_mode)
        return reset(env, **options)

    monkeypatch.setattr(PushEnv, "reset", counted)
    policies = parse_policies("straight,namo,kinodynamic-rrt,maze-ppo,greedy")
    study = Experiment("few", (suite("maze-2d-3", episodes=9),), tuple(policies[:4]))
    assert not study.skipped and len(made) == len(set(made)) <= 2
    with pytest.raises(UnusablePolicyError, match="'greedy' cannot run maze"):
        Experiment("few", study.suites, tuple(policies))


def test_rows_of_an_earlier_version_can_be_read_and_continued(tmp_path: Path) -> None:
    first = bench("maze-2d-3", ["straight"], episodes=1, workers=0, out=tmp_path)
    with sqlite3.connect(tmp_path / "results.db") as db:
        db.execute("ALTER TABLE results DROP COLUMN decision_time_max_s")
    (old,) = Results.load(tmp_path).rows
    assert old == replace(first.rows[0], decision_time_max_s=None)
    both = bench("maze-2d-3", ["straight"], episodes=2, workers=0, out=tmp_path)
    assert [row.decision_time_max_s is None for row in both.rows] == [True, False]


def _untrusted_model(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("data", json.dumps({}))
    specification = read_specification(weights_of("maze-ppo"))
    path.with_suffix(".pushplan.json").write_text(specification.to_json())
