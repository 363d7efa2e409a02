"""Anytime search: annealed ruin and recreate from several random orders, then from the best."""

from __future__ import annotations

import itertools
import time
from dataclasses import dataclass, field

import numpy as np

from pushplan.gtsp.gtsp_config import GtspConfig
from pushplan.gtsp.node_choice_kernels import SPARE, best_nodes
from pushplan.gtsp.problem import Problem
from pushplan.gtsp.ruin_recreate_kernels import TourProblem, TourState, search_tours
from pushplan.world.checks import FloatArray, IntArray
from pushplan.world.stop import MaxIterations, Stop, StopCheck, rules_of

MOST_ROUNDS = 2000
NARROW_ROUNDS = 1000
"""Rounds without which nothing is known of how promising a node is."""
NARROW_S = 1e-7
"""Time that it takes to go on with fewer nodes at most, for each pair of nodes [s]."""


@dataclass
class Budget:
    """What a call may use, and how much of it is gone."""

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
        if stop is None:
            stop = MaxIterations(iterations)
        rounds = float(
            min((r.limit for r in rules_of(stop) if isinstance(r, MaxIterations)), default=np.inf)
        )
        if stop.seconds == np.inf and rounds == np.inf:
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
        """Whether to return now."""
        return self.used >= self.rounds or self.check(self.used, self.cost)


