"""Run everything once for a moment, so that its kernels are compiled and cached."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from pushplan.evaluation.episode import PolicyError, Recording
from pushplan.evaluation.jobs import JobSettings
from pushplan.evaluation.policies import PolicySpec, policy_names
from pushplan.world import InvalidInputError, UnknownNameError

if TYPE_CHECKING:
    from pushplan.scenarios import Scenario

_OTHERS = ("observations", "metrics")

STEPS = 3
_COLUMNS = "area-clearing-2d-10-walled-with-columns"  # for a network made for such rooms only


def names() -> tuple[str, ...]:
    """What `warm_up` knows: every policy, and what has kernels beside policies."""
    return (*policy_names(), *_OTHERS)


def warm_up(name: str) -> float:
    """Run a policy, or one of the other `names`, for a moment.

    A policy is warmed up as `pushplan.planners.warm_up` does it, and makes a few steps in every
    kind of start of the smoke suite that it is made for; networks only do that.

    Returns:
        How long it took [s].

    Raises:
        UnknownNameError: if there is no such name.
    """
    begin = time.perf_counter()
    if name == "observations":
        _observations()
    elif name == "metrics":
        _metrics()
    else:
        if name not in policy_names():
            raise UnknownNameError("policy", name, names())
        PolicySpec(name, name).warm_up()
        _record(name)
    return time.perf_counter() - begin


def _observations() -> None:
    """A few steps with each kind of observation that a network may have been trained on."""
    from pushplan.learned import FeatureObservation

    for observation in ("image", "spatial", FeatureObservation()):
        _record("random", observation)


def _metrics() -> None:
    """Every metric of a short episode."""
    from pushplan.metrics import compute

    for recording in _record("random"):
        compute(recording.episode())


def _record(policy: str, observation: Any = None) -> list[Recording]:
    """The first steps of a policy in every smoke start that it is made for, or else among columns.

    Args:
        policy: a name.
        observation: what the environment observes, where the policy does not say.
    """
    from pushplan.scenarios import suite

    found = _record_in(suite("smoke").scenarios, policy, observation)
    return found or _record_in(suite(_COLUMNS, episodes=1).scenarios, policy, observation)


def _record_in(scenarios: Iterable[Scenario], policy: str, observation: Any) -> list[Recording]:
    recordings = []
    for scenario in scenarios:
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
            env.warm_up()
        env.close()
    return recordings
