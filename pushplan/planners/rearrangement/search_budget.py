"""`SearchBudget`: how long the search for the next push goes on."""

from __future__ import annotations

import math
from collections.abc import Callable

from pushplan.world import Stop

_HARDEST = 10
"""Budgets after which the search is over, which only searches for relocations come to."""
_PART = 5
"""Budgets for one of them: less than are left when the first begins, so that each decision gets
to the end of one at least and the next decision need not begin with it again."""


class SearchBudget:
    """Counts simulated pushes of one decision; ends the search between two of them.

    It has no end until `start` gives it one.

    Attributes:
        used: simulated pushes so far.
        cost: of the best order so far [m]; infinite while there is none.
        interrupted: something was left out because of the budget.
    """

    def __init__(self) -> None:
        self._check: Callable[[int, float], bool] | None = None
        self._most = math.inf
        self._over = False
        self.used = 0
        self.cost = math.inf
        self.interrupted = False
        self._part_began = 0

    def start(self, stop: Stop | None, most: float) -> None:
        """Begin the search.

        Args:
            stop: its stop rule; None for no end.
            most: after so many simulated pushes no further ones are looked for; after `_HARDEST`
                times as many the search is over.
        """
        self._check = None if stop is None else stop.start()
        self._most = most

    @property
    def is_over(self) -> bool:
        """True if the search has to return."""
        stopped = self._check is not None and self._check(self.used, self.cost)
        if stopped or self.used >= _HARDEST * self._most:
            self._over = self.interrupted = True
        return self._over

    def start_part(self) -> None:
        """Begin a part of the search that has a limit of its own."""
        self._part_began = self.used

    @property
    def part_is_over(self) -> bool:
        """True if the part of the search in hand has to end."""
        return self.is_over or self.used - self._part_began >= _PART * self._most

    @property
    def is_used_up(self) -> bool:
        """True if the budget is used up, so that one of the known pushes has to be chosen."""
        if self.is_over or self.used >= self._most:
            self.interrupted = True
            return True
        return False
