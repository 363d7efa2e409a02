"""Importing a room loads only what it needs."""

from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = ("pymunk", "mujoco", "gymnasium", "torch", "matplotlib")


@pytest.mark.parametrize(
    "module",
    [
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
    ],
)
def test_no_simulator_and_no_learning_library(module):
    code = f"import sys, pushplan.{module}; print([m for m in {HEAVY!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
