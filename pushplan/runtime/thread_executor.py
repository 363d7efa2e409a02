"""`ThreadExecutor`: planning calls in threads of their own, one after another."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from pushplan.control.executors import ExpectedTime
from pushplan.world import Cancellation, OwnBudget, PushplanError, Stop
from pushplan.world.errors import describe

T = TypeVar("T")


class PlanningError(PushplanError):
    """A planning call raised, or its thread has died; the cause is attached."""


class ThreadExecutor:
    """Runs each planning call in a new thread, once the call before has ended.

    A thread that dies takes its own call along and no other.

    Args:
        stop: rule that every call has to obey beside its own.
        clock: returns seconds; what calls take is measured by it.

    Attributes:
        latest: the call that was submitted last; None before the first.
    """

    takes_time = True

    def __init__(self, stop: Stop, clock: Callable[[], float]) -> None:
        self._stop, self._clock = stop, clock
        self._took = ExpectedTime()
        self.latest: ThreadCall[Any] | None = None

    def expected(self, stop: Stop | None) -> float:
        """What the slowest of the last calls took, or else the budget [s]."""
        return self._took.of(self._stop if stop is None else stop | self._stop)

    def submit(
        self, call: Callable[[Stop | None], T], time: float, stop: Stop | None = None
    ) -> ThreadCall[T]:
        """See `pushplan.world.PlanningExecutor`."""
        rule = (OwnBudget() if stop is None else stop) | self._stop
        before = None if self.latest is None else self.latest.thread

        def run(rule: Stop) -> T:
            if before is not None:
                before.join()
            began = self._clock()
            result = call(rule)
            self._took.add(self._clock() - began)
            return result

        self.latest = pending = ThreadCall(run, rule, self._clock())
        return pending

    @property
    def running_s(self) -> float:
        """For how long the call that was submitted last has been running [s]; 0 if none is."""
        call = self.latest
        return self._clock() - call.began if call is not None and call.thread.is_alive() else 0.0

    def close(self, timeout: float) -> bool:
        """End the call that runs.

        Args:
            timeout: how long to wait for that [s].

        Returns:
            Whether no thread is left.
        """
        if self.latest is None:
            return True
        self.latest.abandon()
        self.latest.thread.join(timeout)
        return not self.latest.thread.is_alive()


class ThreadCall(Generic[T]):
    """A call in a thread of its own.

    Args:
        call: takes the stop rule.
        stop: the rule; the call is cancelled when it is abandoned, too.
        began: when it was asked for, by the clock of the executor [s].
    """

    def __init__(self, call: Callable[[Stop], T], stop: Stop, began: float) -> None:
        self.began = began
        self._token = Cancellation()
        self._call, self._rule = call, stop | self._token
        self._result: T | None = None
        self._error: BaseException | None = None
        self._done = False
        self.thread = threading.Thread(target=self._run, name="pushplan planning", daemon=True)
        self.thread.start()

    def _run(self) -> None:
        try:
            if not self._token.cancelled:
                self._result = self._call(self._rule)
                self._done = True
        except BaseException as error:  # of any kind: nobody else would see it
            self._error = error

    def ready(self, time: float) -> bool:
        """Whether the call has ended, in whatever way."""
        return self._done or not self.thread.is_alive()

    def result(self) -> T:
        """What it returned.

        Raises:
            PlanningError: if it raised, or did not come to its end.
        """
        if self._done:
            return self._result  # type: ignore[return-value]
        why = "its thread died" if self._error is None else describe(self._error)
        raise PlanningError(f"planning failed: {why}") from self._error

    def abandon(self) -> None:
        """Cancel it."""
        self._token.cancel()