@dataclass
class AnytimeSearch:
    """The state of a search, which may be continued.

    Args:
        problem: with at least 3 clusters.
        config: parameters.
        state: (1,) uint64 of the random numbers.
    """

    problem: Problem
    config: GtspConfig
    state: IntArray
    order: IntArray = field(init=False)
    nodes: IntArray = field(init=False)
    best: IntArray = field(init=False)
    best_nodes: IntArray = field(init=False)
    values: FloatArray = field(init=False)
    kept: IntArray | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        problem, config = self.problem, self.config
        self.everything, self.root = problem, problem.root
        self._use(problem)
        fraction = max(4, int(config.removed_fraction * problem.count))
        self.most = max(1, min(config.max_removed, fraction, problem.count - 2))
        self.best = np.concatenate(([self.root], np.delete(np.arange(problem.count), self.root)))
        self.values = np.full(2, np.inf)
        self.best_nodes = problem.offsets[self.best]
        self.best_heat = self.config.cold
        self.pace = 3e-5 + 3e-7 * problem.width**2

    def run(
        self,
        budget: Budget,  # of the call
        begin: float,  # fraction of it that is gone when the tour is hottest
        end: float,  # fraction that is gone when it is coldest, where the run ends at the latest
        again: bool = False,  # from the best order, not as hot
    ) -> None:
        """One annealing until it is frozen, from a random order or again from the best one."""
        config, lowest, frozen, first = self.config, np.inf, 0.0, not again
        hot, cold = config.hot, config.cold
        if again:
            self.order, self.nodes = self.best.copy(), self.best_nodes.copy()
            hot, cold = config.reheat * self.best_heat, 0.5 * config.frozen * self.best_heat
        else:
            self._random_start(budget)
        while not budget.stopped():
            gone = budget.gone()
            if gone >= end and np.isfinite(self.values[1]):
                break
            progress = min(max((gone - begin) / (end - begin), 0.0), 1.0)
            heat = hot * (cold / hot) ** progress
            before = self.values[1]
            if self.kept is None and progress > config.narrow_after and self._may_narrow(budget):
                self._narrow(heat * self.scale)
            self._rounds(budget, 0.0 if first else heat * self.scale)
            if self.values[1] < before and not first:
                self.best_heat = heat
            first = False
            if self.values[0] < lowest - 1e-9 * abs(self.values[0]):  # not by rounding alone
                lowest, frozen = self.values[0], config.frozen * heat
            elif heat < frozen:
                break

    def _use(self, problem: Problem) -> None:
        config = self.config
        self.problem, self.offsets = problem, problem.offsets
        self.near, self.between = problem.nearest(
            config.neighbours if problem.symmetric else config.neighbours * 4 // 3
        )
        self.slack = np.full((2, len(problem.names)), np.inf)
        self.slack[1] = 0.0

    def _may_narrow(self, budget: Budget) -> bool:
        """Whether clusters are wide, enough is known, and setting up anew fits into the budget."""
        nodes, sizes = len(self.problem.names), np.diff(self.offsets)
        wide = float(sizes @ sizes) >= self.config.narrow_from * nodes
        known = budget.used >= NARROW_ROUNDS
        return wide and known and NARROW_S * nodes**2 < 0.5 * budget.seconds

    def _narrow(self, temperature: float) -> None:
        """Go on with nodes that good tours may use, judged by the tours so far."""
        config, offsets = self.config, self.offsets
        good = self.slack[0] <= config.narrow_slack * temperature
        for low, high in itertools.pairwise(offsets):
            if good[low:high].sum() > config.narrow_width:
                score = np.where(good[low:high], self.slack[1, low:high], np.inf)
                good[low + np.argsort(score, kind="stable")[config.narrow_width :]] = False
        good[self.nodes] = good[self.best_nodes] = True
        self.kept = np.flatnonzero(good)
        self._use(self.problem.only(self.kept))
        self.nodes = np.searchsorted(self.kept, self.nodes)
        self.best_nodes = np.searchsorted(self.kept, self.best_nodes)

    def chosen(self) -> IntArray:
        """The cheapest of all nodes in the best order that was found."""
        if self.kept is None:
            return self.best_nodes
        problem, nodes = self.everything, np.empty_like(self.best_nodes)
        layers = np.empty((problem.count, problem.width + SPARE))
        best_nodes(problem.finite, problem.offsets, self.best, problem.count, nodes, layers)
        return nodes

    def runs_in(self, budget: Budget, fraction: float) -> int:
        """How many runs a fraction of the budget is good for."""
        rounds = budget.rounds
        if rounds == np.inf:
            self.run(budget, 0.0, 1e-9)  # one piece, for the pace
            rounds = budget.seconds / self.pace
        wanted = self.config.run_rounds * self.problem.count**2
        return int(min(max(fraction * rounds / wanted, 1.0), self.config.restarts))

    @property
    def scale(self) -> float:
        """Mean reduced arc of the best tour."""
        spread = (self.values[1] - self.everything.floor) / self.problem.count
        return float(spread) if np.isfinite(spread) else 0.0

    def _rounds(self, budget: Budget, temperature: float) -> None:
        problem, config = self.problem, self.config
        rounds = int(min(max(config.chunk_s / self.pace, 1.0), MOST_ROUNDS))
        if budget.rounds < np.inf:  # the same pieces on every machine
            rounds = max(1, int(min(100, budget.rounds // 200, budget.rounds - budget.used)))
        began = time.perf_counter()
        kernel_problem = TourProblem(
            problem.finite,
            problem.reverse,
            problem.into,
            problem.onto,
            self.offsets,
            self.near,
            self.between,
            self.most,
            config.blink,
            min(config.swap_neighbours, self.near.shape[1]),
            problem.symmetric,
        )
        found = TourState(
            self.order, self.nodes, self.best, self.best_nodes, self.values, self.slack, self.state
        )
        tolerance = 1e-12 * max(abs(self.values[1]), abs(self.values[0]))
        search_tours(kernel_problem, found, temperature, tolerance, rounds)
        self.pace = 0.5 * self.pace + 0.5 * (time.perf_counter() - began) / rounds
        budget.used += rounds
        if self.values[1] < budget.cost:
            budget.note(self.tour_cost())

    def tour_cost(self) -> float:
        """Cost of the best tour, infinite if it has a forbidden arc."""
        return self.problem.path_cost(self.best_nodes)

    def _random_start(self, budget: Budget) -> None:
        problem = self.problem
        rest = np.delete(np.arange(problem.count), self.root)
        rng = np.random.default_rng(int(self.state[0]) + budget.used)
        self.order = np.concatenate(([self.root], rng.permutation(rest)))
        self.nodes = problem.offsets[self.order]
        layers = np.empty((problem.count, problem.width + SPARE))
        self.values[0] = best_nodes(
            problem.finite, self.offsets, self.order, problem.count, self.nodes, layers
        )
        if self.values[0] < self.values[1]:
            self.values[1] = self.values[0]
            self.best, self.best_nodes = self.order.copy(), self.nodes.copy()
            budget.note(self.tour_cost())


def search(
    problem: Problem, config: GtspConfig, seed: IntArray, budget: Budget, fraction: float
) -> IntArray:
    """The best nodes in visiting order that a fraction of the budget allows.

    They use a forbidden arc only if no tour without one was found.
    """
    state = AnytimeSearch(problem, config, seed)
    length = max(fraction - budget.gone(), 1e-9) / state.runs_in(budget, fraction)
    left, whole, runs = fraction, 0.0, 0
    while runs == 0 or (left > 0.0 and not budget.stopped()):
        begin = min(budget.gone(), fraction)
        left = fraction - begin
        again = runs > 0 and left < config.whole * whole / runs
        state.run(budget, begin, begin + left / max(1, round(left / length)), again)
        left = fraction - budget.gone()
        if not again:  # it may have ended early
            whole, runs = whole + budget.gone() - begin, runs + 1
    return state.chosen()
