"""The comparison with the Bench-Push paper, and policies that are refused before anything runs."""

from __future__ import annotations

import json
import sqlite3
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

from pushplan.cli import main
from pushplan.envs.registry import TASKS
from pushplan.evaluation import JobSettings, Results, UnusablePolicyError, bench, bench_paper
from pushplan.evaluation.compatibility import incompatibility
from pushplan.evaluation.paper_tables import training_cost
from pushplan.evaluation.policies import PolicySpec
from pushplan.evaluation.published import chosen_tables, published_tables
from pushplan.learned.loading import weights_of
from pushplan.learned.onnx_policy import read_specification
from pushplan.scenarios import suite, suite_names
from pushplan.world import InvalidInputError, UnknownNameError

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


def test_the_papers_tables_are_as_printed() -> None:
    tables = {table.suite: table for table in published_tables()}
    assert set(tables) <= set(suite_names())
    assert {table.task for table in tables.values()} == {*TASKS} - {"room", "namo"}
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


def test_suites_and_tasks_are_chosen_by_name() -> None:
    chosen = [table.suite for table in chosen_tables("ship_ice, maze-3d-3")]
    assert chosen == ["maze-3d-3", "ship-ice-2d-10-paper"]
    with pytest.raises(UnknownNameError, match="ship_ice"):
        chosen_tables("shipice")
    with pytest.raises(InvalidInputError):
        chosen_tables(",")


@pytest.mark.slow
def test_ours_beside_theirs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, page = tmp_path / "run", tmp_path / "comparison.md"
    command = ["bench", "paper", "--only", "maze-2d-3,maze-3d-3", "--episodes", "2"]
    command += ["--policies", "straight,maze-ppo", "--workers", "0", "--out", str(out)]
    assert main([*command, "--markdown", str(page)]) == 0
    printed = capsys.readouterr()
    assert "PPO (paper, physical robot)" in printed.out
    text = page.read_text()
    assert "- Made for other tasks or presets: maze-ppo." in text
    assert text == (out / "paper.md").read_text()
    lines = [line for line in text.splitlines() if line.startswith("| ")]
    assert "| PPO (paper) | 20 |  |  | 0.809 ± 0.186 | 0.985 ± 0.016 |  |  |" in lines
    ours = next(line for line in lines if line.startswith("| maze-ppo | 2 |"))
    assert "1.00<br>" in ours and ours.endswith("h |")
    assert "pushplan bench paper --only maze-2d-3,maze-3d-3" in text
    rows = Results.load(out).rows
    assert len(rows) == 6 and not any(row.failed for row in rows)
    # nothing is run twice, and more can be added
    before = (out / "results.csv").read_bytes()
    assert main(command) == 0
    assert (out / "results.csv").read_bytes() == before
    less = bench_paper(
        only="maze-2d-3", policies="straight", episodes=1, workers=0, out=out, timeout_s=300.0
    )
    assert len(less.results.rows) == 1
    short, table = less.tables()
    assert short.cells == (("maze-2d-3", "mean", "E_nav 0.74, I_nav 0.946", "none"),)
    (value,) = less.to_goal_point.values()
    assert value == pytest.approx(1.066, abs=2e-3)  # docs/metrics.md
    assert table.cells[-1][0] == "straight" and "1.066" in table.cells[-1][4]


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


def test_training_is_what_the_model_card_says(tmp_path: Path) -> None:
    weights = weights_of("maze-ppo")
    assert training_cost(weights).split("\n")[0].endswith("decisions")
    begun = training_cost(weights_of("box-delivery-sam-testbed")).split("\n")
    assert len(begun) == 3 and begun[2] == "after box-delivery-sam"
    alone = tmp_path / "mine.onnx"
    alone.write_bytes(weights.read_bytes())
    assert training_cost(alone).endswith("steps")
    other = tmp_path / "model.zip"
    other.write_bytes(b"")
    assert training_cost(other) == "unknown"


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


def test_bad_options_of_the_comparison(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("")
    paper = ["bench", "paper", "--policies", "straight", "--episodes", "1", "--workers", "0"]
    for options, code, said in (
        (["bench", "maze-2d-3"], 2, "--policies"),
        (["bench", "maze-2d-3", "--policies", "straight", "--only", "maze"], 2, "--only"),
        ([*paper, "--episodes", "0"], 2, "at least 1"),
        ([*paper, "--only", "mars"], 2, "unknown suite or task of the paper 'mars'"),
        ([*paper, "--only", "box_delivery"], 2, "cannot run box_delivery"),
        ([*paper, "--policies", "nope"], 2, "unknown policy 'nope'"),
        ([*paper, "--markdown", "."], 2, "is a folder"),
        ([*paper, "--latency", "1"], 2, "latency"),
        ([*paper, "--only", "maze-2d-3", "--out", "file"], 2, "file"),
        ([*paper, "--only", "maze-2d-3", "--markdown", "gone/a.md"], 2, "no folder gone"),
    ):
        assert main(options) == code, options
        assert said in capsys.readouterr().err
    with pytest.raises(UnusablePolicyError):
        bench_paper(only="box_delivery", policies="straight", episodes=1, workers=0)


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
