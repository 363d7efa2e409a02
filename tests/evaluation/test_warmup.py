"""What a warm-up compiles: all that episodes need, each kernel once, and what progress expects."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from pushplan.cli.kernel_progress import expected_kernels
from pushplan.evaluation.run.policy_specs import policy_names
from pushplan.evaluation.run.warmup import names

EPISODES = """
import json, sys
from pushplan.compiled import watching
from pushplan.evaluation import JobSettings, PolicySpec
from pushplan.evaluation.run.compatibility import incompatibility
from pushplan.evaluation.run.recording import Recording
from pushplan.evaluation.run.warmup import warm_up
from pushplan.metrics import compute
from pushplan.scenarios import suite

spec, of, *others = PolicySpec(sys.argv[1], sys.argv[1]), *sys.argv[1:]
ready, later, ran = set(), {}, []
with watching(lambda kernel, loaded: ready.add(kernel)):
    for name in (of, *others):
        warm_up(name)
for title in (
    "maze-2d-5",
    "maze-3d-6-z",
    "ship-ice-2d-20",
    "ship-ice-3d-20",
    "area-clearing-2d-10-walled-with-columns",
    "area-clearing-3d-10",
    "box-delivery-2d-small-columns-10",
    "box-delivery-3d-3",
):
    scenario, settings = suite(title, episodes=2).scenarios[1], JobSettings()
    with watching(lambda kernel, loaded: later.setdefault(kernel, title)):
        if incompatibility(spec, scenario, settings):
            continue
        recording = Recording(policy := spec.make(), scenario)
        recording.run(settings.environment(scenario, policy), limit=20)
        if "metrics" in others:
            compute(recording.episode())
    ran.append(title)
print(json.dumps([sorted(ready), later, ran]))
"""

EVERYTHING = """
import gc, json
from pushplan.compiled.dispatcher import KernelDispatcher
from pushplan.evaluation.run.warmup import names, warm_up

for name in names():
    warm_up(name)
print(json.dumps({
    f"{kernel.py_func.__module__}.{kernel.py_func.__qualname__}": len(kernel.overloads)
    for kernel in gc.get_objects() if isinstance(kernel, KernelDispatcher)
}))
"""

TWICE: dict[str, str] = {}
"""Kernels that Python calls with more than one type of arguments, and why."""
DISTINCT = {expected_kernels(name): name for name in reversed(policy_names())}
"""Policies that need kernels of their own; of those with the same ones, the first."""


@pytest.mark.slow
@pytest.mark.parametrize("name", DISTINCT.values())
def test_episodes_after_a_warm_up_compile_nothing_and_progress_knows_its_kernels(name):
    others = [other for other in names() if other not in policy_names()] * (name == "random")
    ready, later, ran = output(EPISODES, name, *others)
    assert ran
    assert not later
    assert expected_kernels(name, *others) == set(ready), (
        "python -m benchmarks.speed.startup --write"
    )


@pytest.mark.slow
def test_each_kernel_is_compiled_for_one_type_of_arguments():
    counts = output(EVERYTHING)
    assert counts
    assert {kernel for kernel, count in counts.items() if count > 1} == set(TWICE)


def test_kernels_of_several_names_are_those_of_each():
    both = expected_kernels("maze-ppo", "ship-lattice")
    assert both == expected_kernels("maze-ppo") | expected_kernels("ship-lattice")
    assert both


def test_no_total_is_known_for_a_policy_of_others():
    assert expected_kernels("greedy", "module:Class") == frozenset()


def output(script, *arguments):
    command = [sys.executable, "-c", script, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])
