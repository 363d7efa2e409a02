"""Run everything once for a moment, so that its kernels are compiled and cached."""

from __future__ import annotations

from typing import Any

from pushplan.evaluation.run.jobs import JobSettings
from pushplan.evaluation.run.policy_calls import PolicyError
from pushplan.evaluation.run.policy_specs import PolicySpec, policy_names
from pushplan.evaluation.run.recording import Recording
from pushplan.metrics import compute
from pushplan.world import InvalidInputError, UnknownNameError

_OTHERS = ("observations", "metrics")

STEPS = 3
_COLUMNS = "area-clearing-2d-10-walled-with-columns"  # for a network made for such rooms only


def names() -> tuple[str, ...]:
    """Return the names that `warm_up` knows: every policy, and others that have kernels."""
    return (*policy_names(), *_OTHERS)


def warm_up(name: str) -> None:
    """Run a policy, or one of the other `names`, for a moment.

    "observations" are those that a network may have been trained on, "metrics" are all.
    A policy is warmed up as `pushplan.planners.warm_up` does it, and makes a few steps in every
    kind of start of the smoke suite that it is made for; networks only do that.

    Raises:
        UnknownNameError: if there is no such name.
    """
    from pushplan.learned import FeatureObservation

    if name == "observations":
        for observation in ("image", "spatial", FeatureObservation()):
            _record("random", observation)
    elif name == "metrics":
        for recording in _record("random"):
            compute(recording.episode())
    else:
        if name not in policy_names():
            raise UnknownNameError("policy", name, names())
        PolicySpec(name, name).warm_up()
        _record(name)


def _record(policy: str, observation: Any = None) -> list[Recording]:
    """The first steps of a policy in every smoke start that it is made for, or else among columns.

    Args:
        policy: a name.
        observation: what the environment observes, where the policy does not say.
    """
    from pushplan.scenarios import suite

    recordings: list[Recording] = []
    for scenario in (*suite("smoke").scenarios, *suite(_COLUMNS, episodes=1).scenarios):
        if recordings and scenario.key.startswith(_COLUMNS):
            break
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
