"""Run everything once for a moment, so that its kernels are compiled and cached."""

from __future__ import annotations

import time
from typing import Any

from pushplan.evaluation.episode import PolicyError, Recording
from pushplan.evaluation.jobs import JobSettings
from pushplan.evaluation.loading import load_object
from pushplan.evaluation.policies import PolicySpec, policy_names
from pushplan.world import InvalidInputError, UnknownNameError

WARMUPS: dict[str, str] = {
    "policies": "pushplan.evaluation.warmup:policies",
    "observations": "pushplan.evaluation.warmup:observations",
    "planners": "pushplan.planners.kernel_warmup:warm_up",
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
    """A few steps of every policy, networks too, in every kind of start of the smoke suite."""
    for name in policy_names():
        _record(name)


def observations() -> None:
    """A few steps with each kind of observation that a network may have been trained on."""
    from pushplan.learned import FeatureObservation

    for observation in ("image", "spatial", FeatureObservation()):
        _record("random", observation)


def metrics() -> None:
    """Every metric of a short episode."""
    from pushplan.metrics import compute

    for recording in _record("random"):
        compute(recording.episode())


def _record(policy: str, observation: Any = None) -> list[Recording]:
    """The first steps of a policy in every smoke start that it is made for.

    Args:
        policy: a name.
        observation: what the environment observes, where the policy does not say.
    """
    from pushplan.scenarios import suite

    recordings = []
    for scenario in suite("smoke").scenarios:
        runner = PolicySpec(policy, policy).make()
        if observation is not None:
            runner.observation = observation  # type: ignore[attr-defined]
        try:
            env = JobSettings().environment(scenario, runner)
        except (UnknownNameError, InvalidInputError):  # another task's actions or observation
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
