"""What a script and a newcomer rely on: codes, JSON, paths checked early, near names."""

from __future__ import annotations

import argparse
import csv
import json
import re
import sys
import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

from pushplan.cli import main
from pushplan.cli.doctor import BASE
from pushplan.cli.parser import build_parser
from pushplan.errors import unknown_name_message
from pushplan.imports.on_demand import EXTRAS

ROOM = str(Path(__file__).parents[2] / "examples" / "room.yaml")
USERS_MISTAKES = {
    "demo": [["--out", "FILE/demo"]],
    "describe": [["no-suite"], ["maze-2d-3", "--for", "/no/such/model.zip", "--algorithm", "ppo"]],
    "doctor": [["--yaml"]],
    "run": [["maze-2d-3", "--policy", "nobody"], ["no-suite", "--policy", "straight"]],
    "teleop": [["no-suite"], ["maze-2d-3", "--out", "/no/such/folder/episode.npz"]],
    "plan": [
        [ROOM, "--planner", "nobody"],
        [ROOM, "--planner", "straight", "--out", "/no/such/folder/plan.json"],
        [ROOM, "--planner", "straight", "--out", "FOLDER"],
        [ROOM, "--planner", "straight", "--render", "/no/such/folder/plan.png"],
        [ROOM, "--planner", "straight", "--render", "plan.bmp"],
    ],
    "bounds": [
        ["no-suite"],
        ["maze-2d-3", "--runs", "/no/such/folder", "--episodes", "1"],
        ["maze-2d-3", "--out", "/no/such/folder/bounds.csv"],
    ],
    "bench": [
        ["maze-2d-3", "--policies", "nobody"],
        ["maze-2d-3", "--policies", "straight", "--out", "FILE/run"],
        ["maze-2d-3"],
    ],
    "experiment": [["none.yaml"]],
    "stress": [["straight", "maze-2d-3", "--out", "FILE/run"]],
    "serve": [["nobody", "--socket", "unix:never-made"]],
    "list": [["things"]],
    "score": [["none.npz"], [ROOM], ["FOLDER"]],
    "identify": [["none.npz"], ["none.mcap"], ["FILE"], ["FOLDER"]],
    "report": [["FOLDER"]],
    "runs compare": [["FOLDER", "FOLDER"]],
    "runs status": [["FOLDER"]],
    "runs merge": [["FILE/run", "FOLDER"]],
    "runs rescore": [["FOLDER"]],
    "runs reproduce": [["FOLDER", "--job", "3f"]],
    "runs verify": [["FOLDER"], ["FOLDER", "--fraction", "0"]],
    "runs salvage": [["FOLDER", "FILE/new"]],
    "runs export": [["FOLDER", "rows.csv"], ["FOLDER", "/no/such/folder/rows.csv"]],
    "ice": [[], ["--concentration", "0.1", "--out", "/no/such/folder/field.json"]],
    "gtsp": [["none.gtsp"], ["none.gtsp", "--out", "/no/such/folder/tour"]],
    "train": [["ppo", "--task", "maze", "--out", "FILE/run"]],
    "dataset": [
        ["export", "--policy", "straight", "--task", "maze"],
        [*"export --policy straight --task maze --episodes 1 --out FILE/run".split()],
    ],
}


def commands(parser: argparse.ArgumentParser) -> set[str]:
    found = set()
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for name, one in action.choices.items():
                found |= {f"{name} {below}".rstrip() for below in commands(one) or [""]}
    return found


def test_every_command_is_here() -> None:
    assert set(USERS_MISTAKES) == commands(build_parser())


@pytest.mark.parametrize("command", sorted(USERS_MISTAKES))
def test_a_users_mistake_is_code_2_and_no_work_is_done(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "FILE").write_text("")
    (tmp_path / "FOLDER").mkdir()
    for given in USERS_MISTAKES[command]:
        arguments = [re.sub("^(FILE|FOLDER)", f"{tmp_path}/\\1", one) for one in given]
        assert main([*command.split(), *arguments]) == 2, given
        said = capsys.readouterr()
        assert said.out == ""
        assert said.err.splitlines()[-1].startswith("pushplan")
        assert "Traceback" not in said.err
    assert not list((tmp_path / "FOLDER").iterdir())


