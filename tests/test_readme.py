"""Every code block of the README runs as it stands, or at a reduced size where it is slow."""

from __future__ import annotations

import csv
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from pushplan.planners import Deadline, make_planner
from pushplan.world import load_world

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text("utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
PYTHON = [text for kind, text in BLOCKS if kind == "python"]
BENCHES = [
    line.removeprefix('pip install -e ".[sim,plots]" && ')
    for kind, text in BLOCKS
    if kind == "bash"
    for line in text.splitlines()
    if "pushplan bench" in line
]


def block(word: str) -> str:
    """The one Python block with this word."""
    found = [text for text in PYTHON if word in text]
    assert len(found) == 1
    return found[0]


def reduced(text: str) -> str:
    """The same with two episodes in one worker, as each takes seconds to start."""
    text = re.sub(r"(episodes[ =])20", r"\g<1>2", text)
    return re.sub(r"(workers[ =])2", r"\g<1>1", text)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with what the README speaks of."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    (tmp_path / "my_planner.py").write_text(block("# my_planner.py"))
    return tmp_path


def run_script(text: str, folder: Path) -> str:
    (folder / "script.py").write_text(text)
    return run(["script.py"], folder)


def run(arguments: list[str], folder: Path) -> str:
    done = subprocess.run(
        [sys.executable, *arguments], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_commands_are_where_ci_looks_for_them() -> None:
    """`.ci/run` takes the first two blocks of commands."""
    first, second = [text for kind, text in BLOCKS if kind == "bash"][:2]
    assert first.startswith('pip install -e ".[sim,plots]" && pushplan bench ')
    assert second.startswith('pip install -e ".[test]" && pytest')
    assert len(BENCHES) == 2 and len(PYTHON) == 4


@pytest.mark.parametrize(
    ("at", "size"),
    [
        pytest.param(0, reduced, marks=pytest.mark.slow),
        pytest.param(1, str, marks=pytest.mark.slow),
    ],
    ids=["first-reduced", "own-whole"],
)
def test_a_bench_runs(at, size, folder) -> None:
    arguments = size(BENCHES[at]).split()
    text = run(["-m", *arguments], folder)
    out = folder / arguments[arguments.index("--out") + 1]
    for policy in arguments[arguments.index("--policies") + 1].split(","):
        assert policy.split(":")[-1] in text
    episodes = int(arguments[arguments.index("--episodes") + 1])
    rows = (out / "results.csv").read_text().splitlines()
    assert len(rows) == 1 + episodes * (arguments[4].count(",") + 1)
    assert (out / "report.html").exists() and (out / "tradeoff.svg").exists()
    if at == 1:  # the reader's own planner arrives too, and has measured its time
        table = [row for row in csv.DictReader(rows) if row["policy"] == "AroundWalls"]
        assert all(row["reason"] == "goal" for row in table)
        assert all(float(row["plan_time_median_s"]) > 0.0 for row in table)


@pytest.mark.slow
def test_five_lines_of_python_run(folder) -> None:
    text = reduced(block("import bench"))
    assert "kinodynamic-rrt" in run_script(text, folder)
    (out,) = re.findall(r'report\("(.*)"\)', text)
    assert (folder / out / "report.html").exists()
    assert not any(f"--out {out}" in line for line in BENCHES)  # none overwrites another's run


def test_a_room_is_planned_in(folder, monkeypatch, capsys) -> None:
    monkeypatch.chdir(folder)
    exec(block("load_world"), {"__name__": "__main__"})
    assert capsys.readouterr().out.startswith("solved")


def test_an_environment_takes_a_step() -> None:
    found: dict[str, object] = {}
    exec(block("import gymnasium"), found)
    assert found["terminated"] is False and found["reward"] != 0.0


@pytest.mark.usefixtures("cpu_time")
def test_its_deadline_holds() -> None:
    (seconds,) = re.findall(r"Deadline\((.*?)\)", block("load_world"))
    (name,) = re.findall(r'make_planner\("(.*?)"\)', block("load_world"))
    world, planner = load_world(ROOT / "examples" / "room.yaml"), make_planner(name)
    results = [planner.plan(world, stop=Deadline(float(seconds))) for _ in range(5)]
    assert {result.status.label for result in results} == {"solved"}


def test_the_page_about_world_files_shows_the_room() -> None:
    page = (ROOT / "docs" / "world-file.md").read_text("utf-8")
    (shown,) = re.findall(r"```yaml\n(schema.*?)```", page, re.DOTALL)
    room = (ROOT / "examples" / "room.yaml").read_text("utf-8")
    assert yaml.safe_load(shown) == yaml.safe_load(room)
    assert shown in room
