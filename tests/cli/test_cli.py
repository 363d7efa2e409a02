"""The command line as a user meets it."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pushplan.cli import main
from pushplan.world import (
    Drive,
    GoalDisc,
    Movables,
    RobotModel,
    StaticMap,
    World,
    load_world,
    save_world,
)

COMMANDS = (
    "run",
    "plan",
    "bench",
    "list",
    "score",
    "identify",
    "report",
    "ice",
    "teleop",
)
SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


@pytest.fixture
def room(tmp_path: Path) -> Path:
    world = World(
        robot=RobotModel.from_outline(
            SQUARE, mass=1.0, drive=Drive.CONSTANT_SPEED, max_speed=1.0, max_turn_rate=1.0
        ),
        robot_pose=np.array([2.0, 2.0, 0.0]),
        static=StaticMap.build(bounds=[0.0, 0.0, 12.0, 12.0]),
        movables=Movables.from_outlines([SQUARE], [[6.0, 2.0, 0.0]]),
        goal=GoalDisc(np.array([10.0, 3.0]), 1.0),
    )
    path = tmp_path / "room.yaml"
    save_world(world, path)
    return path


def one_line(capsys: pytest.CaptureFixture[str]) -> str:
    text = capsys.readouterr().err
    assert text.startswith("pushplan: ") and text.count("\n") == 1
    return text


@pytest.mark.parametrize("command", COMMANDS)
def test_help_has_examples(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, "--help"]) == 0
    assert f"examples:\n  pushplan {command}" in capsys.readouterr().out


def test_help_loads_nothing_heavy() -> None:
    code = (
        "import sys; from pushplan.cli import main; main(['--help']);"
        "print([m for m in ('numpy', 'scipy', 'rich') if m in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("planners", "kinodynamic-rrt"),
        ("policies", "straight"),
        ("tasks", "maze"),
        ("suites", "maze-2d-5"),
        ("metrics", "E_nav"),
        ("simulators", "pymunk"),
    ],
)
def test_list(kind: str, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", kind]) == 0
    lines = capsys.readouterr().out.splitlines()
    (line,) = (line for line in lines if line.split()[0] == name)
    assert len(line.split()) > 4  # facts and a description stand beside it
    assert main(["list", kind, "--names"]) == 0
    assert capsys.readouterr().out.splitlines() == [line.split()[0] for line in lines]


def test_list_says_what_each_policy_and_suite_is_for(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "all"]) == 0
    lines = {line.split()[0]: line for line in capsys.readouterr().out.splitlines()}
    assert re.search(r" box_delivery,area_clearing,rearrange +velocity ", lines["gtsp-mpc"])
    assert " ship_ice " in lines["ship-predictive"] and " any " in lines["random"]
    assert " box_delivery " in lines["box-delivery-sac"] and "SAC" in lines["box-delivery-sac"]
    assert " maze " in lines["maze-2d-5"] and " turn_rate " in lines["maze-2d-5"]


def test_the_shell_completes_commands_and_kinds() -> None:
    pytest.importorskip("argcomplete")
    for line, words in (
        ("pushplan li", ["list"]),
        ("pushplan list su", ["suites"]),
        ("pushplan run maze-2d-6", ["maze-2d-6", "maze-2d-6-z"]),
    ):
        asked = {"_ARGCOMPLETE": "1", "_ARGCOMPLETE_IFS": "\n", "COMP_LINE": line}
        done = subprocess.run(
            [sys.executable, "-c", "from pushplan.cli import main; main()"],
            env={
                **os.environ,
                **asked,
                "COMP_POINT": str(len(line)),
                "_ARGCOMPLETE_STDOUT_FILENAME": "/dev/stdout",
            },
            capture_output=True,
            text=True,
        )
        assert done.stdout.split() == words


def test_plan_writes_a_plan(room: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = room.with_name("plan.json")
    code = main(
        [
            "plan",
            str(room),
            "--planner",
            "kinodynamic-rrt",
            "--iterations",
            "2000",
            "--out",
            str(out),
        ]
    )
    assert code == 0
    text = capsys.readouterr().out
    assert "kinodynamic-rrt: solved" in text and "length" in text
    data = json.loads(out.read_text())
    assert data["schema"] == "pushplan-plan/1" and data["status"] == "solved"
    poses = np.array(data["plan"]["poses"])
    assert len(poses) == len(data["plan"]["times"])
    assert poses[0] == pytest.approx([2.0, 2.0, 0.0])
    assert np.hypot(*(poses[-1, :2] - [10.0, 3.0])) <= 1.0 + 1e-6


OWN = """
import numpy as np
from pushplan.world import Plan, PlanResult, PlanStats, PlanStatus


class Own:
    def __init__(self, *corners):
        self.corners = corners

    def plan(self, world, *, stop=None, rng=None):
        poses = np.array([(x, y, 0.0) for x, y in self.corners])
        count = len(poses)
        plan = Plan(np.arange(count, dtype=float), poses, np.ones(count), np.zeros(count), 1.0)
        return PlanResult(PlanStatus.SOLVED, plan, PlanStats(0.0))


def elsewhere():
    return Own((9.0, 9.0), (10.0, 3.0))


def through_a_wall():
    return Own((2.0, 2.0), (2.0, 9.0), (10.0, 3.0))


def short():
    return Own((2.0, 2.0), (3.0, 2.0))


def right():
    return Own((2.0, 2.0), (10.0, 3.0))
"""


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("elsewhere", "plan.poses must begin within"),
        ("through_a_wall", "says solved, but at [2, "),
        ("short", "says solved, but the plan ends at [3, 2], short of the goal"),
        ("right", ""),
    ],
)
def test_a_plan_of_ones_own_is_what_its_status_says(
    name: str, said: str, room: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    static = StaticMap.build(segments=[[0.0, 6.0, 4.0, 6.0]], radii=0.1, bounds=[0, 0, 12, 12])
    save_world(replace(load_world(room), static=static), room)
    own = room.with_name("own.py")
    own.write_text(OWN)
    assert main(["plan", str(room), "--planner", f"{own}:{name}"]) == (1 if said else 0)
    assert said in (one_line(capsys) if said else "")


def test_errors_are_one_line_with_a_code(
    room: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", str(room), "--planner", "kinodynamic-rtt"]) == 2
    assert "did you mean 'kinodynamic-rrt'" in one_line(capsys)
    assert main(["plan", str(tmp_path / "none.yaml"), "--planner", "straight"]) == 2
    assert "cannot read world file" in one_line(capsys)
    assert main(["report", str(tmp_path)]) == 2
    assert "holds no results" in one_line(capsys)
    assert main(["score", str(room)]) == 2
    assert "cannot read episode file" in one_line(capsys)
    assert main(["bench", "maze-2d-7", "--policies", "straight"]) == 2
    assert "unknown suite 'maze-2d-7'" in one_line(capsys)
    assert main(["bench", "smoke", "--policies", "nobody.py:Me"]) == 2
    assert "no file nobody.py" in one_line(capsys)


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["list", "things"],
        ["plan", "room.yaml"],
        ["plan", "room.yaml", "--planner", "straight", "--deadline", "0"],
        ["plan", "room.yaml", "--planner", "straight", "--deadline", "1", "--iterations", "5"],
        ["bench", "smoke"],
        ["bench", "smoke", "--policies", "straight", "--workers", "-1"],
        ["bench", "smoke", "--policies", "straight", "--timeout", "soon"],
        ["run", "smoke"],
    ],
)
def test_bad_usage_is_code_2(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 2
    assert "--help'" in one_line(capsys)
