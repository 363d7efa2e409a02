"""`warm_up` leaves no kernel to be compiled, or loaded, when a deadline counts."""

from __future__ import annotations

import subprocess
import sys

import pytest

from pushplan.planners import kernel_warmup, make_policy, warm_up
from pushplan.world import UnknownNameError

LOADED = """
import gc, sys
from numba.core.dispatcher import Dispatcher

def loaded():
    found = (x for x in gc.get_objects() if isinstance(x, Dispatcher))
    return {f"{x.py_func.__module__}.{x.py_func.__name__}": len(x.signatures) for x in found}

def newer(before):
    return [kernel for kernel, count in loaded().items() if count > before.get(kernel, 0)]
"""

PLAN = """
from pushplan.envs import make
from pushplan.planners import MaxIterations, make_planner, warm_up
from pushplan.scenarios import Scenario

name, task, iterations = sys.argv[1:]
env = make(Scenario(task, seed=1), observation="state")
env.reset(seed=1)
warm_up(name)
before = loaded()
make_planner(name).plan(env.world, stop=MaxIterations(int(iterations)))
print(newer(before))
"""

EPISODE = """
from pushplan.evaluation import JobSettings, run_episode
from pushplan.planners import make_policy, warm_up
from pushplan.scenarios import suite

name, of = sys.argv[1:]
warm_up(name)
before = loaded()
scenario, policy = suite(of, episodes=2).scenarios[1], make_policy(name)
run_episode(JobSettings().environment(scenario, policy), policy, scenario)
print([kernel for kernel in newer(before) if kernel.startswith("pushplan.planners")])
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
    assert output(PLAN, name, task, str(iterations)) == "[]"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "suite"),
    [
        ("push-aware-constant-speed", "maze-3d-6"),
        ("ship-lattice", "ship-ice-2d-20"),
        ("gtsp-mpc", "area-clearing-2d-10-walled-with-columns"),
        ("gtsp-mpc", "box-delivery-2d-small-columns-10"),
    ],
)
def test_an_episode_after_warming_up_loads_nothing(name, suite):
    assert output(EPISODE, name, suite) == "[]"


def test_every_name_can_be_warmed_up():
    warm_up("random")
    with pytest.raises(UnknownNameError, match="skeletton"):
        warm_up("skeletton")


def test_a_second_time_nothing_is_done(monkeypatch):
    made, policy = [], make_policy("straight")
    monkeypatch.setattr(kernel_warmup, "make_policy", lambda name: made.append(name) or policy)
    kernel_warmup._warm_up.cache_clear()
    for _ in range(2):
        warm_up("straight", "straight")
    assert made == ["straight"]
    kernel_warmup._warm_up.cache_clear()


def output(script, *arguments):
    command = [sys.executable, "-c", LOADED + script, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return done.stdout.strip()
