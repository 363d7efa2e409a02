"""The commands of a policy, and the three contracts that everything is built on."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any, Protocol, runtime_checkable

import numpy as np

from pushplan.world.checked_fields import CheckedFields
from pushplan.world.checks import FloatArray
from pushplan.world.plan import Plan, PlanResult
from pushplan.world.scene import World
from pushplan.world.stop import Stop


@dataclass(frozen=True)
class Twist(CheckedFields):
    """Velocity command in the body frame, as ROS's ``cmd_vel``.

    Args:
        linear: forward speed [m/s].
        angular: turn rate, counter-clockwise positive [rad/s].
        lateral: speed to the left [m/s]; 0 for all but omnidirectional drives.
    """

    field_prefix = "twist."

    linear: float
    angular: float
    lateral: float = 0.0

    @property
    def course(self) -> tuple[float, float]:
        """Speed [m/s], negative straight back, and its bearing in the body frame [rad]."""
        if self.lateral == 0.0:
            return self.linear, 0.0
        return math.hypot(self.linear, self.lateral), math.atan2(self.lateral, self.linear)


@dataclass(frozen=True)
class WheelSpeeds(CheckedFields):
    """Rim speeds of the driven wheels of a differential drive [m/s]."""

    field_prefix = "wheel_speeds."

    left: float
    right: float


Action = Twist | WheelSpeeds | FloatArray


@cache
def _members(protocol: type) -> tuple[str, ...]:
    """Names of the attributes that a protocol, or one below it, asks for."""
    asking = [one for one in protocol.__mro__ if getattr(one, "_is_protocol", False)]
    return tuple(name for one in asking for name in vars(one) if not name.startswith("_"))


class _AsksTheObject(type(Protocol)):  # type: ignore[misc]
    """Checks an object for attributes as ``hasattr`` does, also those of its ``__getattr__``.

    Python does so up to 3.11 only; later versions look attributes up statically, and so miss the
    abilities of a policy that wraps another one.
    """

    def __instancecheck__(cls, instance: object) -> bool:
        if not getattr(cls, "_is_protocol", False):
            return bool(super().__instancecheck__(instance))
        return all(
            hasattr(instance, name)
            and not (callable(getattr(cls, name)) and getattr(instance, name) is None)
            for name in _members(cls)
        )


class HasAttributes(Protocol, metaclass=_AsksTheObject):
    """Base of the protocols that an object satisfies by having their attributes."""


@runtime_checkable
class Planner(HasAttributes, Protocol):
    """Finds a path for the robot in a snapshot of the world."""

    def plan(
        self,
        world: World,
        *,
        stop: Stop | None = None,
        rng: np.random.Generator | None = None,
    ) -> PlanResult:
        """Plan from ``world`` until done or until ``stop`` fires.

        Args:
            world: the snapshot; it is not changed.
            stop: when to return; the planner's own default if None. Wall clock enters only here.
            rng: the only source of randomness; a generator seeded with 0 if None.

        Returns:
            A status, and a plan where there is one. Not finding a path is a status.
        """


@runtime_checkable
class Controller(HasAttributes, Protocol):
    """Follows a plan, step by step."""

    def reset(self, world: World) -> None:
        """Forget the last episode; ``world`` is the start of the next one."""

    def command(self, world: World, plan: Plan) -> Twist:
        """The velocity to drive now, within the robot's limits.

        Args:
            world: the snapshot now. One with the time of the last gets the same command again.
            plan: the plan to follow.

        Raises:
            InvalidInputError: if the time went back since the last call, or stands still although
                things have moved.
        """


@runtime_checkable
class Policy(HasAttributes, Protocol):
    """Chooses what to do, step after step: a planner with a controller, a network, a person.

    These two methods are all that is needed. What a policy may have beside them (which actions it
    gives, what it observes, which environments it fits, whether it plans beside driving, what it
    planned) are the protocols of `pushplan.world.policy_abilities`.
    """

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Forget the last episode; ``world`` is the start of the next one."""

    def act(self, world: World, observation: Any) -> Action:
        """The action for this step.

        Args:
            world: the exact snapshot.
            observation: what the environment observed, for policies that were trained on it.
        """
