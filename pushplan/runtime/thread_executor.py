"""`ThreadExecutor`: planning calls in a thread of their own, one after another."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Callable
from queue import SimpleQueue
from traceback import format_tb
from typing import Any, Generic, TypeVar

from pushplan.control.executors import ExpectedTime
from pushplan.errors import describe, refuse_copy
from pushplan.world import Cancellation, OwnBudget, PushplanError, Stop

T = TypeVar("T")


class PlanningError(PushplanError):
    """A planning call raised, or was abandoned; the cause is attached."""


class ThreadExecutor:
    """Runs planning calls one after another in a thread of its own.

    A call that ends its thread takes no other call along: the next one has a new thread.

    Args:
        stop: rule that every call has to obey beside its own.
        clock: returns seconds; what calls take is measured by it.

    """

    takes_time = True
    __reduce_ex__ = refuse_copy

    def __init__(self, stop: Stop, clock: Callable[[], float]) -> None:
        self._stop = stop
        self._clock = clock
        self._took = ExpectedTime()
        self._worker = _Worker()
        weakref.finalize(self, self._worker.calls.put, None)  # an executor that nobody closes
        self._open: list[ThreadCall[Any]] = []

    def expected(self, stop: Stop | None) -> float:
        """Return the longest of the last calls, or else the budget [s]."""
        return self._took.of(self._stop if stop is None else stop | self._stop)

    def submit(
        self, call: Callable[[Stop | None], T], time: float, stop: Stop | None = None
    ) -> ThreadCall[T]:
        """See `pushplan.world.PlanningExecutor`."""
        rule = (OwnBudget() if stop is None else stop) | self._stop

        def run(rule: Stop) -> T:
            began = self._clock()
            result = call(rule)
            if not rule.cancelled:  # one that was cut short says nothing about the next
                self._took.add(self._clock() - began)
            return result

        pending = ThreadCall(run, rule, self._clock())
        self._open = [*self._running(), pending]
        if not self._worker.is_alive:
            self._worker.start()
        self._worker.calls.put(pending)
        return pending

    @property
    def is_busy(self) -> bool:
        """True if a call has not ended yet."""
        return bool(self._running())

    @property
    def running_s(self) -> float:
        """For how long the oldest call that has not ended has been there [s]; 0 without one."""
        calls = self._running()
        return self._clock() - calls[0].began if calls else 0.0

    def _running(self) -> list[ThreadCall[Any]]:
        """The calls that have not ended, the oldest first."""
        calls = [call for call in self._open if not call.ended]
        if calls and not self._worker.is_alive:  # it was ended between calls, from outside
            for call in calls:
                call.lose()
            return []
        return calls

    def abandon(self) -> None:
        """End the call that runs, and never begin those that wait."""
        for call in self._open:
            call.abandon()

    def close(self, timeout: float) -> bool:
        """End the call that runs, and the thread.

        Args:
            timeout: how long to wait for that [s].

        Returns:
            True if no thread is left.
        """
        self.abandon()
        return self._worker.end(timeout)


class _Worker:
    """A thread that runs calls one after another, and ends with a call that is None."""

    def __init__(self) -> None:
        self.calls: SimpleQueue[ThreadCall[Any] | None] = SimpleQueue()
        self._thread: threading.Thread | None = None

    @property
    def is_alive(self) -> bool:
        return self._thread is not None and self._thread.is_alive()

    def start(self) -> None:
        thread = threading.Thread(target=self._work, name="pushplan planning", daemon=True)
        thread.start()
        self._thread = thread  # only now: until then the one before counts as alive

    def _work(self) -> None:
        while (call := self.calls.get()) is not None:
            if not call.run():
                self.start()  # the rest is for another thread
                return

    def end(self, timeout: float) -> bool:
        """End the thread, and return True if none is left after so long [s]."""
        if self._thread is not None and self._thread.is_alive():
            self.calls.put(None)
            self._thread.join(timeout)
        return not self.is_alive


class ThreadCall(Generic[T]):
    """A call that a thread runs.

    Args:
        call: takes the stop rule.
        stop: the rule; the call is cancelled when it is abandoned, too.
        began: when it was asked for, by the clock of the executor [s].

    Attributes:
        ended: it is over, in whatever way.
    """

    def __init__(self, call: Callable[[Stop], T], stop: Stop, began: float) -> None:
        self.began = began
        self.ended = False
        self._token = Cancellation()
        self._call = call
        self._rule = stop | self._token
        self._result: T | None = None
        self._error: BaseException | None = None
        self._done = False

    def run(self) -> bool:
        """Run it, unless it was abandoned; False where that was meant to end the thread."""
        try:
            if not self._token.cancelled:
                self._result = self._call(self._rule)
                self._done = True
        except BaseException as error:  # of any kind: nobody else would see it
            error.add_note("".join(format_tb(error.__traceback__)))
            self._error = error.with_traceback(None)  # whose frames keep the worlds of the call
        finally:
            self.ended = True
        return self._error is None or isinstance(self._error, Exception)

    def ready(self, time: float) -> bool:
        """Return True if the call has ended, in whatever way."""
        return self.ended

    def result(self) -> T:
        """Return the result of the call.

        Raises:
            PlanningError: if it raised, or did not come to its end.
        """
        if self._done:
            return self._result  # type: ignore[return-value]
        why = "it was abandoned"
        if self._error is not None:
            why = describe(self._error)
        raise PlanningError(f"planning failed: {why}") from self._error

    def abandon(self) -> None:
        """Cancel it."""
        self._token.cancel()

    def lose(self) -> None:
        """Take it that its thread has died and that it will never end."""
        self._error = RuntimeError("its thread has died")
        self.ended = True
        self.abandon()
