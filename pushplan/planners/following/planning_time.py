"""`PlanningTime`: how long planning calls take, by the clock of the world."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

import numpy as np

from pushplan.world import PlanResult, Stop
from pushplan.world.checks import number

_REMEMBERED = 5  # planning calls whose times say how long the next one will take


class PlanningTime:
    """Nothing, until it is simulated; then what calls take, times a factor."""

    def __init__(self) -> None:
        self._factor, self._clock = 0.0, time.perf_counter
        self._took: deque[float] = deque(maxlen=_REMEMBERED)
        self.own = 0.0
        """What the last call took of the time of the computer, where that is simulated [s]."""

    def simulate(self, factor: float, clock: Callable[[], float]) -> None:
        """From now on calls take time: ``factor`` seconds of the world for one of ``clock``."""
        self._factor, self._clock = number("factor", factor, low=0.0), clock

    def expected(self, stop: Stop | None) -> float:
        """How long the next call will take [s]: what the last ones took, or else its budget."""
        if self._factor == 0.0:
            return 0.0
        budget = np.inf if stop is None else stop.seconds
        if self._took:
            return self._factor * min(budget, max(self._took))
        return self._factor * budget if np.isfinite(budget) else 0.0

    def measure(self, call: Callable[[], PlanResult]) -> tuple[PlanResult, float]:
        """The result of a call, and how long it took [s]."""
        began = self._clock()
        result = call()
        took = self._clock() - began
        if self._factor > 0.0:
            self.own = took
            self._took.append(took)
        return result, self._factor * took
