"""Abilities of a `Policy` beside ``reset`` and ``act``: small contracts, all of them optional.

Whoever runs a policy asks ``isinstance(policy, LogsPlans)``; a policy has an ability by having the
attributes, without inheriting anything. ``docs/extending.md`` shows each.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol, TypeVar, runtime_checkable

from pushplan.world.plan import Plan, PlanResult
from pushplan.world.protocols import HasAttributes
from pushplan.world.stop import Stop

T = TypeVar("T")
Result = TypeVar("Result", covariant=True)


class PendingResult(Protocol[Result]):
    """The result that a planning call will have."""

    def ready(self, time: float) -> bool:
        """True if it is there, or the call has failed, by the clock of the world [s]."""

    def result(self) -> Result:
        """It.

        Raises:
            Exception: what the call raised.
        """

    def abandon(self) -> None:
        """Nobody waits for it any more: end the call, or never begin it."""


class PlanningExecutor(Protocol):
    """Runs the planning calls of a policy that `PlansBesideDriving`."""

    @property
    def takes_time(self) -> bool:
        """True if the robot drives on while a call runs."""

    def expected(self, stop: Stop | None) -> float:
        """Return the time that the next call will take by the world's clock [s]; 0 if unknown.

        Args:
            stop: its stop rule.
        """

    def submit(
        self, call: Callable[[Stop | None], T], time: float, stop: Stop | None = None
    ) -> PendingResult[T]:
        """Run a call.

        Args:
            call: takes the stop rule that it has to obey; None for its own.
            time: now, by the clock of the world [s].
            stop: its stop rule, which the executor may make stricter.
        """


@runtime_checkable
class ChoosesActions(HasAttributes, Protocol):
    """Names the action modes that it can drive in.

    A policy without it gets the first mode of the task; if the first action is then a `Twist` or
    `WheelSpeeds`, which that mode does not take, the first mode that does.
    """

    @property
    def actions(self) -> Sequence[str]:
        """Names of action modes, the preferred one first; the first that the task has is taken."""


def action_modes(policy: object) -> tuple[str, ...]:
    """The action modes that a policy names, the preferred one first; none where it names none."""
    if isinstance(policy, ChoosesActions):
        return tuple(policy.actions)
    return ()


@runtime_checkable
class ChoosesObservation(HasAttributes, Protocol):
    """Decides on what the environment observes; a policy without it looks at the `World` alone."""

    @property
    def observation(self) -> Any:
        """Name of an observation of the task, or a `pushplan.observation.ObservationBuilder`."""


@runtime_checkable
class ChecksEnvironment(HasAttributes, Protocol):
    """Is made for some environments only, as a trained network is."""

    def check_environment(self, env: Any, scenario: Any = None) -> None:
        """Refuse an environment.

        Args:
            env: a `pushplan.envs.PushEnv`, before its first reset.
            scenario: what it was made for, if known.

        Raises:
            InvalidInputError: naming what the policy needs and what the environment has.
        """


@runtime_checkable
class ChecksScenario(HasAttributes, Protocol):
    """Knows without an environment which scenarios it is made for."""

    def incompatibility(self, scenario: Any) -> str | None:
        """The reason why it cannot run a scenario; None if it may."""


@runtime_checkable
class HoldsDecisions(HasAttributes, Protocol):
    """Decides every few steps and keeps to what it decided in between."""

    @property
    def steps_per_decision(self) -> int:
        """Steps for which a decision stands, at least 1."""


@runtime_checkable
class PlansBesideDriving(HasAttributes, Protocol):
    """Can plan while the robot drives on: on a robot, and in latency-aware simulation."""

    def plan_with(self, executor: PlanningExecutor) -> None:
        """Run planning calls by an executor until the next ``reset``.

        Args:
            executor: ``act`` gives it every call that may take long, and returns without waiting
                for the result.
        """


@runtime_checkable
class ExpectsNoise(HasAttributes, Protocol):
    """Can be told how noisy the poses are that it gets, and asks for no more precision then."""

    def expect_noise(self, position: float, heading: float) -> None:
        """Take it into account from the next ``reset`` on.

        Args:
            position: standard deviation of every x and y [m].
            heading: the same of every heading [rad].
        """


@runtime_checkable
class LogsPlans(HasAttributes, Protocol):
    """Keeps what its planner returned."""

    @property
    def plan_log(self) -> Sequence[PlanResult]:
        """Every planning call since the last ``reset``."""


@runtime_checkable
class ShowsPlan(HasAttributes, Protocol):
    """Has a plan that a picture can show."""

    @property
    def current_plan(self) -> Plan | None:
        """The plan that is being driven; None while there is none."""


def shown_plan(policy: object) -> Plan | None:
    """The plan that a policy is driving; None where it has none, or does not show it."""
    if isinstance(policy, ShowsPlan):
        return policy.current_plan
    return None
