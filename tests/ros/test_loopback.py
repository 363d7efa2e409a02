"""The ROS 2 node for real: with `rclpy`, Nav2's actions and a robot in another process.

ROS 2 comes as wheels into a virtual environment of Python 3.12, which takes 300 MB and minutes;
PUSHPLAN_ROS_VENV names one that is there already.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tomllib
from itertools import pairwise
from pathlib import Path

import pytest

from pushplan.ros import load_episode

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = ROOT / "examples" / "ros2"
WHEELS = (
    "catkin-pkg",
    *(f"ros-jazzy-{name}" for name in ("rclpy", "rmw-fastrtps-cpp", "nav-msgs", "geometry-msgs")),
    "ros-jazzy-visualization-msgs",
    "ros-jazzy-lifecycle-msgs",
)
ENVIRONMENT = {
    **{k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "LD_LIBRARY_PATH"))},
    "PYTHONPATH": os.pathsep.join([str(ROOT), str(Path(__file__).parent / "stand_ins")]),
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    "ROS_DOMAIN_ID": str(os.getpid() % 100),
}


def run(*command: object) -> subprocess.CompletedProcess[str]:
    words = [str(word) for word in command]
    return subprocess.run(words, env=ENVIRONMENT, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An interpreter with ROS 2, Nav2's two actions and what pushplan needs."""
    if sys.platform != "linux" or shutil.which("g++") is None:
        pytest.skip("the wheels of ROS 2 are for Linux, and the actions are compiled with g++")
    folder = os.environ.get("PUSHPLAN_ROS_VENV")
    if folder is None:
        maker = shutil.which("python3.12")
        if maker is None or run(maker, "-c", "import venv").returncode:
            pytest.skip("the wheels of ROS 2 need python3.12, which is not there")
        folder = str(tmp_path_factory.mktemp("ros") / "venv")
        assert run(maker, "-m", "venv", folder).returncode == 0
        project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
        needs = [*project["dependencies"], *project["optional-dependencies"]["ros"], *WHEELS]
        made = run(f"{folder}/bin/pip", "install", "-q", *needs)
        if made.returncode:
            pytest.skip(f"the wheels of ROS 2 cannot be installed: {made.stderr.strip()[-300:]}")
    path = Path(folder) / "bin" / "python"
    if run(path, "-c", "import nav2_msgs.action").returncode:
        made = run(path, EXAMPLE / "generate_actions.py")
        assert made.returncode == 0, made.stderr
    return path


@pytest.mark.slow
def test_a_robot_is_driven_through_navs_actions(python: Path, tmp_path: Path) -> None:
    log = tmp_path / "robot.mcap"
    options = [f"robot:={ROOT}/examples/room.yaml", "planner:=straight", f"log:={log}"]
    options += ["costmap:=global_costmap/costmap", "movement_time_allowance:=3.0"]
    words = [str(python), str(EXAMPLE / "node.py"), "--ros-args"]
    words += [word for option in options for word in ("-p", option)]
    with (tmp_path / "node.txt").open("w") as said:
        node = subprocess.Popen(words, env=ENVIRONMENT, stdout=said, stderr=said)
        try:
            client = run(python, Path(__file__).parent / "loopback.py", node.pid)
            if client.returncode:
                node.terminate()  # what the client does at its end
            ended = node.wait(timeout=60.0)
        finally:
            node.kill()
    assert client.returncode == 0, client.stderr + (tmp_path / "node.txt").read_text()
    assert ended == 128 + signal.SIGTERM, (tmp_path / "node.txt").read_text()
    told = json.loads(client.stdout.splitlines()[-1])

    ends = {name: (one["status"], one["code"]) for name, one in told.items() if "code" in one}
    assert ends == {
        "first": ("succeeded", 0),
        "second": ("succeeded", 0),
        "displaced": ("aborted", 100),  # UNKNOWN: another path has come in
        "driven": ("succeeded", 0),
        "back": ("succeeded", 0),
        "canceled": ("canceled", 0),
        "outside": ("aborted", 204),  # GOAL_OUTSIDE_MAP
        "occupied": ("aborted", 206),  # GOAL_OCCUPIED
        "unknown planner": ("aborted", 201),  # INVALID_PLANNER
        "planner of Nav2": ("succeeded", 0),
        "empty path": ("aborted", 103),  # INVALID_PATH
        "stuck plan": ("succeeded", 0),
        "stuck": ("aborted", 105),  # FAILED_TO_MAKE_PROGRESS
        "goal in odom": ("succeeded", 0),
        "goal in camera": ("aborted", 202),  # TF_ERROR
        "interrupted plan": ("succeeded", 0),
        "interrupted": ("aborted", 100),  # UNKNOWN: canceled by no client
        "again": ("succeeded", 0),
        "driven again": ("succeeded", 0),
        "last": ("succeeded", 0),
    }
    speeds = told["terminated"]["speeds"]
    assert speeds[-1] == 0.0 < speeds[0] and len(speeds) < 100
    assert max(abs(a - b) for a, b in pairwise(speeds)) < 3 * 0.5 * 0.05  # two may be lost
    driven, canceled = told["driven"], told["canceled"]
    assert driven["off"] <= 0.1 and driven["last"] == [0.0, 0.0] == told["stuck"]["last"]
    assert told["displaced"]["before"] > 0.15 and driven["slowest"] > 0.15
    assert driven["feedback"] > 100 and driven["fastest"] == pytest.approx(0.22, abs=1e-6)
    assert driven["distances"][0] > 2.0 and driven["distances"][1] < 0.1
    assert canceled["before"] > 0.15 and canceled["last"] == [0.0, 0.0]
    assert told["robot"] == {"commands": told["robot"]["commands"], "plans": 5}
    assert told["interrupted"]["before"] > 0.15 and told["interrupted"]["last"] == [0.0, 0.0]
    assert told["inactive"] == {"accepted": False, "commands": 0}
    active, inactive = "active", "inactive"
    assert told["states"] == [inactive, active, inactive, "unconfigured", inactive, active]
    assert told["driven again"]["off"] <= 0.1
    episode = load_episode(log)
    assert len(episode.times) > 500 and episode.world.movables.ids.tolist() == [4]
