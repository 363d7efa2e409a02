"""C++ programs are built against the installed package, plan as Python does, and follow plans."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import make_u_maze, scattered_boxes

from pushplan import __version__
from pushplan.cli import main
from pushplan.core import cmake_dir
from pushplan.errors import PushplanError
from pushplan.world import save_world

EXAMPLES = Path(__file__).parents[1] / "examples"


def run(*command: object) -> str:
    done = subprocess.run(
        [*map(str, command)], capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def package() -> Path:
    """The folder of the CMake package, where there are tools to use it."""
    for tools in (("cmake",), ("c++", "g++", "clang++")):
        if not any(map(shutil.which, tools)):
            pytest.skip(f"needs {' or '.join(tools)}")
    try:
        return cmake_dir()
    except PushplanError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def built(package: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with the programs of the example."""
    folder = tmp_path_factory.mktemp("cpp")
    run("cmake", "-S", EXAMPLES / "cpp", "-B", folder, f"-Dpushplan_DIR={package}")
    run("cmake", "--build", folder)
    return folder


def test_the_example_plans_and_follows_with_both_controllers(package, built):
    assert run(sys.executable, "-m", "pushplan", "--cmake-dir").strip() == str(package)
    told = run(built / "push_robot")  # which ends well only if all of it did
    assert re.findall(r"^(\S+): \d+ poses", told, re.M) == ["kinodynamic", "push-aware"]
    assert told.count("in the goal after") == told.count(" 0 allocations, stopped") == 4
    assert "robot_pose must be finite" in told


@pytest.mark.parametrize("boxes", [None, 0, 8])
@pytest.mark.parametrize("planner", ["kinodynamic-rrt", "push-aware"])
def test_a_plan_of_the_command_line_is_repeated_to_the_last_digit(built, boxes, planner, tmp_path):
    world, plain, out = (tmp_path / name for name in ("maze.yaml", "world.txt", "plan.json"))
    if boxes is None:
        world = EXAMPLES / "room.yaml"
    else:
        save_world(make_u_maze(scattered_boxes(boxes, 1)), world)
    options = ["--planner", planner, "--iterations", "2000", "--seed", "0"]
    files = ["--plain", str(plain), "--out", str(out)]
    assert main(["plan", str(world), *options, *files]) == 0
    data = json.loads(out.read_text())
    told = run(built / "plan_file", plain, planner, data["stats"]["seed"], 2000)
    columns = np.array([line.split() for line in told.splitlines()], dtype=float)
    plan = data["plan"]
    for column, key in ((0, "times"), (slice(1, 4), "poses"), (4, "speeds"), (5, "turn_rates")):
        assert columns[:, column].tolist() == plan[key]


def test_a_wrong_file_is_one_line(built, tmp_path):
    (tmp_path / "world.txt").write_text("margin 0\npose 1 2\n")
    done = subprocess.run(
        [built / "plan_file", tmp_path / "world.txt", "push-aware", "0", "10"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2 and "line 2: it needs 3 numbers, got 2" in done.stderr


def test_another_minor_version_is_refused(package, tmp_path):
    major, minor = map(int, __version__.split(".")[:2])
    for asked, found in ((f"{major}.{minor}", "TRUE"), (f"{major}.{minor + 1}", "FALSE")):
        source = tmp_path / asked
        source.mkdir()
        (source / "CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.22)\nproject(asks LANGUAGES CXX)\n"
            f"find_package(pushplan {asked} QUIET)\n"
            'if(pushplan_FOUND)\nmessage(NOTICE "TRUE")\nelse()\nmessage(NOTICE "FALSE")\nendif()\n'
        )
        done = subprocess.run(
            ["cmake", "-S", source, "-B", source / "build", f"-Dpushplan_DIR={package}"],
            capture_output=True,
            text=True,
            timeout=300,
            check=True,
        )
        assert found in done.stderr
