"""Where planning calls run: at once, beside driving in a simulation, or in another thread."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

from pushplan.world.stop import Stop

T = TypeVar("T")
Result = TypeVar("Result", covariant=True)


class PendingResult(Protocol[Result]):
    """What a planning call will return."""

    def ready(self, time: float) -> bool:
        """Whether it is there, or the call has failed, by the clock of the world [s]."""

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
        """Whether the robot drives on while a call runs."""

    def expected(self, stop: Stop | None) -> float:
        """How long the next call will take by the clock of the world [s]; 0 if unknown.

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
