"""`SearchBudget`: how long the search for the next push goes on."""

from __future__ import annotations

import math
import time

from pushplan.world import Stop, StopCheck

_HARDEST = 10
"""Budgets after which the search is over, which only searches for relocations come to."""
_PART = 5
"""Budgets for one of them: less than are left when the first begins, so that each decision gets
to the end of one at least and the next decision need not begin with it again."""
_ROUNDS = ((0.3, 0.3), (0.6, 0.85))
"""Rounds of a decision with a time limit: fractions of it after which no further pushes are
simulated, and after which approaches between pushes are estimated. The rest of a round is for the
order and the first push with its approach."""
_COLLECTING = 0.95  # the same fractions where the decision only collects pushes
_BEGINNING = 0.1
"""Fraction of a time limit up to which a long step begins however long it is."""


class SearchBudget:
    """Counts simulated pushes of one decision; ends the search between two of them.

    It has no end until `start` gives it one.

    Attributes:
        used: simulated pushes so far.
        cost: of the best order so far [m]; infinite while there is none.
        interrupted: something was left out because of the budget.
        seconds: time limit of the stop rule; inf if it has none.
        stopped: the time is up, so that not even a first push is looked for. Rules that count let
            it be found.
        out_of_time: a time limit has left something out.
    """

    def __init__(self) -> None:
        self.start(None, math.inf)

    def start(
        self, stop: Stop | None, most: float, *, found: bool = False, collects: bool = False
    ) -> None:
        """Begin a search, or go on with one.

        Args:
            stop: its stop rule; None for no end.
            most: after so many simulated pushes no further ones are looked for; after `_HARDEST`
                times as many the search is over.
            found: a first push is known, so that the whole time is for better ones.
            collects: the whole time is for simulating pushes.
        """
        self._check: StopCheck | None = None if stop is None else stop.start()
        self.seconds = math.inf if stop is None else stop.seconds
        self._began = time.perf_counter()
        self._most = most
        self._over = False
        self.used = 0
        self.cost = math.inf
        self.interrupted = False
        self.stopped = False
        self._part_began = 0
        self._round = len(_ROUNDS) - 1 if found else 0
        self._collects = collects
        self._late = False
        self.out_of_time = False

    @property
    def has_rule(self) -> bool:
        """True if a stop rule may end the search at any time."""
        return self._check is not None

    @property
    def is_over(self) -> bool:
        """True if the search has to return."""
        if not self._over:
            stopped = self._check is not None and self._check(self.used, self.cost)
            self._over = stopped or self.used >= _HARDEST * self._most
            self.stopped = stopped and self._elapsed >= self.seconds
            self.out_of_time |= self.stopped
            self.interrupted |= self._over
        return self._over

    @property
    def no_more_candidates(self) -> bool:
        """True if the round is to go on with the pushes that are simulated by now."""
        return self.is_used_up or self._is_late(0)

    @property
    def no_more_approaches(self) -> bool:
        """True if the round is to go on with estimates of the approaches between pushes."""
        return self.is_over or self._is_late(1)

    @property
    def time_limit(self) -> Stop | None:
        """A rule that ends another solver when the search has to return; None without a limit."""
        return _TimeLimit(self) if self.seconds < math.inf else None

    @property
    def left_s(self) -> float:
        """Rest of a time limit [s]."""
        return max(self.seconds - self._elapsed, 0.0)

    def next_round(self) -> bool:
        """Begin another round; False if the last one left nothing out, or it was the last."""
        again = self._late and not self.is_over and self._round + 1 < len(_ROUNDS)
        self._round += again
        self._late = False
        return again

    def _is_late(self, part: int) -> bool:
        fraction = _ROUNDS[self._round][part]
        if self._collects:
            fraction = _COLLECTING
        if self._elapsed >= fraction * self.seconds:
            self._late = self.interrupted = self.out_of_time = True
        return self._late

    def has_room(self, seconds: float) -> bool:
        """Return True if a step that cannot be interrupted may begin.

        Args:
            seconds: that it takes, roughly. One that takes longer than what is left waits for the
                beginning of the next decision.
        """
        if self.is_over or (seconds > self.left_s and self._elapsed > _BEGINNING * self.seconds):
            self._over = self.interrupted = self.stopped = self.out_of_time = True
        return not self._over

    @property
    def _elapsed(self) -> float:
        return time.perf_counter() - self._began

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


class _TimeLimit(Stop):
    """Fires when a decision has to return."""

    def __init__(self, budget: SearchBudget) -> None:
        self._budget = budget

    @property
    def seconds(self) -> float:
        """Rest of the time for the decision [s]."""
        return self._budget.left_s

    def start(self) -> StopCheck:
        """Arm the rule: the time of the decision runs already."""
        return lambda iterations, cost: self._budget.is_over
