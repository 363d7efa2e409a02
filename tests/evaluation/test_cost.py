"""What a study will cost is said before it begins."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from pushplan.cli import main
from pushplan.evaluation import Experiment
from pushplan.evaluation.experiment import EPISODE_BYTES
from pushplan.evaluation.run.job_identity import identified
from pushplan.evaluation.store.rows import Status, blank_row
from pushplan.evaluation.store.run_directory import RunDirectory

DATA = {
    "schema": "pushplan-experiment/1",
    "suites": ["maze-2d-3", "maze-2d-5"],
    "policies": ["straight", "random"],
    "episodes": 3,
    "timeout_s": 60,
}


def store(folder: Path, experiment: Experiment, chosen: list[int], seconds: list[float]) -> None:
    """Results of some of the jobs, as if they had taken so long."""
    jobs = identified(experiment.jobs, experiment.settings)
    with RunDirectory(folder) as run:
        for place, time in zip(chosen, seconds, strict=True):
            row = blank_row(jobs[place].policy.label, jobs[place].scenario, Status.DONE, "goal")
            run.add(replace(row, job=jobs[place].id or "", wall_time_s=time), bytes(1000))


def test_in_a_new_folder_the_limit_of_time_is_known(tmp_path: Path) -> None:
    cost = Experiment.from_dict(DATA).cost(tmp_path / "new" / "run", workers=2)
    assert (cost.jobs, cost.new, cost.seconds, cost.stored) == (12, 12, None, 0)
    assert cost.most_s == 12 * 60.0 / 2
    assert cost.size == 12 * EPISODE_BYTES and cost.free > 0
    assert not (tmp_path / "new").exists()
    part = Experiment.from_dict(DATA).cost(tmp_path, workers=1, shard=(1, 2))
    assert 0 < part.jobs < 12
    unkept = Experiment.from_dict({**DATA, "traces": "none"}).cost(tmp_path, workers=0)
    assert unkept.size == 0.0


def test_stored_episodes_tell_the_time_of_their_policy_and_setting(tmp_path: Path) -> None:
    experiment = Experiment.from_dict(DATA)
    # straight in maze-2d-3: two of three; in maze-2d-5: one; random: one in maze-2d-3
    store(tmp_path, experiment, [0, 2, 6, 1], [1.0, 3.0, 10.0, 0.5])
    cost = experiment.cost(tmp_path, workers=2)
    assert (cost.new, cost.stored, cost.size) == (8, 4, 8 * 1000.0)
    straight = 2.0 + 2 * 10.0
    assert cost.seconds == pytest.approx((straight + 5 * 0.5) / 2)
    other = Experiment.from_dict({**DATA, "policies": ["other=straight"]})
    assert other.cost(tmp_path, workers=1).seconds == pytest.approx(6 * 14.5 / 4)


def test_what_is_done_costs_nothing(tmp_path: Path) -> None:
    experiment = Experiment.from_dict({**DATA, "suites": ["maze-2d-3"], "episodes": 1})
    store(tmp_path, experiment, [0, 1], [1.0, 1.0])
    cost = experiment.cost(tmp_path, workers=2)
    assert (cost.jobs, cost.new, cost.seconds, cost.size) == (2, 0, 0.0, 0.0)


def test_a_check_says_the_cost_and_runs_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    command = ["bench", "maze-2d-3", "--policies", "straight", "--episodes", "4", "--workers", "2"]
    assert main([*command, "--out", str(out), "--check"]) == 0
    said = capsys.readouterr().out
    assert "4 jobs, 4 to run on 2 workers" in said and "at most 10 min" in said
    assert "about 0.08 MB" in said and "free" in said
    assert not out.exists()
