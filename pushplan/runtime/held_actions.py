"""`HeldActions`: a policy that decides in one go, asked beside driving."""

from __future__ import annotations

from typing import Any

import numpy as np

from pushplan.control import ImmediateExecutor
from pushplan.interaction import ContactParameters
from pushplan.planners import make_policy, policy_for
from pushplan.world import (
    ChoosesActions,
    ChoosesObservation,
    ExpectsNoise,
    InvalidInputError,
    PendingResult,
    Planner,
    PlanningExecutor,
    PlansBesideDriving,
    Policy,
    Twist,
    WheelSpeeds,
    World,
)
from pushplan.world.checks import expect, word
from pushplan.world.policy_abilities import action_modes

_TWISTS = ("velocity", "turn_rate")
_MODES = (*_TWISTS, "wheels")


class HeldActions:
    """Asks a policy again as soon as it has answered, and drives its last answer until then.

    Args:
        policy: gives velocities, from the world alone.
        hold: for how long an answer is driven at most [s]; after it the robot stands.

    Raises:
        InvalidInputError: if the policy gives other actions, or needs an observation.
    """

    def __init__(self, policy: Policy, hold: float) -> None:
        check_world_policy(policy)
        self._policy = policy
        self._hold = hold
        self.actions = tuple(mode for mode in action_modes(policy) if mode in _TWISTS) or _TWISTS
        self.plan_with(ImmediateExecutor())

    def plan_with(self, executor: PlanningExecutor) -> None:
        """See `pushplan.world.PlansBesideDriving`."""
        self._executor = executor
        self._pending: PendingResult[Any] | None = None
        self._twist = Twist(0.0, 0.0)
        self._since = -np.inf

    def expect_noise(self, position: float, heading: float) -> None:
        """See `pushplan.world.ExpectsNoise`; a policy that does not want to know is not told."""
        if isinstance(self._policy, ExpectsNoise):
            self._policy.expect_noise(position, heading)

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Forget the last episode."""
        if self._pending is not None:
            self._pending.abandon()
        self._policy.reset(world, rng)
        self.plan_with(ImmediateExecutor())

    def act(self, world: World, observation: Any = None) -> Twist:
        """The last answer, if it is not too old."""
        self._receive(world)
        if self._pending is None:
            self._pending = self._executor.submit(
                lambda stop: self._policy.act(world, None), world.time
            )
            self._receive(world)
        old = world.time - self._since > self._hold
        return Twist(0.0, 0.0) if old else self._twist

    def _receive(self, world: World) -> None:
        if self._pending is not None and self._pending.ready(world.time):
            pending = self._pending
            self._pending = None
            self._twist = twist_of(world, pending.result())
            self._since = world.time


def check_world_policy(policy: Policy) -> None:
    """Refuse a policy that gives no velocities, or needs more than the world.

    Raises:
        InvalidInputError: naming what it gives or needs, and what can be driven.
    """
    name = type(policy).__name__
    if isinstance(policy, ChoosesActions) and not set(policy.actions) & set(_MODES):
        raise InvalidInputError(
            f"a Runner drives policies with one of the actions {', '.join(_MODES)}; "
            f"{name} gives {', '.join(policy.actions)}"
        )
    if isinstance(policy, ChoosesObservation) and policy.observation is not None:
        raise InvalidInputError(
            f"a Runner drives policies that look at the World alone; {name} needs the "
            f"observation {policy.observation!r}"
        )


def twist_of(world: World, action: object) -> Twist:
    """An action as a velocity.

    Raises:
        InvalidInputError: if it is neither a `Twist` nor wheel speeds of a robot with wheels.
    """
    if isinstance(action, Twist):
        return action
    if isinstance(action, WheelSpeeds) and world.robot.wheel_separation > 0.0:
        turn = (action.right - action.left) / world.robot.wheel_separation
        return Twist(0.5 * (action.left + action.right), turn)
    raise InvalidInputError(
        f"a Runner needs a Twist, or WheelSpeeds of a robot with a wheel_separation, "
        f"got {type(action).__name__}"
    )


def drivable(policy: object, hold: float, contact: ContactParameters | None = None) -> Any:
    """Return the policy that a runner drives: one that plans beside driving.

    Args:
        policy: a policy, a planner, or the name of one.
        hold: for how long an action of a policy that plans in one go is held [s].
        contact: friction and pressure by which a policy of a name predicts pushes.

    Raises:
        InvalidInputError: if it is none of these, or does not take ``contact``.
        UnknownNameError: if there is no policy of that name.
    """
    if contact is not None:
        expect("contact", contact, ContactParameters)
        policy = make_policy(word("policy with contact", policy), interaction=contact.model())
    if isinstance(policy, str):
        policy = make_policy(policy)
    if isinstance(policy, type):
        raise InvalidInputError(f"policy must be an object, got the class {policy.__name__}")
    if isinstance(policy, Planner) and not isinstance(policy, Policy):
        policy = policy_for(policy)
    if not isinstance(policy, Policy):
        raise InvalidInputError(
            "policy must be a policy (reset and act), a planner (plan) or a name, "
            f"got {type(policy).__name__}"
        )
    if isinstance(policy, PlansBesideDriving):
        return policy
    return HeldActions(policy, hold)
