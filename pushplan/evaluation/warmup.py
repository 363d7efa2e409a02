"""Run everything once for a moment, so that its kernels are compiled and cached."""

from __future__ import annotations

import time

from pushplan.evaluation.episode import PolicyError, Recording
from pushplan.evaluation.jobs import JobSettings
from pushplan.evaluation.loading import load_object
from pushplan.world import InvalidInputError, UnknownNameError

WARMUPS: dict[str, str] = {
    "policies": "pushplan.evaluation.warmup:policies",
    "observations": "pushplan.evaluation.warmup:observations",
    "planners": "pushplan.planners.warming:warm_up",
    "metrics": "pushplan.evaluation.warmup:metrics",
}
"""What -> "module:function" that is called without arguments."""

STEPS = 3


def warm_up(name: str) -> float:
    """Run one entry of `WARMUPS`.

    Returns:
        How long it took [s].
    """
    begin = time.perf_counter()
    load_object(WARMUPS[name])()
    return time.perf_counter() - begin


def policies() -> None:
    """A few steps of every policy in every kind of start of the smoke suite."""
    from pushplan.planners import policy_names

    for name in policy_names():
        _record(name, "state")


def observations() -> None:
    """A few steps with image observations."""
    _record("random", "image")


def metrics() -> None:
    """Every metric of a short episode."""
    from pushplan.metrics import compute

    for recording in _record("random", "state"):
        compute(recording.episode())


def _record(policy: str, observation: str) -> list[Recording]:
    """The first steps of a policy in every smoke start that it is made for."""
    from pushplan.planners import make_policy
    from pushplan.scenarios import suite

    recordings = []
    for scenario in suite("smoke").scenarios:
        runner = make_policy(policy)
        try:
            env = JobSettings(observation=observation).environment(scenario, runner)
        except UnknownNameError:  # the task has none of the policy's action modes
            continue
        recording = Recording(runner, scenario)
        try:
            recording.run(env, limit=STEPS)
        except PolicyError as error:
            if not isinstance(error.__cause__, InvalidInputError):
                raise
        else:
            recordings.append(recording)
        env.close()
    return recordings
