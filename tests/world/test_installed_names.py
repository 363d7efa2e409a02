"""What other distributions register through entry points is found like what is ours."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

MODULE = '''
import numpy as np

from pushplan.envs.tasks.maze import MazeTask
from pushplan.planners.shortest_path import ShortestPath
from pushplan.world import Twist, turtlebot3_burger


class Planner(ShortestPath):
    """Plans as `straight`."""


class Policy:
    """Stands."""

    def reset(self, world, rng):
        pass

    def act(self, world, observation):
        return Twist(0.0, 0.0)


class Task(MazeTask):
    """A maze of another name."""

    name = "other_maze"


def turning(episode):
    """How far the robot turned [rad]."""
    return np.abs(np.diff(np.unwrap(episode.robot_poses[:, 2]))).sum()


def quick_burger(drive, **limits):
    """A TurtleBot3 of 1 m/s."""
    return turtlebot3_burger(drive=drive, **{"max_speed": 1.0, **limits})
'''
ENTRY_POINTS = """
[pushplan.planners]
other-planner = others:Planner
straight = others:Nothing

[pushplan.policies]
other-policy = others:Policy

[pushplan.tasks]
other_maze = others:Task

[pushplan.metrics]
turning = others:turning

[pushplan.robots]
quick_burger = others:quick_burger
"""


@pytest.fixture(scope="module")
def others(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder on which a distribution is installed."""
    folder = tmp_path_factory.mktemp("site")
    (folder / "others.py").write_text(MODULE, encoding="utf-8")
    about = folder / "others-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: others\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(ENTRY_POINTS)
    return folder


def run(folder: Path, *arguments: str) -> str:
    """What a process prints that has the folder on its import path."""
    path = os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, *arguments],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_all_kinds_are_found_and_used(others: Path) -> None:
    program = """
import numpy as np
from pushplan.envs import PushEnv
from pushplan.metrics import METRICS, compute, metric_names
from pushplan.planners import make_planner, make_policy, planner_names, policy_names
from pushplan.evaluation import bench
from pushplan.scenarios import Scenario
from pushplan.world.stored.robots import make_robot, robots

assert "other-planner" == planner_names()[-1] and "other-policy" == policy_names()[-1]
assert type(make_planner("other-planner")).__name__ == "Planner"
assert type(make_planner("straight")).__module__.startswith("pushplan")  # ours cannot be taken
assert make_robot("quick_burger", "differential").max_speed == 1.0
field = PushEnv(task="area_clearing", variations={"robot": "quick_burger", "boxes": 2})
field.reset(seed=0)
assert field.world.robot.max_speed == 1.0
starts = [Scenario("other_maze", variations={"boxes": 1, "time_limit": 2.0})]
results = bench(starts, ["other-policy", "straight"], workers=1)
assert [row.turning == 0.0 for row in results.rows] == [True, False], results.rows
print("done")
"""
    assert run(others, "-c", program).endswith("done\n")


NAMES = {
    "planners": ("other-planner", "Plans as `straight`."),
    "policies": ("other-policy", "Stands."),
    "tasks": ("other_maze", "A maze of another name."),
    "metrics": ("turning", "How far the robot turned [rad]."),
    "robots": ("quick_burger", "A TurtleBot3 of 1 m/s."),
}


def test_the_command_line_lists_them(others: Path) -> None:
    program = f"""
from pushplan.cli import main
for kind in {[*NAMES]}:
    assert main(["list", kind, "--json"]) == 0
    print("\\0")
"""
    lists = run(others, "-c", program).split("\0")
    for (name, said), text in zip(NAMES.values(), lists, strict=False):
        found = [one["description"] for one in json.loads(text) if one["name"] == name]
        assert found == [said]
