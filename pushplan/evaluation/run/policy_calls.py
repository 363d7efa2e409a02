"""Calls of a policy in an episode: what it is asked, what it may answer, how long it took."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from pushplan.errors import describe
from pushplan.evaluation.run.job_limits import EpisodeTimeout, is_ctrl_c
from pushplan.world import (
    ChoosesObservation,
    HoldsDecisions,
    InvalidInputError,
    LogsPlans,
    Policy,
    PushplanError,
    Twist,
    WheelSpeeds,
)
from pushplan.world.checks import FloatArray


class PolicyError(PushplanError):
    """A policy raised an exception; the cause is attached."""


class InvalidActionError(PolicyError):
    """A policy returned something that is no action of its environment."""


def asked(method: Callable[..., Any], *arguments: Any) -> Any:
    """Call a method of a policy and return the answer.

    Raises:
        PolicyError: if it raises.
    """
    try:
        return method(*arguments)
    except (MemoryError, EpisodeTimeout):
        raise
    except BaseException as error:
        if is_ctrl_c(error):
            raise
        raise PolicyError(describe(error)) from error


def held_for(policy: Policy) -> int:
    """Steps for which a decision of the policy stands: more than 1 for some networks."""
    if isinstance(policy, HoldsDecisions):
        return policy.steps_per_decision
    return 1


def observation_time(env: Any, policy: Policy, step: int) -> float:
    """Return the duration of the observation on which the policy decides in a step [s].

    Args:
        env: says it, if it can, as ``observation_time_s``.
        policy: one that does not say what it observes looks at the world alone.
        step: number of the step, from 0.
    """
    if wanted_observation(policy) is None or step % held_for(policy):
        return 0.0
    return float(getattr(env, "observation_time_s", 0.0))


def wanted_observation(policy: object) -> Any:
    """The name or builder of what a policy observes; None if it looks at the world alone."""
    if isinstance(policy, ChoosesObservation):
        return policy.observation
    return None


def checked_action(env: Any, action: object) -> FloatArray:
    """``action`` in the action space of ``env``, within its bounds.

    Raises:
        InvalidActionError: if it is no twist, wheel speeds or finite array of the right shape.
    """
    if not isinstance(action, Twist | WheelSpeeds):
        shape = env.action_space.shape
        try:
            values = np.asarray(action, dtype=np.float64)
        except (TypeError, ValueError):
            raise InvalidActionError(
                f"an action is a Twist, WheelSpeeds or an array of shape {shape}, "
                f"got {type(action).__name__} {action!r:.60}"
            ) from None
        if values.shape != shape:
            raise InvalidActionError(f"an action has shape {shape} here, got {values.shape}")
        if not np.isfinite(values).all():
            raise InvalidActionError(f"an action must be finite, got {values.tolist()}")
        action = values
    try:
        command: FloatArray = env.encode(action)
    except InvalidInputError as error:
        raise InvalidActionError(str(error)) from error
    return command


def plan_times(policy: Policy) -> list[float] | None:
    """Wall-clock time of each planning call since the reset [s]; None if no log is kept."""
    if not isinstance(policy, LogsPlans):
        return None
    return [float(result.stats.wall_time_s) for result in policy.plan_log]
