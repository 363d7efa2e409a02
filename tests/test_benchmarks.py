"""Benchmarks are listed, answer --help, and are named on the page that shows their figures."""

from __future__ import annotations

import re
import runpy
import sys
from pathlib import Path

import pytest

from pushplan.interaction import QuasiStatic
from pushplan.planners.arguments import check_pusher
from pushplan.world import Movables, Receptacle, StaticMap, World, area_clearing_robot

ROOT = Path(__file__).parents[1]
BENCHMARKS = ROOT / "benchmarks"
INDEX = (BENCHMARKS / "README.md").read_text(encoding="utf-8")
LINES = re.findall(r"^\| .+ \| `(.+?)` \| \d+ \| (.+) \|$", INDEX, re.MULTILINE)
SUBJECTS = [command.split()[2] for command, _ in LINES]
MODULES = [subject for subject in SUBJECTS if not subject.endswith(".yaml")]


def test_the_index_lists_every_benchmark() -> None:
    modules = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts)
        for path in BENCHMARKS.rglob("*.py")
        if "command_line(" in path.read_text() and path.stem != "reporting"
    }
    studies = {
        path.relative_to(ROOT).as_posix()
        for path in BENCHMARKS.rglob("*.yaml")
        if "schema: pushplan-experiment/1" in path.read_text()
    }
    assert sorted(SUBJECTS) == sorted(modules | studies)


@pytest.mark.parametrize("name", MODULES)
def test_help_says_what_a_benchmark_measures(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", [name, "--help"])
    monkeypatch.setattr(sys, "path", list(sys.path))
    with pytest.raises(SystemExit) as ended:
        runpy.run_module(name, run_name="__main__")
    assert ended.value.code == 0
    assert f"python -m {name}" in capsys.readouterr().out


def test_the_pages_of_the_index_name_the_command() -> None:
    for (_, pages), subject in zip(LINES, SUBJECTS, strict=True):
        for page in re.findall(r"\]\((.+?)\)", pages):
            assert subject in (BENCHMARKS / page).read_text(encoding="utf-8"), page


def test_a_call_path_stays_in_the_files_whose_functions_get_the_world() -> None:
    from benchmarks.accuracy.call_path import CallPath

    square = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
    world = World(
        robot=area_clearing_robot(),
        robot_pose=(-1.25, 0.0, 0.0),
        static=StaticMap.build(bounds=(-9.0, -9.0, 9.0, 9.0)),
        movables=Movables.from_outlines([square], [(0.0, 0.0, 0.2)]),
        goal=Receptacle([(4.5, 4.5), (5.5, 4.5), (5.5, 5.5), (4.5, 5.5)]),
    )
    path = CallPath()
    sys.setprofile(path)
    for _ in range(2):
        check_pusher(world)
        check_pusher(world)
        QuasiStatic().bodies(world)
        world.movables.outline_world(0)
    sys.setprofile(None)
    assert path.stays == [
        "planners/arguments.py",
        "interaction/quasi_static.py",
    ]
