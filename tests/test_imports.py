"""Importing a room, and using it, loads only what it needs."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

HEAVY = ("pymunk", "mujoco", "gymnasium", "torch", "matplotlib", "osqp", "casadi")
ROOMS = (
    "world",
    "geometry",
    "interaction",
    "observation",
    "control",
    "drawing",
    "planners",
    "planners.rrt",
    "planners.push_aware.policies",
    "runtime",
    "serving",
)
LOADED = "print([name for name in {names!r} if name in sys.modules])"
CASES = {
    room: (f"import sys, pushplan.{room}\n{LOADED.format(names=HEAVY)}", "[]") for room in ROOMS
} | {
    "the command 'plan'": (
        "import sys; from pushplan.cli import main\n"
        "main(['plan', 'examples/room.yaml', '--planner', 'straight'])\n"
        + LOADED.format(names=HEAVY),
        "[]",
    ),
    "gtsp, which knows no robot": (
        "import sys; from pushplan.gtsp import read_gtsp, solve_gtsp\n"
        "print({m.split('.')[1] for m in sys.modules if m.startswith('pushplan.')}\n"
        "      - {'gtsp', 'world', 'core', '_core', 'errors', 'files', 'imports'})",
        "set()",
    ),
    "an environment that gymnasium finds by itself": (
        "import gymnasium\n"
        "env = gymnasium.make('pushplan.envs:pushplan/Maze-v0', boxes=3, observation='state')\n"
        "env.reset(seed=0); env.step(env.action_space.sample())\n"
        "print(len(env.unwrapped.world.movables))",
        "3",
    ),
}
EACH_ALONE = """
import contextlib, io, json, os, sys
import scipy.ndimage, scipy.sparse, shapely  # once for all, they take most of the time
for name, code in json.load(sys.stdin).items():
    if os.fork() == 0:
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            exec(code, {"__name__": "__main__"})
        print(json.dumps([name, said.getvalue().splitlines()[-1]]), flush=True)
        os._exit(0)
    assert os.wait()[1] == 0, name
"""


@pytest.fixture(scope="module")
def said() -> dict[str, str]:
    """The last line of each case where it is the first to import anything of ours."""
    done = subprocess.run(
        [sys.executable, "-c", EACH_ALONE],
        input=json.dumps({name: code for name, (code, _) in CASES.items()}),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return dict(json.loads(line) for line in done.stdout.splitlines())


@pytest.mark.parametrize("case", CASES)
def test_nothing_is_loaded_that_is_not_needed(case: str, said: dict[str, str]) -> None:
    assert said[case] == CASES[case][1]
