"""A C++ program is built against the installed package, plans, and follows its plans."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pushplan import __version__
from pushplan.core import cmake_dir
from pushplan.errors import PushplanError

EXAMPLE = Path(__file__).parents[1] / "examples" / "cpp"


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


def configure(source: Path, folder: Path, package: Path) -> None:
    run("cmake", "-S", source, "-B", folder, f"-Dpushplan_DIR={package}")


def test_the_example_plans_and_follows_with_both_controllers(package, tmp_path):
    assert run(sys.executable, "-m", "pushplan", "--cmake-dir").strip() == str(package)
    configure(EXAMPLE, tmp_path, package)
    run("cmake", "--build", tmp_path)
    told = run(tmp_path / "push_robot")  # which ends well only if all of it did
    assert re.findall(r"^(\S+): \d+ poses", told, re.M) == ["kinodynamic", "push-aware"]
    assert told.count("in the goal after") == told.count(" 0 allocations, stopped") == 4
    assert "robot_pose must be finite" in told


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
