"""What works without the libraries of the extras, and what is said where one is missing."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from pushplan.imports.on_demand import EXTRAS as ON_DEMAND

ROOT = Path(__file__).parents[1]

WITHOUT = """
import sys

sys.modules.update(dict.fromkeys({absent!r}))  # as if they were not there
{code}
"""
EXTRAS = (
    "PIL",
    "rich",
    "gymnasium",
    "pymunk",
    "mujoco",
    "onnxruntime",
    "matplotlib",
    "imageio_ffmpeg",
    "mcap",
    "rosbags",
    "ruckig",
    "torch",
    "stable_baselines3",
)

ROBOT = """
import numpy as np
import pushplan.control, pushplan.learned, pushplan.metrics, pushplan.perception
from pushplan.cli import main
from pushplan.control import TwistLimiter
from pushplan.evaluation.run.policy_specs import parse_policy
from pushplan.planners import make_policy, policy_names
from pushplan.runtime import Runner
from pushplan.serving import PolicyServer
from pushplan.world import RobotModel, Twist, load_world

for name in policy_names():
    make_policy(name)
world = load_world("examples/room.yaml")
with Runner("straight", period=0.05) as runner:
    assert runner.start(world).status in ("waiting", "driving")
PolicyServer(parse_policy("straight").make, "unix:never-made")
robot = RobotModel.from_outline(
    [[0, 0], [1, 0], [0, 1]], mass=1, drive="differential", max_speed=1, max_turn_rate=1,
    max_acceleration=0.5,
)
limiter = TwistLimiter(robot)
assert limiter.step(Twist(1.0, 0.0), 0.1).linear == 0.05
assert main(["list", "tasks"]) == 0
assert main(["list", "suites"]) == 0
assert main(["plan", "examples/room.yaml", "--planner", "straight"]) == 0
"""


def without(absent, code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", WITHOUT.format(absent=set(absent), code=code)],
        capture_output=True,
        text=True,
        check=False,
    )


def test_a_robot_needs_none_of_the_extras():
    done = without(EXTRAS, ROBOT)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("absent", "arguments", "extra"),
    [
        ("gymnasium", ["bench", "smoke", "--policies", "straight"], "sim"),
        (
            "PIL",
            ["plan", "examples/room.yaml", "--planner", "straight", "--render", "no.png"],
            "pictures",
        ),
        (
            "matplotlib",
            ["plan", "examples/room.yaml", "--planner", "straight", "--render", "no.svg"],
            "plots",
        ),
        ("pymunk", ["run", "maze-2d-3", "--policy", "straight"], "sim"),
        ("mujoco", ["run", "maze-3d-3", "--policy", "straight"], "sim"),
        ("onnxruntime", ["run", "maze-2d-3", "--policy", "maze-ppo"], "learned"),
        ("mcap", ["score", "robot.mcap"], "ros"),
        ("rosbags", ["run", "maze-2d-3", "--policy", "straight", "--out", "a.mcap"], "ros"),
        ("torch", ["train", "ppo", "--task", "maze", "--out", "never-made"], "train"),
    ],
)
@pytest.mark.slow
def test_a_missing_library_is_one_line_that_names_the_extra(absent, arguments, extra):
    code = f"from pushplan.cli import main\nsys.exit(main({arguments!r}))"
    done = without([absent], code)
    assert done.returncode != 0
    assert done.stderr.strip().count("\n") == 0, done.stderr
    assert f"pip install 'pushplan[{extra}]'" in done.stderr
    assert absent in done.stderr


def test_all_brings_what_a_user_of_the_package_may_need():
    """Left out is what trains networks, and what develops and documents the package."""
    page = (ROOT / "docs" / "installation.md").read_text("utf-8")
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"][
        "optional-dependencies"
    ]
    (brought,) = re.findall(r"pushplan\[(.*)\]", *extras["all"])
    others = {"all", "dev", "docs", "learn", "notebooks", "test", "train"}
    assert {*brought.split(","), "pictures"} == extras.keys() - others  # `sim` brings pictures
    above = page.partition("| `all` |")[0]
    assert set(re.findall(r"^\| `(\w+)` \| .* \| .* \|$", above, re.MULTILINE)) == (
        extras.keys() - others
    )


def test_each_library_is_brought_by_the_extra_that_errors_name():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"][
        "optional-dependencies"
    ]
    packages = {"PIL": "pillow", "h5py": "minari[hdf5]"}
    for library, extra in ON_DEMAND.items():
        package = packages.get(library, library).replace("_", "-")
        assert any(one.startswith(package) for one in extras[extra]), library


def test_another_missing_module_is_no_matter_of_extras():
    from pushplan.imports.on_demand import need

    with pytest.raises(ModuleNotFoundError, match="nowhere"):
        need("nowhere")
