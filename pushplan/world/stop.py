"""When a planner has to return. Rules compose with ``|``: the first to fire ends the call.

A rule is plain data and may be used for any number of calls. A planner arms it with `start`
at the beginning of each call and asks the running check once per iteration.
"""

from __future__ import annotations

import math
import threading
import time
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pushplan.errors import InvalidInputError
from pushplan.world.checked_fields import CheckedFields, NonNegativeFloat, NonNegativeInt
from pushplan.world.checks import expect

_WITHOUT_PLAN = 3
"""Default budgets that a planner may spend on its first plan."""


class StopCheck(Protocol):
    """A rule that has been armed for one planning call."""

    def __call__(self, iterations: int, cost: float) -> bool:
        """Return True if the planner has to return now.

        Args:
            iterations: main-loop iterations so far.
            cost: what the planner minimises, for its best plan so far, such as travel plus weighted
                interaction [kg m]; infinite while there is none.
        """


class Stop(ABC):
    """A rule that says when a planning call has to return."""

    @abstractmethod
    def start(self) -> StopCheck:
        """Arm the rule for one call."""

    def __or__(self, other: Stop) -> Stop:
        if not isinstance(other, Stop):
            return NotImplemented  # Python then raises the TypeError of an operator
        return AnyOf((*rules_of(self), *rules_of(other)))

    @property
    def seconds(self) -> float:
        """Wall-clock budget of the rule [s], infinite if it has none."""
        return math.inf

    @property
    def cancelled(self) -> bool:
        """True if a cancellation token in the rule has been used."""
        return False


@dataclass(frozen=True)
class Deadline(Stop, CheckedFields):
    """Return after this much wall-clock time.

    Args:
        budget_s: seconds from the beginning of the call, not negative.
    """

    field_prefix = "Deadline "

    budget_s: NonNegativeFloat

    @property
    def seconds(self) -> float:
        """The budget [s]."""
        return self.budget_s

    def start(self) -> StopCheck:
        """Arm the rule: the clock starts now."""
        end = time.perf_counter() + self.budget_s
        return lambda iterations, cost: time.perf_counter() >= end


@dataclass(frozen=True)
class MaxIterations(Stop, CheckedFields):
    """Return after this many main-loop iterations: the same result on every machine."""

    field_prefix = "MaxIterations "

    limit: NonNegativeInt

    def start(self) -> StopCheck:
        """Arm the rule for one call."""
        return lambda iterations, cost: iterations >= self.limit


@dataclass(frozen=True)
class DefaultBudget(Stop):
    """A number of iterations, and three times as many while there is no plan."""

    iterations: int

    def start(self) -> StopCheck:
        """Arm the rule for one call."""
        longest = _WITHOUT_PLAN * self.iterations
        return lambda done, cost: done >= (longest if cost == math.inf else self.iterations)


@dataclass(frozen=True)
class OwnBudget(Stop):
    """Return when the planner would without a rule; for `OwnBudget() | Deadline(1.0)`.

    A planner that ends by itself has no such budget: the other rules alone end it.
    """

    def start(self) -> StopCheck:
        """Arm the rule for one call; `PlanningCall` has put the budget beside it."""
        return lambda iterations, cost: False


@dataclass(frozen=True)
class FirstSolution(Stop):
    """Return as soon as there is a plan."""

    def start(self) -> StopCheck:
        """Arm the rule for one call."""
        return lambda iterations, cost: cost < math.inf


class Cancellation(Stop):
    """A token that another thread may use to end the call, and every later one.

    Example:
        >>> token = Cancellation()
        >>> rule = Deadline(1.0) | token
        >>> token.cancel()
        >>> rule.cancelled
        True
    """

    def __init__(self) -> None:
        self._event = threading.Event()

    def cancel(self) -> None:
        """End the calls that use this token."""
        self._event.set()

    @property
    def cancelled(self) -> bool:
        """True once `cancel` was called."""
        return self._event.is_set()

    def start(self) -> StopCheck:
        """Arm the rule for one call."""
        return lambda iterations, cost: self._event.is_set()


class AnyOf(Stop):
    """Return when any of the rules says so; what ``|`` makes."""

    def __init__(self, rules: tuple[Stop, ...]) -> None:
        if not rules or not all(isinstance(rule, Stop) for rule in rules):
            raise InvalidInputError(f"AnyOf needs stop rules, got {rules!r}")
        self.rules = rules

    @property
    def seconds(self) -> float:
        """The least budget among the rules [s]."""
        return min(rule.seconds for rule in self.rules)

    @property
    def cancelled(self) -> bool:
        """True if any token among the rules was used."""
        return any(rule.cancelled for rule in self.rules)

    def start(self) -> StopCheck:
        """Arm the rule for one call."""
        checks = [rule.start() for rule in self.rules]
        return lambda iterations, cost: any(check(iterations, cost) for check in checks)


def rules_of(stop: Stop) -> tuple[Stop, ...]:
    """The rules that one is made of."""
    return stop.rules if isinstance(stop, AnyOf) else (stop,)


def wants_own_budget(stop: Stop | None) -> bool:
    """Return True if a call ends where the planner would without a rule, too."""
    return stop is None or any(isinstance(rule, OwnBudget) for rule in rules_of(stop))


def check_rules(stop: object, rng: object) -> tuple[Stop | None, np.random.Generator | None]:
    """Check the types of a stop rule and a generator, each of which may be None; return them.

    Raises:
        InvalidInputError: naming the argument and the type that it must have.
    """
    rule: Stop | None = None
    if stop is not None:
        rule = expect("stop", stop, Stop)  # type: ignore[type-abstract]
    generator: np.random.Generator | None = None
    if rng is not None:
        generator = expect("rng", rng, np.random.Generator)
    return rule, generator