def test_an_old_spelling_works_with_a_warning(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["status", "/no/such/run"]) == 2
    first, second = capsys.readouterr().err.splitlines()
    assert first.startswith("pushplan: 'pushplan status' is now 'pushplan runs status'")
    assert main(["runs", "status", "/no/such/run"]) == 2
    assert capsys.readouterr().err.splitlines() == [second]


def test_a_failed_run_is_code_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "failing.py").write_text(
        "class Failing:\n    def reset(self, world, rng):\n        raise ValueError('no')\n"
        "    def act(self, world, observation):\n        pass\n"
    )
    policy = f"{tmp_path}/failing.py:Failing"
    assert main(["run", "maze-2d-3", "--policy", policy]) == 1
    capsys.readouterr()
    options = ["--episodes", "1", "--workers", "0", "--out", str(tmp_path / "run"), "--json"]
    assert main(["bench", "maze-2d-3", "--policies", f"bad={policy},straight", *options]) == 1
    said = capsys.readouterr()
    assert "bad: 1 of 1 failed: ValueError: no (failing.py:3); traceback: " in said.err
    bad, straight = json.loads(said.out)["policies"]
    assert (bad["policy"], bad["failed"], straight["failed"]) == ("bad", 1, 0)
    assert straight["success"]["fraction"] == 1.0 and straight["metrics"]["E_nav"]["count"] == 1
    assert main(["plan", ROOM, "--planner", "kinodynamic-rrt", "--iterations", "1"]) in (0, 1)


def test_the_codes_are_documented(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    text = capsys.readouterr().out
    for code in ("0", "1", "2", "130"):
        assert re.search(rf"^  {code} +\w", text.partition("exit codes:")[2], re.MULTILINE)


def test_list_alone_says_what_can_be_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list"]) == 0
    *lines, hint = capsys.readouterr().out.splitlines()
    assert "'pushplan list KIND'" in hint
    for line in lines:
        kind, count, *what = line.split()
        assert what
        assert main(["list", kind, "--names"]) == 0
        assert len(capsys.readouterr().out.splitlines()) == int(count)
        assert main(["list", kind, "--json"]) == 0
        listed = json.loads(capsys.readouterr().out)
        assert len(listed) == int(count)
        assert all(len(one) > 2 and all(one.values()) for one in listed)


def test_what_a_machine_reads_is_json_on_demand() -> None:
    text = files("pushplan.cli").joinpath("commands.toml").read_text("utf-8")
    commands = {key: one for key, one in tomllib.loads(text).items() if key != "shared"}
    commands |= {f"runs {key}": one for key, one in commands.pop("runs")["commands"].items()}
    without = {key for key, one in commands.items() if "'json'" not in str(one)}
    # a page, a window, files and a socket; `describe` prints JSON alone
    writers = {"demo", "teleop", "train", "dataset", "runs export", "serve"}
    assert without == {*writers, "describe"}


@pytest.mark.slow
@pytest.mark.usefixtures("empty_figures")
def test_commands_print_one_json_value_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)

    def result(*arguments: str) -> Any:
        assert main([*arguments, "--json"]) == 0
        return json.loads(capsys.readouterr().out)

    one = ["--policy", "straight", "--render", "end.png", "--out", "episode.npz"]
    row = result("run", "maze-2d-3", *one)
    assert row["policy"] == "straight" and row["success"] is True
    assert main(["bench", "maze-2d-3", "--policies", "straight", "--episodes", "1"]) == 0
    capsys.readouterr()
    with open("runs/maze-2d-3/results.csv", encoding="utf-8") as file:
        (stored,) = csv.DictReader(file)
    assert [*row] == [*stored] and f"{row['E_nav']}" == stored["E_nav"]
    Path("study.yaml").write_text(
        "schema: pushplan-experiment/1\nepisodes: 1\nsuites: [maze-2d-3, area-clearing-2d-10]\n"
        "policies: [straight, greedy]\n"
    )
    assert result("experiment", "study.yaml", "--check")["new"] == 2
    assert result("report", "runs/maze-2d-3")["policies"][0]["policy"] == "straight"
    (table,) = result("report", "runs/maze-2d-3", "--metrics", "steps")
    assert "steps" in str(table)
    assert result("runs", "status", "runs/maze-2d-3")["done"] == 1
    assert result("runs", "rescore", "runs/maze-2d-3")["episodes"] == 1
    assert result("runs", "merge", "runs/both", "runs/maze-2d-3")["added"] == 1
    assert result("runs", "salvage", "runs/both", "runs/saved")["rows"] == 1
    assert result("runs", "reproduce", "runs/both", "--job", stored["job"])["same"] is True
    assert result("ice", "--concentration", "0.1", "--out", "field.json")["floes"] > 0
    stress = ["--conditions", "undisturbed", "--episodes", "1", "--workers", "0"]
    sheet = result("stress", "straight", "maze-3d-3", *stress)
    assert sheet["rows"][0]["condition"] == "undisturbed"


