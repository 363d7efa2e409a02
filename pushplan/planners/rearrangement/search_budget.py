"""`SearchBudget`: what is left of the stop rule and of the rollouts of one decision."""

from __future__ import annotations

import math

from pushplan.world import Stop

_HARDEST = 10


class SearchBudget:
    """Counts simulated pushes; ends the search between two of them.

    Args:
        stop: the stop rule; None for no end.
        most: after so many simulated pushes no further ones are looked for; after `_HARDEST` times
            as many the search is over, which only searches for relocations come to.

    Attributes:
        used: simulated pushes so far.
        cost: of the best order so far [m]; infinite while there is none.
        interrupted: whether something was left out because of the budget.
    """

    def __init__(self, stop: Stop | None = None, most: float = math.inf) -> None:
        self._check = None if stop is None else stop.start()
        self._most, self._over = most, False
        self.used, self.cost, self.interrupted = 0, math.inf, False

    @property
    def is_over(self) -> bool:
        """Whether the search has to return."""
        if self._check is not None and self._check(self.used, self.cost):
            self._over = self.interrupted = True
        if self.used >= _HARDEST * self._most:
            self._over = self.interrupted = True
        return self._over

    @property
    def is_used_up(self) -> bool:
        """Whether to choose among the pushes that are known."""
        if self.is_over or self.used >= self._most:
            self.interrupted = True
            return True
        return False
