"""Runs beside the tables of the Bench-Push paper."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType

import pytest

from pushplan.envs.registry import TASKS
from pushplan.evaluation import Experiment, bench
from pushplan.evaluation.run.policy_specs import policy_names
from pushplan.learned.loading import weights_of
from pushplan.scenarios import suite_names
from pushplan.world import InvalidInputError

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "bridges" / "bench_push" / "paper.py"


@pytest.fixture
def paper(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(SCRIPT.parent))
    return importlib.import_module("paper")


def test_the_papers_tables_are_as_printed(paper: ModuleType) -> None:
    tables = {table.suite: table for table in paper.published_tables()}
    assert set(tables) <= set(suite_names())
    ours = {"room", "office", "namo", "rearrange"}
    assert {table.task for table in tables.values()} == {*TASKS} - ours
    six = tables["maze-3d-6"]
    assert six.best("E_nav") == 0.853 and six.best("I_nav") == 0.981
    assert [row.episodes for row in six.rows] == [20, 20, 20, 3, 3, 3]
    delivery = tables["box-delivery-3d-5"]
    assert delivery.best("E_manip") == 0.243  # not the robot's 0.417
    assert delivery.best("I_manip") == 0.982  # not 0.994 of one that delivers a fifth
    assert tables["area-clearing-2d-10"].statistic == "median"
    for table in tables.values():
        for row in table.rows:
            assert row.scores and all(0.0 <= s.value <= 1.0 for s in row.scores.values())


@pytest.mark.slow
def test_the_experiment_has_every_suite_of_the_paper(paper: ModuleType) -> None:
    shipped = Experiment.load(ROOT / "examples" / "paper.yaml")
    assert [one.name for one in shipped.suites] == [t.suite for t in paper.published_tables()]
    assert {len(one.scenarios) for one in shipped.suites} == {100}
    assert [one.label for one in shipped.policies] == list(policy_names())
    assert shipped.skipped and shipped.jobs


def test_ours_beside_theirs(
    tmp_path: Path,
    paper: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    run, page = tmp_path / "run", tmp_path / "comparison.md"
    results = bench("maze-2d-3", ["straight", "maze-ppo"], episodes=1, workers=0, out=run)
    monkeypatch.setattr(sys, "argv", ["paper.py", str(run), "--markdown", str(page)])
    assert paper.main() == 0
    assert "RRT, legal actions" in capsys.readouterr().out
    lines = [line for line in page.read_text().splitlines() if line.startswith("| ")]
    ours = next(line for line in lines if line.startswith("| maze-ppo | 1 |"))
    assert "1.00<br>" in ours and ours.endswith("h |")
    short, table = paper.beside(results)
    assert short.cells == (("maze-2d-3", "mean", "E_nav 0.74, I_nav 0.946", "none"),)
    value = paper.to_goal_point(results)["straight", results.rows[0].scenario, 0]
    assert value == pytest.approx(1.066, abs=2e-3)  # docs/metrics.md
    (straight,) = (cells for cells in table.cells if cells[0] == "straight")
    assert "1.066" in straight[4]


def test_a_run_without_the_papers_suites_is_refused(
    tmp_path: Path,
    paper: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(sys, "argv", ["paper.py", str(tmp_path)])
    assert paper.main() == 2
    assert capsys.readouterr().err.count("\n") == 1
    with pytest.raises(InvalidInputError, match="no suite of the paper"):
        paper.beside(bench("maze-2d-6", ["straight"], episodes=1, workers=0))


def test_training_is_what_the_model_card_says(tmp_path: Path, paper: ModuleType) -> None:
    weights = weights_of("maze-ppo")
    assert paper.training_cost(weights).split("\n")[0].endswith("decisions")
    begun = paper.training_cost(weights_of("box-delivery-sam-testbed")).split("\n")
    assert len(begun) == 3 and begun[2] == "after box-delivery-sam"
    alone = tmp_path / "mine.onnx"
    alone.write_bytes(weights.read_bytes())
    assert paper.training_cost(alone).endswith("steps")
    other = tmp_path / "model.zip"
    other.write_bytes(b"")
    assert paper.training_cost(other) == "unknown"
    assert paper.training_of("straight") == paper.training_of("mine=of a user") == "none"
