"""Importing a room loads only what it needs."""

from __future__ import annotations

import ast
import subprocess
import sys

import pytest

HEAVY = ("pymunk", "mujoco", "gymnasium", "torch", "matplotlib")
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
EACH_ALONE = f"""
import importlib, os, sys
import numba, scipy.ndimage, scipy.sparse, shapely  # once for all, they take most of the time
for room in {ROOMS!r}:
    if os.fork() == 0:
        importlib.import_module("pushplan." + room)
        print((room, [name for name in {HEAVY!r} if name in sys.modules]), flush=True)
        os._exit(0)
    assert os.wait()[1] == 0, room
"""


@pytest.fixture(scope="module")
def loaded() -> dict[str, list[str]]:
    """What each room loads of them where it is the first to be imported."""
    done = subprocess.run(
        [sys.executable, "-c", EACH_ALONE], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return dict(ast.literal_eval(line) for line in done.stdout.splitlines())


@pytest.mark.parametrize("module", ROOMS)
def test_no_simulator_and_no_learning_library(module: str, loaded: dict[str, list[str]]) -> None:
    assert loaded[module] == []
