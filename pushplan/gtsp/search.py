"""Anytime search: annealed ruin and recreate from several random orders, then from the best."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from pushplan.core import gtsp as core
from pushplan.gtsp.gtsp_config import GtspConfig
from pushplan.gtsp.problem import Problem, StopFired, tour_cost
from pushplan.world.checks import IntArray
from pushplan.world.stop import MaxIterations, Stop, StopCheck, rules_of

MOST_ROUNDS = 2000
NARROW_ROUNDS = 1000
"""Rounds without which nothing is known of how promising a node is."""
NARROW_S = 1e-7
"""Time that it takes to go on with fewer nodes at most, for each pair of nodes [s]."""
_NEIGHBOURS = 12  # clusters on the list of each one; a third more where costs differ both ways
_SWAP_NEIGHBOURS = 8  # of these, so many are tried by a segment swap
_MOST_REMOVED = 20  # clusters that a round takes out
_REMOVED_FRACTION = 0.3  # the same, as a fraction of all clusters (but at least 4)
# temperatures, in units of a mean reduced arc of the tour
_COLD = 0.03  # at the end of a run
_REHEAT = 2.0
"""Temperature at which a run from the best tour begins, times that at which it was found."""
_NARROW_AFTER = 0.3  # fraction of the first run after which only promising nodes are kept


@dataclass
class Budget:
    """Budget of a call, and the part of it that is used."""

    check: StopCheck  # the armed stop rule
    began: float  # when the call began, of `time.perf_counter` [s]
    seconds: float  # wall-clock budget [s], infinite if none
    rounds: float  # budget of rounds, infinite if none
    used: int = 0  # rounds so far
    cost: float = np.inf  # of the best tour so far
    best_s: float = np.nan  # when it was found, since the beginning of the call [s]

    @staticmethod
    def start(stop: Stop | None, iterations: int) -> Budget:
        """Arm the stop rule of a call."""
        began = time.perf_counter()
        stop = MaxIterations(iterations) if stop is None else stop
        limits = [rule.limit for rule in rules_of(stop) if isinstance(rule, MaxIterations)]
        rounds = float(min(limits, default=np.inf))
        if stop.seconds == rounds == np.inf:
            rounds = float(iterations)
        return Budget(stop.start(), began, stop.seconds, rounds)

    @property
    def elapsed(self) -> float:
        """Time since the call began [s]."""
        return time.perf_counter() - self.began

    def note(self, cost: float) -> None:
        """A tour of this cost was found."""
        if cost < self.cost:
            self.cost = cost
            self.best_s = self.elapsed

    def gone(self) -> float:
        """Fraction of the budget that is used."""
        by_time = self.elapsed / self.seconds if self.seconds > 0.0 else 1.0
        return max(by_time, self.used / self.rounds if self.rounds > 0.0 else 1.0)

    def stopped(self) -> bool:
        """Return True if the search has to return now."""
        return self.used >= self.rounds or self.check(self.used, self.cost)


class AnytimeSearch:
    """The state of a search, which may be continued."""

    def __init__(
        self,
        problem: Problem,  # with at least 3 clusters
        config: GtspConfig,
        seed: int,  # of the random numbers, not 0
        budget: Budget,  # of the call
    ) -> None:
        self.config = config
        self.budget = budget
        self.floor = problem.floor
        fraction = max(4, int(_REMOVED_FRACTION * problem.count))
        self.max_removed = max(1, min(_MOST_REMOVED, fraction, problem.count - 2))
        self.best_heat = _COLD
        self.pace = 3e-5 + 3e-7 * problem.width**2
        self.narrowed = False
        rest = np.delete(np.arange(problem.count), problem.root)
        self.problem = problem
        self.tour = core.RuinRecreate(
            _arrays(problem),
            np.concatenate(([problem.root], rest)),
            seed,
            self.max_removed,
            config.blink,
            _SWAP_NEIGHBOURS,
        )

    def run(
        self,
        begin: float,  # fraction of the budget that is gone when the tour is hottest
        end: float,  # fraction that is gone when it is coldest, where the run ends at the latest
        again: bool = False,  # from the best order, not as hot
    ) -> None:
        """One annealing until it is frozen, from a random order or again from the best one."""
        config = self.config
        budget = self.budget
        tour = self.tour
        lowest = np.inf
        frozen = 0.0
        first = not again
        hot = config.hot
        cold = _COLD
        if again:
            tour.start_from_best()
            hot = _REHEAT * self.best_heat
            cold = 0.5 * config.frozen * self.best_heat
        else:
            self._random_start()
        while not budget.stopped():
            gone = budget.gone()
            if gone >= end and np.isfinite(tour.best_cost):
                break
            progress = min(max((gone - begin) / (end - begin), 0.0), 1.0)
            heat = hot * (cold / hot) ** progress
            before = tour.best_cost
            if progress > _NARROW_AFTER and not self.narrowed:
                self._narrow(heat * self.scale)
            self._rounds(0.0 if first else heat * self.scale)
            if tour.best_cost < before and not first:
                self.best_heat = heat
            first = False
            if tour.cost < lowest - 1e-9 * abs(tour.cost):  # not by rounding alone
                lowest = tour.cost
                frozen = config.frozen * heat
            elif heat < frozen:
                break

    def _narrow(self, temperature: float) -> None:
        """Go on with nodes that good tours may use, judged by the tours so far.

        Only where clusters are wide, enough is known, and setting up anew fits into the budget.
        """
        config = self.config
        problem = self.problem
        tour = self.tour
        nodes = len(problem.names)
        sizes = np.diff(problem.offsets)
        if (
            float(sizes @ sizes) < config.narrow_from * nodes
            or self.budget.used < NARROW_ROUNDS
            or NARROW_S * nodes**2 >= 0.5 * self.budget.seconds
        ):
            return
        good = tour.least_slack <= config.narrow_slack * temperature
        total = tour.total_slack
        for members in problem.members:
            if good[members].sum() > config.narrow_width:
                score = np.where(good[members], total[members], np.inf)
                worst = np.argsort(score, kind="stable")[config.narrow_width :]
                good[members[worst]] = False
        good[tour.nodes] = good[tour.best_nodes] = True
        kept = np.flatnonzero(good)
        fewer = problem.only(kept)
        try:
            arrays = _arrays(fewer)
        except StopFired:
            return
        self.problem = fewer
        tour.narrow(arrays, kept)
        self.narrowed = True

    def runs_in(self, fraction: float) -> int:
        """Return the number of runs for which a fraction of the budget suffices."""
        rounds = self.budget.rounds
        if rounds == np.inf:
            self.run(0.0, 1e-9)  # one piece, for the pace
            rounds = self.budget.seconds / self.pace
        wanted = self.config.run_rounds * self.problem.count**2
        return int(min(max(fraction * rounds / wanted, 1.0), self.config.restarts))

    @property
    def scale(self) -> float:
        """Mean reduced arc of the best tour."""
        spread = (self.tour.best_cost - self.floor) / self.problem.count
        return float(spread) if np.isfinite(spread) else 0.0

    def _rounds(self, temperature: float) -> None:
        config = self.config
        budget = self.budget
        tour = self.tour
        rounds = int(min(max(config.chunk_s / self.pace, 1.0), MOST_ROUNDS))
        if budget.rounds < np.inf:  # the same pieces on every machine
            rounds = max(1, int(min(100, budget.rounds // 200, budget.rounds - budget.used)))
        began = time.perf_counter()
        tolerance = 1e-12 * max(abs(tour.best_cost), abs(tour.cost))
        tour.run(temperature, tolerance, rounds)
        self.pace = 0.5 * self.pace + 0.5 * (time.perf_counter() - began) / rounds
        budget.used += rounds
        self._note_best()

    def _note_best(self) -> None:
        if self.tour.best_cost < self.budget.cost:
            self.budget.note(tour_cost(self.problem.costs, self.tour.best_nodes))

    def begin_with(self, order: IntArray) -> None:
        """Make an order of the clusters, with its cheapest nodes, the best one so far."""
        self.tour.start(np.roll(order, -int((order == self.problem.root).argmax())))
        self._note_best()

    def _random_start(self) -> None:
        problem = self.problem
        tour = self.tour
        rng = np.random.default_rng(tour.random_state + self.budget.used)
        others = np.delete(np.arange(problem.count), problem.root)
        tour.start(np.append(problem.root, rng.permutation(others)))
        self._note_best()


def _arrays(problem: Problem) -> core.Problem:
    """The problem as the core takes it."""
    near, between = problem.nearest(_NEIGHBOURS if problem.symmetric else _NEIGHBOURS * 4 // 3)
    return core.Problem(
        problem.finite,
        problem.reverse,
        problem.into,
        problem.onto,
        problem.offsets,
        near,
        between,
        problem.symmetric,
    )


def search(
    problem: Problem,
    config: GtspConfig,
    seed: int,
    budget: Budget,
    fraction: float,
    initial: IntArray | None = None,
) -> tuple[IntArray, IntArray]:
    """The best order of clusters that a fraction of the budget allows, and a node of each.

    Its tour uses a forbidden arc only if no tour without one was found. The first run begins from
    an initial order, at the temperatures of a run from the best tour.
    """
    state = AnytimeSearch(problem, config, seed, budget)
    warm = initial is not None
    if initial is not None:
        state.begin_with(initial)
    length = max(fraction - budget.gone(), 1e-9) / state.runs_in(fraction)
    left = fraction
    whole = 0.0
    runs = 0
    while (runs == 0 and initial is None) or (left > 0.0 and not budget.stopped()):
        begin = min(budget.gone(), fraction)
        left = fraction - begin
        again = warm or (runs > 0 and left < config.whole * whole / runs)
        warm = False
        state.run(begin, begin + left / max(1, round(left / length)), again)
        left = fraction - budget.gone()
        if not again:  # it may have ended early
            whole = whole + budget.gone() - begin
            runs = runs + 1
    return state.tour.best_order, state.problem.names[state.tour.best_nodes]
