"""The commands that run episodes, on the real environment."""

from __future__ import annotations

import csv
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pushplan.cli import main
from pushplan.evaluation import TIMING_COLUMNS, Results, bench
from pushplan.world import Episode

MINE = """
import math, os, time
from pushplan.world import Twist

class Spin:
    def reset(self, world, rng):
        pass
    def act(self, world, observation):
        return Twist(0.1, 0.05)

class NotANumber(Spin):
    def act(self, world, observation):
        return [math.nan]

class Planless:
    def plan(self, world, *, stop=None, rng=None):
        raise ValueError("no plan today")

class Dies(Spin):
    def act(self, world, observation):
        os._exit(3)

class Hangs(Spin):
    def act(self, world, observation):
        time.sleep(1000.0)
"""


def without_timings(path: Path) -> list[list[str]]:
    with (path / "results.csv").open() as file:
        lines = list(csv.reader(file))
    keep = [i for i, name in enumerate(lines[0]) if name not in TIMING_COLUMNS]
    return [[line[i] for i in keep] for line in lines]


LIMITED = """
from pushplan.planners import make_planner
from pushplan.world import Twist

class Shown:
    def plan(self, world, *, stop=None, rng=None):
        print("limit", stop.seconds)
        return make_planner("straight").plan(world)

class Stands:
    def reset(self, world, rng):
        pass
    def act(self, world, observation):
        return Twist(0.0, 0.0)
"""


def test_a_deadline_limits_each_planning_call_of_what_plans(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("limited.py").write_text(LIMITED)
    task = ["--task", "maze", "--boxes", "1", "--set", "time_limit=2.0", "--deadline", "0.25"]
    assert main(["run", *task, "--policy", "limited.py:Shown"]) == 0
    assert "limit 0.25" in capsys.readouterr().out
    policies = "limited.py:Shown,limited.py:Stands,straight,push-aware"
    options = ["--episodes", "1", "--workers", "0", "--out", "run"]
    assert main(["bench", *task, "--policies", policies, *options]) == 0
    said = capsys.readouterr()
    assert "limit 0.25" in said.out
    assert "without a deadline, since they take none: Stands, straight\n" in said.err
    assert Results.load("run").about["deadlines"] == {"Shown": 0.25, "push-aware": 0.25}


def test_run_prints_scores_and_writes_what_was_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    episode, picture = tmp_path / "episode.npz", tmp_path / "path.png"
    options = ["--seed", "3", "--out", str(episode), "--render", str(picture)]
    assert main(["run", "maze-2d-3", "--policy", "straight", *options]) == 0
    text = capsys.readouterr().out
    assert "success" in text and "E_nav 0.9" in text and "planning: 1 calls" in text
    assert picture.read_bytes().startswith(b"\x89PNG")
    recorded = Episode.load(episode)
    assert recorded.success and recorded.about["seed"] == 3
    assert main(["score", str(episode)]) == 0
    assert "E_nav" in capsys.readouterr().out


@pytest.mark.slow
def test_run_takes_a_task_with_variations(tmp_path: Path) -> None:
    film = tmp_path / "film.gif"
    scene = ["--task", "maze", "--boxes", "2", "--shape", "z", "--set", "random_start=true"]
    assert main(["run", *scene, "--policy", "straight", "--render", str(film)]) == 0
    assert film.read_bytes().startswith(b"GIF8")


def test_run_refuses_what_does_not_go_together(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "--task", "maze", "--boxes", "900", "--policy", "straight"]) == 2
    assert main(["run", "smoke", "--boxes", "2", "--policy", "straight"]) == 2
    assert main(["run", "smoke", "--policy", "straight", "--render", "film.avi"]) == 2
    errors = capsys.readouterr().err
    assert errors.count("\n") == 3 and errors.count("pushplan: ") == 3


@pytest.mark.slow
def test_bench_with_a_file_of_ones_own(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine.py").write_text(MINE)
    classes = ("Spin", "NotANumber", "Dies", "Hangs")
    names = ",".join(["straight", *(f"{tmp_path}/mine.py:{name}" for name in classes)])
    names += f",planner={tmp_path}/mine.py:Planless"
    out = tmp_path / "run"
    options = ["--episodes", "2", "--workers", "2", "--out", str(out), "--seed", "5"]
    options += ["--timeout", "10"]
    assert main(["bench", "maze-2d-3", "--policies", names, *options]) == 1  # some jobs failed
    said = capsys.readouterr()
    text = said.out
    assert "Spin - straight" in text and str(out / "report.html") in text
    assert "Dies: 2 of 2 failed: the worker process exited with code 3; traceback: " in said.err
    assert "Hangs: 2 of 2 failed: not done after 10 s of wall-clock time; traceback: " in said.err
    rows = {(row.policy, row.seed): row for row in Results.load(out).rows}
    assert {seed for _, seed in rows} == {5, 6}
    assert rows["straight", 5].success and rows["straight", 5].plan_calls == 1
    assert rows["Spin", 5].status == "done" and not rows["Spin", 5].success
    assert rows["NotANumber", 5].status == "invalid_action"
    assert rows["planner", 6].reason == "ValueError: no plan today (mine.py:17)"
    assert main(["report", str(out)]) == 0
    assert main(["report", str(out), "--metrics", "E_nav_to_goal_point"]) == 0


@pytest.mark.slow
def test_the_same_from_python() -> None:
    results = bench("maze-2d-5", policies=["straight", "random"], episodes=2, workers=0)
    assert "straight" in results.table()
    assert len(results.compare()) > 0


@pytest.mark.slow
def test_a_killed_bench_continues_to_the_same_bytes(tmp_path: Path) -> None:
    whole, killed = tmp_path / "whole", tmp_path / "killed"

    def start(out: Path) -> subprocess.Popen[bytes]:
        command = ["bench", "maze-2d-5", "--policies", "straight,kinodynamic-rrt"]
        options = ["--episodes", "6", "--workers", "2", "--out", str(out)]
        return subprocess.Popen(
            [sys.executable, "-m", "pushplan", *command, *options],
            start_new_session=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    assert start(whole).wait(300) == 0
    process = start(killed)
    deadline = time.monotonic() + 120.0
    while len(list((killed / "episodes").glob("*.npz"))) < 5:
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.005)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    assert not (killed / "results.csv").exists()
    assert start(killed).wait(300) == 0
    assert without_timings(killed) == without_timings(whole)
    assert len(without_timings(killed)) == 1 + 12
