"""`warm_up` leaves no kernel to be compiled, or loaded, when a deadline counts."""

from __future__ import annotations

import subprocess
import sys

import pytest

LOOK = """
import gc, sys
from numba.core.dispatcher import Dispatcher
from pushplan.envs import make
from pushplan.planners import MaxIterations, make_planner, warm_up
from pushplan.scenarios import Scenario

def loaded():
    found = (x for x in gc.get_objects() if isinstance(x, Dispatcher))
    return {f"{x.py_func.__module__}.{x.py_func.__name__}": len(x.signatures) for x in found}

name, task, iterations = sys.argv[1:]
env = make(Scenario(task, seed=1), observation="state")
env.reset(seed=1)
warm_up(name)
before = loaded()
make_planner(name).plan(env.world, stop=MaxIterations(int(iterations)))
print([kernel for kernel, count in loaded().items() if count > before.get(kernel, 0)])
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "task", "iterations"),
    [
        ("kinodynamic-rrt", "maze", 2000),
        ("push-aware", "maze", 8000),
        ("ship-lattice", "ship_ice", 500),
        ("ship-predictive", "ship_ice", 100),
    ],
)
def test_the_first_plan_after_warming_up_loads_nothing(name, task, iterations):
    command = [sys.executable, "-c", LOOK, name, task, str(iterations)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
