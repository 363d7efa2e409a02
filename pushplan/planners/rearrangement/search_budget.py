"""`SearchBudget`: what is left of the stop rule of one decision."""

from __future__ import annotations

import math

from pushplan.world import Stop


class SearchBudget:
    """Counts simulated drives; a stop rule ends the search between two of them.

    Args:
        stop: the rule; None for no end.

    Attributes:
        used: simulated drives so far.
        cost: of the best order so far [m]; infinite while there is none.
        interrupted: whether something was left out because of the rule.
    """

    def __init__(self, stop: Stop | None = None) -> None:
        self._check = None if stop is None else stop.start()
        self.used, self.cost, self.interrupted = 0, math.inf, False

    @property
    def is_over(self) -> bool:
        """Whether the search has to return."""
        if self._check is not None and self._check(self.used, self.cost):
            self.interrupted = True
        return self.interrupted