def test_plan_and_score_print_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "plan.json"
    assert main(["plan", ROOM, "--planner", "straight", "--json", "--out", str(out)]) == 0
    assert capsys.readouterr().out == out.read_text()
    episode = str(tmp_path / "episode.npz")
    assert main(["run", "maze-2d-3", "--policy", "straight", "--out", episode]) == 0
    capsys.readouterr()
    assert main(["score", episode, "--json"]) == 0
    (scored,) = json.loads(capsys.readouterr().out)
    assert scored["episode"] == episode and scored["success"] is True
    assert 0.0 < scored["metrics"]["E_nav"] <= 1.0


def test_score_says_what_another_file_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    field = str(tmp_path / "field.npz")
    assert main(["ice", "--concentration", "0.05", "--out", field]) == 0
    for path, said in ((ROOM, "it is no .npz archive"), (field, "it holds 'vertices', 'offsets'")):
        capsys.readouterr()
        assert main(["score", path]) == 2
        text = capsys.readouterr().err
        assert text.count("\n") == 1 and said in text


@pytest.mark.slow
def test_doctor(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    assert main(["doctor", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert set(found["libraries"]) == {*BASE, *EXTRAS}
    monkeypatch.setitem(sys.modules, "pymunk", None)
    monkeypatch.setattr(
        "pushplan.cli.doctor.find_spec", lambda name: None if name == "pymunk" else object()
    )
    assert main(["doctor"]) == 0
    assert "sim: missing pymunk; type: pip install 'pushplan[sim]'" in capsys.readouterr().out


@pytest.mark.parametrize("count", [5, 40])
def test_at_most_three_near_names(count: int) -> None:
    text = unknown_name_message("suite", "maze-9", [f"maze-{k}" for k in range(count)])
    nearest = text.partition("nearest of")[2]
    assert len(re.findall(r"maze-\d", nearest)) in (0, 3)


@pytest.mark.slow
def test_the_demo_shows_three_episodes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "demo"
    assert main(["demo", "--out", str(out)]) == 0
    text = capsys.readouterr().out
    assert text.count(": success") == 3 and f"page: {out / 'report.html'}" in text
    page = (out / "report.html").read_text(encoding="utf-8")
    assert page.count('<script type="application/json" class="replay">') == 3


def test_bounds_are_printed_and_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = str(tmp_path / "bounds.csv")
    assert main(["bounds", "maze-2d-3", "--episodes", "1", "--seed", "77", "--out", out]) == 0
    assert "bound 15." in capsys.readouterr().out
    assert main(["bounds", "maze-2d-3", "--episodes", "1", "--seed", "77", "--json"]) == 0
    (one,) = json.loads(capsys.readouterr().out)
    kept = (tmp_path / "bounds.csv").read_text()
    assert f"{one['scenario']},1,{one['bound']:.6g},," in kept
