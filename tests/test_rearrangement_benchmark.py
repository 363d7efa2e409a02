"""The measures of rearrangement, on a block that one straight push brings to its place."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.accuracy import rearrangement
from pushplan.scenarios import Suite

PUSHER = """
from pushplan.world import Twist

class Pusher:
    actions = ("velocity",)
    goal_kind = "objects"

    def __init__(self, order="gtsp", mpc=True):
        self.able = mpc and order != "random"
        self.speed = 0.3 if order == "gtsp" else 0.15

    def reset(self, world, rng):
        pass

    def act(self, world, observation=None):
        going = self.able and not world.goal_reached
        return Twist(self.speed if going else 0.0, 0.0)
"""
INSTANCE = {
    "objects": {"b1": [2.0, 2.0, 0.0]},
    "goals": {"d1": [2.2, 2.0, 0.0]},
    "robot": [1.5, 2.0, 0.0],  # 6 cm from the block
    "raw_other": {"assign": [["b1", "d1"]]},
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "pusher.py").write_text(PUSHER)
    (tmp_path / "two.json").write_text(json.dumps([INSTANCE, INSTANCE]))

    def short(text: str, episodes: int, first: int) -> tuple[Suite]:
        suite = rearrangement.relopush_suite(tmp_path / "two.json", episodes)
        scenarios = (
            replace(one, variations={**one.variations, "time_limit": 3.0})
            for one in suite.scenarios
        )
        return (replace(suite, scenarios=tuple(scenarios)),)

    monkeypatch.setattr(rearrangement, "suites_of", short)
    return tmp_path


@pytest.fixture
def table(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    def printed(*words: str) -> list[list[str]]:
        """The cells of the table that a command prints."""
        policy = f"{folder / 'pusher.py'}:Pusher"
        common = ("--out", str(folder / "run"), "--workers", "0", "--policy", policy)
        monkeypatch.setattr(sys, "argv", ["rearrangement", *common, *words])
        rearrangement.main()
        lines = [one for one in capsys.readouterr().out.splitlines() if one.startswith("| ")]
        return [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]

    return printed


def test_instances_have_lengths_and_times(table, folder):
    given = ("--relopush", str(folder / "two.json"))
    head, line = table(*given)
    found = dict(zip(head, line, strict=True))
    assert (found["count"], found["success"][:4]) == ("2", "1.00")
    assert (found["pushes"], found["relocations"]) == ("1.000", "0.000")
    assert float(found["pushing [m]"]) == pytest.approx(0.2, abs=0.03)
    assert float(found["transit [m]"]) == pytest.approx(0.06, abs=0.03)
    assert table("--table", *given)[1] == line
    assert table(*given, "--count", "1")[1][2] == "1"
    assert table(*given)[1] == line  # is not run again


def test_suites_have_scores_and_errors(table):
    head, line = table("--suite", "any", "--seeds", "0:2")
    found = dict(zip(head, line, strict=True))
    assert (found["episodes"], found["S"]) == ("2", "1.000")
    middle, worst = map(float, found["position error [mm], median / worst"].split(" / "))
    assert 0.0 < middle <= worst < 20.0


def test_orders_are_compared_on_the_same_starts(table):
    _, *each, _, nearest, random = table("--ablation", "order", "--seeds", "0:2")
    assert [line[2][:4] for line in each] == ["1.00", "1.00", "0.00"]
    assert nearest[1:4] == ["2", "+0.000 (+0.000 to +0.000)", "2"]
    assert float(nearest[4].split()[0]) == pytest.approx(1.0, abs=0.5)  # ratio of transits
    assert random[1:] == ["2", "+1.000 (+1.000 to +1.000)", "0", "", "", ""]


def test_controllers_are_compared_under_the_same_disturbances(table, monkeypatch):
    every = rearrangement.conditions
    names = ["undisturbed", "friction-x2"]
    monkeypatch.setattr(
        rearrangement, "conditions", lambda one: {name: every(one)[name] for name in names}
    )
    _, *lines = table("--ablation", "mpc", "--seeds", "0:2")
    assert [line[0] for line in lines] == names
    for line in lines:
        assert line[1:] == ["2", *["1.000 / 0.000", "+1.000 (+1.000 to +1.000)"] * 2, *[""] * 4]


def test_friction_is_off_by_a_factor_and_masses_are_not_told(folder):
    (suite,) = rearrangement.suites_of("any", 1, 0)
    found = rearrangement.conditions(suite.scenarios[0])
    assert list(found)[:3] == ["undisturbed", "noise-2cm-3deg", "delay-100ms"]
    assert found["friction-x2"].variations == {
        "bumper_friction": 0.8,
        "object_friction": 0.8,
        "wall_friction": 0.8,
    }
    assert found["mass-x0.5"].variations == {"mass_scale": 0.5, "parameters": "unknown"}
