"""Options by which a scenario is chosen, and files that cannot be written."""

from __future__ import annotations

from pathlib import Path

import pytest

from pushplan.cli import main
from pushplan.cli.parser import build_parser

RUN = ["run", "--task", "box_delivery", "--policy", "random"]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--set", "wheeled=["], "cannot read '[' of --set 'wheeled'"),
        (["--set", "wheeled=*x"], "cannot read '*x' of --set"),
        (["--set", "wheeled"], "--set takes NAME=VALUE"),
        (["--set", "boxes=3", "--boxes", "4"], "variation 'boxes' is given twice"),
        (["--set", "box_size=1e-9"], "box_size must be at least 0.0044 m"),
        (["--set", "box_size=1e999"], "a finite number"),
        (["--out", "/no/such/folder/episode.npz"], "there is no folder"),
        (["--render", "/no/such/folder/episode.gif"], "there is no folder"),
    ],
)
def test_one_line_says_what_is_wrong(
    arguments: list[str], text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*RUN, *arguments]) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1
    assert said.err.startswith("pushplan: ") and text in said.err


def test_any_observation_of_the_task_can_be_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "episode.npz"
    arguments = ["run", "--task", "maze", "--policy", "random", "--set", "box_size=5e-1"]
    assert main([*arguments, "--observation", "image", "--out", str(out)]) == 0
    assert out.exists()
    assert main([*RUN, "--observation", "spatal"]) == 2
    assert "valid: image, lidar, spatial, state" in capsys.readouterr().err


@pytest.mark.parametrize("command", [["run", "--policy"], ["bench", "--policies"]])
@pytest.mark.parametrize(
    "more", [["--simulator", "mujoco"], ["--preset", "testbed"], ["--robot", "jackal"]]
)
def test_a_suite_takes_nothing_that_only_a_task_has(
    command: list[str], more: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*command, "straight", "maze-2d-3", *more]) == 2
    assert f"{more[0][2:]} needs --task instead" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["--policy", "--policies"])
def test_policies_are_given_by_one_option_of_two_spellings(name: str) -> None:
    parser = build_parser()
    assert parser.parse_args(["run", "maze-2d-3", name, "straight"]).policy == "straight"
    assert parser.parse_args(["bench", "maze-2d-3", name, "straight,namo"]).policies == (
        "straight,namo"
    )
    export = ["dataset", "export", "--task", "maze", "--episodes", "1", "--out", "few"]
    assert parser.parse_args([*export, name, "straight"]).policy == "straight"
