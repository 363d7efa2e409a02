"""The one door of the sequencing solver."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pushplan.errors import InvalidInputError
from pushplan.gtsp.checking import checked_clusters, checked_costs, graph_instance
from pushplan.gtsp.exact import expected_seconds, solve_exactly, table_mb
from pushplan.gtsp.gtsp_config import GtspConfig
from pushplan.gtsp.large import best_choice, promising
from pushplan.gtsp.problem import Problem, tour_cost, usable
from pushplan.gtsp.proof import prove
from pushplan.gtsp.search import Budget, search
from pushplan.gtsp.tour import Tour, TourStats, TourStatus
from pushplan.world.checks import IntArray
from pushplan.world.stop import MaxIterations, Stop, check_rules

if TYPE_CHECKING:
    import networkx as nx

NODES_PER_ROOT_SECOND = 4000.0
"""A search holds no more nodes than this times the root of its seconds, so that it can begin."""
EXACT_FRACTION = 0.6
"""Fraction of a time budget that ``"auto"`` gives to dynamic programming, which may not end."""
UNTIMED_S = 5.0
"""Dynamic programming that takes longer is left to the search where time has no limit [s]."""
PROOF_SETUP_S = 6e-8
"""Time that a proof takes before it looks at the stop rule, for each pair of nodes [s]."""
_DEFAULT = GtspConfig()


def solve_gtsp(
    costs: ArrayLike | nx.Graph[Any],
    clusters: Sequence[Sequence[int]] | Sequence[NDArray[np.int64]] | None = None,
    *,
    stop: Stop | None = None,
    rng: np.random.Generator | None = None,
    config: GtspConfig = _DEFAULT,
) -> Tour:
    """A cheap closed tour through one node of every cluster.

    A cluster of one node with free arcs back to it makes the tour an open path from that node.

    Args:
        costs: (N, N) cost of the arc from each node (row) to each (column), of any sign; inf
            forbids it. Arcs inside of clusters are not used. Or a NetworkX graph whose nodes have
            the attribute ``cluster`` and whose edges have ``weight``; what is missing is forbidden.
        clusters: the nodes of each cluster: a partition of 0 to N - 1. None for a graph.
        stop: when to return; `MaxIterations` counts rounds of the search, which makes results
            the same on every machine. Without a rule, ``config.iterations`` rounds.
        rng: of the search; the same numbers every time by default.
        config: parameters.

    Returns:
        The tour, its status and what is known of the optimum. Of a graph, the nodes of the tour
        are its nodes.

    Raises:
        InvalidInputError: for input that breaks a rule, or where ``method="exact"`` would need
            more memory than ``config.memory_mb``.
    """
    check_rules(stop, rng)
    budget = Budget.start(stop, config.iterations)
    names: Sequence[Any] = ()
    if clusters is None:
        if not hasattr(costs, "edges"):
            raise InvalidInputError("clusters must be given, or a NetworkX graph in place of costs")
        names, costs, clusters = graph_instance(costs)
    matrix = checked_costs(costs)
    members = checked_clusters(clusters, len(matrix))
    seed = (np.random.default_rng(0) if rng is None else rng).integers(1, 2**63, 1)
    call = _SolverCall(matrix, members, seed.astype(np.uint64), budget, stop, config)
    tour = call.solve()
    return replace(tour, nodes=tuple(names[node] for node in tour.nodes)) if names else tour


class _SolverCall:
    """One call of the solver."""

    def __init__(
        self,
        costs: NDArray[np.number],
        members: tuple[IntArray, ...],
        seed: IntArray,
        budget: Budget,
        stop: Stop | None,
        config: GtspConfig,
    ) -> None:
        self.costs, self.members, self.seed = costs, members, seed
        self.budget, self.stop, self.config = budget, stop, config
        self.method, self.detail = "none", dict[str, float]()

    def solve(self) -> Tour:
        """Choose a method and run it."""
        if len(self.members) == 1:
            self.budget.note(0.0)
            return self._tour(self.members[0][:1], 0.0, proven=True)
        if self.budget.stopped():
            return self._nothing()
        kept, empty = usable(self.costs, self.members)
        if empty is not None:
            return self._failed(TourStatus.INFEASIBLE, math.inf)
        total = sum(len(nodes) for nodes in kept)
        limit = self.config.search_nodes
        if self.budget.seconds < math.inf:
            limit = min(limit, int(NODES_PER_ROOT_SECOND * math.sqrt(self.budget.seconds)))
        if total > max(limit, len(kept)) and len(kept) > 2 and self.config.method != "exact":
            return self._large(kept, limit)
        problem = Problem.build(self.costs, kept).reduced()
        if self._goes_exact(problem):
            found = self._exact(problem)
            if found is not None:
                return found
        return self._search(problem)

    def _goes_exact(self, problem: Problem) -> bool:
        config, need = self.config, table_mb(problem)
        if config.method == "exact":
            if need > config.memory_mb:
                raise InvalidInputError(
                    f"method 'exact' needs a table of {need:.3g} MB for {problem.count} clusters "
                    f"of up to {problem.width} nodes, but memory_mb is {config.memory_mb:g}: "
                    f"raise it, or use method 'search'"
                )
            return True
        if problem.count <= 3:
            return True
        fits = need <= config.memory_mb and problem.count - 1 <= config.exact_clusters
        timed = self.budget.seconds < math.inf
        left = EXACT_FRACTION * self.budget.seconds - self.budget.elapsed if timed else UNTIMED_S
        return config.method == "auto" and fits and expected_seconds(problem) < left

    def _exact(self, problem: Problem) -> Tour | None:
        """The optimum; None where a search has to go on."""
        self.method, budget = "exact", self.budget
        alone = self.config.method == "exact"
        until = math.inf if alone else EXACT_FRACTION * budget.seconds
        complete, nodes = solve_exactly(
            problem, lambda: budget.elapsed > until or budget.stopped(), self.config.chunk_s
        )
        if not complete:
            return self._nothing() if alone or problem.count <= 3 else None
        if nodes is None:
            return self._failed(TourStatus.INFEASIBLE, math.inf)
        chosen = problem.names[nodes]
        cost = tour_cost(self.costs, chosen)
        self.budget.note(cost)
        return self._tour(chosen, cost, proven=True)

    def _search(self, problem: Problem) -> Tour:
        self.method = "search"
        config, budget = self.config, self.budget
        fraction = 1.0 - config.proof_fraction if config.lower_bound else 1.0
        if budget.seconds == math.inf:
            fraction = 1.0
        nodes = search(problem, config, self.seed, budget, fraction)
        cost = problem.path_cost(nodes)
        bound = problem.floor
        late = budget.elapsed + PROOF_SETUP_S * len(problem.names) ** 2 > budget.seconds
        if not config.lower_bound or late or budget.check(0, cost):
            return self._tour(problem.names[nodes], cost, bound=bound)
        proof = prove(problem, cost, lambda: budget.check(0, budget.cost), config)
        self.detail.update(proof.detail)
        if proof.nodes is not None:
            nodes, cost = proof.nodes, problem.path_cost(proof.nodes)
            budget.note(cost)
        if proof.complete and cost == math.inf:
            return self._failed(TourStatus.INFEASIBLE, math.inf)
        chosen = problem.names[nodes]
        return self._tour(chosen, cost, bound=max(bound, proof.bound), proven=proof.complete)

    def _large(self, kept: list[IntArray], limit: int) -> Tour:
        """Search on promising nodes, then choose among all nodes for the order that was found."""
        self.method = "search"
        budget = self.budget
        few = promising(self.costs, kept, limit, lambda: budget.gone() > 0.3 or budget.stopped())
        problem = Problem.build(self.costs, few)
        self.detail["nodes"] = float(len(problem.names))
        nodes = search(problem, self.config, self.seed, budget, 1.0)
        order = problem.cluster_of[nodes]
        chosen = best_choice(self.costs, [kept[c] for c in order])
        cost = tour_cost(self.costs, chosen)
        if problem.path_cost(nodes) <= cost:
            chosen, cost = problem.names[nodes], problem.path_cost(nodes)
        budget.note(cost)
        return self._tour(chosen, cost)

    def _tour(
        self, nodes: IntArray, cost: float, *, bound: float = -math.inf, proven: bool = False
    ) -> Tour:
        if cost == math.inf:
            return self._nothing()
        owner = np.empty(len(self.costs), dtype=np.int64)
        for index, cluster in enumerate(self.members):
            owner[cluster] = index
        first = int(np.flatnonzero(owner[nodes] == 0)[0])
        status = TourStatus.OPTIMAL if proven else TourStatus.FEASIBLE
        return Tour(
            tuple(int(node) for node in np.roll(nodes, -first)),
            cost,
            cost if proven else min(bound, cost),
            status,
            self._stats(),
        )

    def _nothing(self) -> Tour:
        cancelled = self.stop is not None and self.stop.cancelled
        return self._failed(TourStatus.CANCELLED if cancelled else TourStatus.TIMED_OUT, -math.inf)

    def _failed(self, status: TourStatus, bound: float) -> Tour:
        return Tour((), math.inf, bound, status, replace(self._stats(), best_s=math.nan))

    def _stats(self) -> TourStats:
        budget = self.budget
        return TourStats(budget.elapsed, budget.best_s, budget.used, self.method, self.detail)


def warm_up_solver(proof: bool = True) -> None:
    """Solve a small instance in every way, so that later calls find compiled kernels.

    Args:
        proof: whether also with a lower bound.
    """
    costs = np.random.default_rng(0).random((14, 14))
    clusters = [range(2 * c, 2 * c + 2) for c in range(7)]
    solve_gtsp(costs, clusters)
    config = GtspConfig(method="search", lower_bound=proof)
    solve_gtsp(costs, clusters, stop=MaxIterations(50), config=config)
