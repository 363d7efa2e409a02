"""Executors of planning calls that need no thread: the world waits, or time is simulated."""

from __future__ import annotations

import math
import time as wall
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

from pushplan.world import OwnBudget, Stop
from pushplan.world.checks import number

T = TypeVar("T")
_REMEMBERED = 5  # calls whose times say how long the next one will take


class _Done(Generic[T]):
    """A result that is there from a time on."""

    def __init__(self, result: T, ready_at: float) -> None:
        self._result = result
        self._ready_at = ready_at

    def ready(self, time: float) -> bool:
        return time >= self._ready_at - 1e-9

    def result(self) -> T:
        return self._result

    def abandon(self) -> None:
        pass


class ExpectedTime:
    """Estimate of the duration of the next planning call, from the last ones."""

    def __init__(self) -> None:
        self._took: deque[float] = deque(maxlen=_REMEMBERED)

    def add(self, seconds: float) -> None:
        """A call has taken so long [s]."""
        self._took.append(seconds)

    def of(self, stop: Stop | None) -> float:
        """Return the longest of the last calls, within the budget [s]; else the budget, or 0."""
        budget = math.inf if stop is None else stop.seconds
        if self._took:
            return min(budget, max(self._took))
        return budget if math.isfinite(budget) else 0.0


class ImmediateExecutor:
    """Runs calls at once, and takes it that they take no time: the world stands still meanwhile.

    Args:
        rule: ends each call, beside its own rule.
    """

    takes_time = False

    def __init__(self, rule: Stop | None = None) -> None:
        self._rule = rule

    def expected(self, stop: Stop | None) -> float:
        """Nothing."""
        return 0.0

    def submit(
        self, call: Callable[[Stop | None], T], time: float, stop: Stop | None = None
    ) -> _Done[T]:
        """See `pushplan.world.PlanningExecutor`."""
        if self._rule is not None:
            stop = (OwnBudget() if stop is None else stop) | self._rule
        return _Done(call(stop), -math.inf)


class DelayedExecutor(ImmediateExecutor):
    """Runs calls at once; their results are there a fixed time later, by the clock of the worlds.

    So a loop repeats to the byte, if seeds are the same and rules count iterations: a plan that is
    asked for at step k of a loop of period T arrives at step k + n with a delay of n T.

    Args:
        delay: what every call takes [s].
        rule: ends each call, beside its own rule.
    """

    takes_time = True

    def __init__(self, delay: float, rule: Stop | None = None) -> None:
        super().__init__(rule)
        self._delay = number("delay", delay, low=0.0)

    def expected(self, stop: Stop | None) -> float:
        """The delay [s]."""
        return self._delay

    def submit(
        self, call: Callable[[Stop | None], T], time: float, stop: Stop | None = None
    ) -> _Done[T]:
        """See `pushplan.world.PlanningExecutor`."""
        return _Done(super().submit(call, time, stop).result(), time + self._delay)


class SimulatedExecutor:
    """Runs calls at once; their results are there after the time that they would have taken.

    Args:
        factor: seconds of the world's clock for one of ``clock``.
        clock: returns seconds; what a call takes is measured by it.

    Attributes:
        spent: what all calls together have taken by ``clock`` [s].
    """

    takes_time = True

    def __init__(self, factor: float, clock: Callable[[], float] = wall.perf_counter) -> None:
        self._factor = number("factor", factor, low=0.0)
        self._clock = clock
        self._took = ExpectedTime()
        self.spent = 0.0

    def expected(self, stop: Stop | None) -> float:
        """Return the duration of the last calls, or else the budget of the rule [s]."""
        return self._factor * self._took.of(stop) if self._factor else 0.0

    def submit(
        self, call: Callable[[Stop | None], T], time: float, stop: Stop | None = None
    ) -> _Done[T]:
        """See `pushplan.world.PlanningExecutor`."""
        began = self._clock()
        result = call(stop)
        took = self._clock() - began
        self._took.add(took)
        self.spent += took
        return _Done(result, time + self._factor * took)
