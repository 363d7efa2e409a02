"""The one door of the sequencing solver."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pushplan.core import gtsp as core
from pushplan.errors import InvalidInputError
from pushplan.gtsp.checking import (
    check_tour,
    checked_clusters,
    checked_costs,
    checked_nodes,
    graph_instance,
)
from pushplan.gtsp.distances import Distances
from pushplan.gtsp.gtsp_config import GtspConfig
from pushplan.gtsp.instance import GtspInstance
from pushplan.gtsp.problem import Padded, Problem, StopFired, tour_cost, usable
from pushplan.gtsp.proof import prove
from pushplan.gtsp.search import Budget, search
from pushplan.gtsp.tour import Tour, TourStats, TourStatus
from pushplan.world.checks import FloatArray, IntArray
from pushplan.world.stop import Stop, check_rules

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
CHOICE_S = 3e-5
"""Time that the choice among all nodes takes after a search, for each cluster [s]."""
_PROOF_STATES = 2_000_000  # paths that a proof keeps at once at most
_DEFAULT = GtspConfig()
ARCS_PER_SECOND = 1.5e9
"""Number of arcs that the core looks at in a second, on a slow machine."""
NEAREST = 5
"""Number of nearest clusters by which the promise of a node is judged."""


def solve_gtsp(
    costs: ArrayLike | GtspInstance | nx.Graph[Any],
    clusters: Sequence[Sequence[int]] | Sequence[NDArray[np.int64]] | None = None,
    *,
    stop: Stop | None = None,
    rng: np.random.Generator | None = None,
    config: GtspConfig = _DEFAULT,
    initial: Tour | Sequence[Any] | None = None,
    fixed_start: int | Sequence[Any] = (),
) -> Tour:
    """A cheap closed tour through one node of every cluster.

    A cluster of one node with free arcs back to it makes the tour an open path from that node.

    Args:
        costs: (N, N) cost of the arc from each node (row) to each (column), of any sign; inf
            forbids it. Arcs inside of clusters are not used. Or an instance, of whose coordinates
            only the costs are made that are needed. Or a NetworkX graph whose nodes have
            the attribute ``cluster`` and whose edges have ``weight``; what is missing is forbidden.
        clusters: the nodes of each cluster: a partition of 0 to N - 1. None for the other two.
        stop: when to return; `MaxIterations` counts rounds of the search, which makes results
            the same on every machine. Without a rule, ``config.iterations`` rounds.
        rng: of the search; the same numbers every time by default.
        config: parameters.
        initial: a tour to begin with, one node of each cluster in visiting order, from whichever
            on. The result costs no more, and with a stop rule that has fired already it is this.
        fixed_start: a node, or nodes in this order, with which every tour begins; the optimum and
            its bounds are those of such tours.

    Returns:
        The tour, its status and what is known of the optimum. Of a graph, the nodes of the tour
        are its nodes.

    Raises:
        InvalidInputError: for input that breaks a rule, an initial tour that is none or begins
            otherwise than ``fixed_start``, or where ``method="exact"`` would need more memory than
            ``config.memory_mb``.
    """
    check_rules(stop, rng)
    budget = Budget.start(stop, config.iterations)
    names: Sequence[Any] = ()
    matrix: NDArray[np.number] | Distances
    if isinstance(costs, GtspInstance):
        matrix = costs.table
        clusters = costs.clusters
    elif clusters is None:
        if not hasattr(costs, "edges"):
            raise InvalidInputError("clusters must be given, or a NetworkX graph in place of costs")
        names, costs, clusters = graph_instance(costs)
    if not isinstance(costs, GtspInstance):
        matrix = checked_costs(costs, budget.stopped)
    members = checked_clusters(clusters, len(matrix))
    if isinstance(fixed_start, int | np.integer):
        fixed_start = [fixed_start]
    start = checked_nodes("fixed_start", fixed_start, names, len(matrix))
    check_tour("fixed_start", start, matrix, members)
    given: IntArray | None = None
    if initial is not None:
        begin = initial.nodes if isinstance(initial, Tour) else initial
        given = checked_nodes("initial", begin, names, len(matrix))
        check_tour("initial", given, matrix, members, closed=True)
        given = _beginning_in(given, start[:1] if len(start) else members[0])
        if (given[: len(start)] != start).any():
            raise InvalidInputError("initial must visit the nodes of fixed_start in this order")
        budget.note(tour_cost(matrix, given))
    seed = (np.random.default_rng(0) if rng is None else rng).integers(1, 2**63)
    call = _SolverCall(*_contracted(matrix, members, start), int(seed), budget, stop, config)
    if given is not None:
        call.initial = np.delete(given, np.arange(1, len(start)))
    tour = call.solve()
    if len(start) > 1 and tour.nodes:
        nodes = np.array([*start, *tour.nodes[1:]])
        cost = tour_cost(matrix, nodes)
        if cost == math.inf:  # all nodes are fixed
            return Tour((), math.inf, math.inf, TourStatus.INFEASIBLE, tour.stats)
        bound = min(tour.lower_bound, cost)
        if tour.status is TourStatus.OPTIMAL:
            bound = cost
        tour = replace(tour, nodes=tuple(nodes.tolist()), cost=cost, lower_bound=bound)
    if given is not None and tour_cost(matrix, given) < tour.cost:
        tour = _given(tour, given, tour_cost(matrix, given))
    if names:
        tour = replace(tour, nodes=tuple(names[node] for node in tour.nodes))
    return tour


def _beginning_in(nodes: IntArray, first: IntArray) -> IntArray:
    """A closed tour from the first of its nodes on that is one of these, if one is."""
    return np.roll(nodes, -int(np.isin(nodes, first).argmax()))


def _contracted(
    costs: NDArray[np.number] | Distances, members: tuple[IntArray, ...], start: IntArray
) -> tuple[NDArray[np.number] | Distances, tuple[IntArray, ...]]:
    """The problem with one node in place of those that every tour begins with.

    The node is entered as the first of them and left as the last, at the cost of all arcs between.
    """
    if not len(start):
        return costs, members
    others = tuple(nodes for nodes in members if not np.isin(nodes, start).any())
    if len(start) > 1:
        between = costs[start[:-1], start[1:]].sum()
        costs = costs[np.arange(len(costs))]
        costs[start[0]] = costs[start[-1]] + between
    return costs, (start[:1], *others)


def _given(tour: Tour, nodes: IntArray, cost: float) -> Tour:
    """The tour that was given, where the result of the call costs more or there is none."""
    status = tour.status
    if status is not TourStatus.OPTIMAL:
        status = TourStatus.FEASIBLE
    bound = min(tour.lower_bound, cost)
    return Tour(tuple(nodes.tolist()), cost, bound, status, replace(tour.stats, best_s=0.0))


@dataclass
class _SolverCall:
    """One call of the solver."""

    costs: NDArray[np.number] | Distances
    members: tuple[IntArray, ...]
    seed: int
    budget: Budget
    stop: Stop | None
    config: GtspConfig
    initial: IntArray | None = None
    method: str = "none"
    detail: dict[str, float] = field(default_factory=dict)

    def solve(self) -> Tour:
        """Choose a method and run it."""
        try:
            return self._solve()
        except StopFired:  # before there was an order: any is a tour where no arc is forbidden
            return self._tour(np.array([nodes[0] for nodes in self.members]))

    def _solve(self) -> Tour:
        config = self.config
        budget = self.budget
        if len(self.members) == 1:
            return self._tour(self.members[0][:1], proven=True)
        if budget.stopped():
            return self._failed()
        kept = usable(self.costs, self.members, self._late)
        if not all(len(nodes) for nodes in kept):
            return self._failed(infeasible=True)
        limit = config.search_nodes
        if budget.seconds < math.inf:
            limit = min(limit, int(NODES_PER_ROOT_SECOND * math.sqrt(budget.seconds)))
        large = sum(len(nodes) for nodes in kept) > max(limit, len(kept)) and len(kept) > 2
        if large and config.method != "exact":
            few = promising(
                self.costs, kept, limit, lambda: budget.gone() > 0.3 or budget.stopped()
            )
            problem = Problem.build(self.costs, few, self._late)
            self.detail["nodes"] = float(len(problem.names))
            return self._search(problem, kept)
        problem = Problem.build(self.costs, kept, self._late).reduced()
        if self._goes_exact(problem):
            alone = config.method == "exact" or problem.count <= 3
            self.method = "exact"
            until = EXACT_FRACTION * budget.seconds
            complete, nodes = solve_exactly(
                problem,
                lambda: budget.stopped() or (budget.elapsed > until and config.method != "exact"),
                config.chunk_s,
            )
            if nodes is not None:
                return self._tour(problem.names[nodes], proven=True)
            if complete or alone:
                return self._failed(infeasible=complete)
        return self._search(problem)

    def _goes_exact(self, problem: Problem) -> bool:
        config = self.config
        budget = self.budget
        need = table_mb(problem)
        if config.method == "exact" and need > config.memory_mb:
            raise InvalidInputError(
                f"method 'exact' needs a table of {need:.3g} MB for {problem.count} clusters "
                f"of up to {problem.width} nodes, but memory_mb is {config.memory_mb:g}: "
                f"raise it, or use method 'search'"
            )
        if config.method == "exact" or problem.count <= 3:
            return True
        fits = need <= config.memory_mb and problem.count - 1 <= config.exact_clusters
        left = UNTIMED_S
        if budget.seconds < math.inf:
            left = EXACT_FRACTION * budget.seconds - budget.elapsed
        return config.method == "auto" and fits and expected_seconds(problem) < left

    def _search(self, problem: Problem, everything: list[IntArray] | None = None) -> Tour:
        """Search, then choose among all nodes of each cluster for the order that was found."""
        self.method = "search"
        config = self.config
        budget = self.budget
        prove_it = config.lower_bound and everything is None
        timed = prove_it and budget.seconds < math.inf
        begin: IntArray | None = None
        if self.initial is not None:
            owner = np.zeros(len(self.costs), dtype=np.int64)
            for index, cluster in enumerate(self.members):
                owner[cluster] = index
            begin = owner[self.initial]
        choosing = min(CHOICE_S * problem.count / budget.seconds, 0.5)
        fraction = 1.0 - config.proof_fraction if timed else 1.0 - choosing
        order, names = search(problem, config, self.seed, budget, fraction, begin)
        members = [problem.names[nodes] for nodes in problem.members]
        if everything is not None:
            members = everything
        chosen = best_choice(self.costs, [members[c] for c in order], self._late)
        if chosen is None:
            chosen = names
        if everything is not None:
            return self._tour(chosen)
        bound = problem.floor
        cost = tour_cost(self.costs, chosen)
        late = budget.elapsed + PROOF_SETUP_S * len(problem.names) ** 2 > budget.seconds
        if not prove_it or late or budget.check(0, cost):
            return self._tour(chosen, bound)
        budget.note(cost)
        try:
            proof = prove(problem, cost, self._late, _PROOF_STATES)
        except StopFired:
            return self._tour(chosen, bound)
        self.detail["paths"] = float(proof.paths)
        if proof.nodes is not None:
            chosen = problem.names[proof.nodes]
        elif proof.complete and cost == math.inf:
            return self._failed(infeasible=True)
        return self._tour(chosen, max(bound, proof.bound), proven=proof.complete)

    def _late(self) -> bool:
        """Return True if the stop rule has fired, however many rounds there were."""
        return self.budget.check(0, self.budget.cost)

    def _tour(self, nodes: IntArray, bound: float = -math.inf, *, proven: bool = False) -> Tour:
        cost = tour_cost(self.costs, nodes)
        if cost == math.inf:
            return self._failed()
        self.budget.note(cost)
        return Tour(
            tuple(_beginning_in(nodes, self.members[0]).tolist()),
            cost,
            cost if proven else min(bound, cost),
            TourStatus.OPTIMAL if proven else TourStatus.FEASIBLE,
            self._stats(self.budget.best_s),
        )

    def _failed(self, infeasible: bool = False) -> Tour:
        if infeasible:
            return Tour((), math.inf, math.inf, TourStatus.INFEASIBLE, self._stats())
        cancelled = self.stop is not None and self.stop.cancelled
        status = TourStatus.CANCELLED if cancelled else TourStatus.TIMED_OUT
        return Tour((), math.inf, -math.inf, status, self._stats())

    def _stats(self, best_s: float = math.nan) -> TourStats:
        budget = self.budget
        return TourStats(budget.elapsed, best_s, budget.used, self.method, self.detail)


def table_mb(problem: Problem) -> float:
    """Memory of the table [MB], of up to a thousand clusters: more need no smaller one."""
    free = min(problem.count - 1, 1000)  # a float holds no power of two beyond 1023
    return 2.0**free * free * problem.width * 8.0 / 1e6


def expected_seconds(problem: Problem) -> float:
    """About how long it takes [s]."""
    free = problem.count - 1
    width = problem.width
    roots = int(np.diff(problem.offsets).min())
    return roots * free * max(free - 1, 1) * 2.0 ** (free - 2) * width**2 / ARCS_PER_SECOND


def solve_exactly(
    problem: Problem,  # with at least 2 clusters
    stopped: Callable[[], bool],  # asked about every ``chunk_s``
    chunk_s: float,  # [s]
) -> tuple[bool, IntArray | None]:
    """The cheapest tour.

    Returns:
        True if it got to its end, and the nodes in visiting order; None if no tour is finite or it
        was stopped.
    """
    others = problem.members
    roots = others.pop(problem.root)
    padded = Padded.gather(problem.costs, others)
    subsets = 1 << len(others)
    table = np.empty((subsets, *padded.names.shape))
    step = max(1, int(chunk_s / max(expected_seconds(problem) / subsets, 1e-9)))
    best = np.inf
    nodes = None
    for root in roots:
        first = padded.pick(problem.costs[root])
        for low in range(1, subsets, step):
            if stopped():
                return False, None
            high = min(low + step, subsets)
            core.fill_subsets(low, high, table, padded.costs, padded.sizes, first)
        ends = table[-1] + padded.pick(problem.costs[:, root])
        if ends.min() < best:
            best = ends.min()
            nodes = np.array([root, *_path_to(int(ends.argmin()), table, padded)])
    return True, nodes


def _path_to(end: int, table: FloatArray, padded: Padded) -> list[int]:
    """The nodes of the cheapest path to a node of a filled table, ``cluster * K + node``."""
    left = list(range(len(padded.sizes)))
    subset = len(table) - 1
    path: list[int] = []
    while left:
        c, i = divmod(end, table.shape[2])
        path.append(padded.names[left[c], i])
        d = left.pop(c)
        value = table[subset, d, i]
        subset ^= 1 << d
        before = table[subset, left] + padded.costs[left, :, d, i]  # (clusters that are left, K)
        end = int((before == value).argmax()) if left else -1
    return path[::-1]


def promising(
    costs: NDArray[np.number] | Distances,  # (N, N)
    members: Sequence[IntArray],  # nodes of each cluster
    most: int,  # nodes in all, but at least one of each cluster
    # asked between clusters; what is not yet looked at keeps its order
    stopped: Callable[[], bool],
) -> list[IntArray]:
    """The nodes of each cluster with the cheapest arcs from and to its nearest clusters.

    Returns:
        The nodes that are kept.
    """
    score = np.zeros(len(costs))
    for arcs in (costs, costs.T):
        nearest = np.full((NEAREST, len(costs)), np.inf)  # cheapest arcs with clusters, ascending
        for nodes in members:
            if stopped():
                break
            arc = arcs[nodes].min(axis=0).astype(np.float64)
            arc[nodes] = np.inf
            for row in nearest:
                lower = np.minimum(row, arc)
                arc = np.maximum(row, arc)
                row[:] = lower
        total = np.where(np.isfinite(nearest), nearest, 0.0).sum(axis=0)
        score += np.where(np.isfinite(nearest[0]), total, np.inf)
    each = max(1, most // len(members))
    return [np.sort(nodes[np.argsort(score[nodes], kind="stable")[:each]]) for nodes in members]


def best_choice(
    costs: NDArray[np.number] | Distances,  # (N, N)
    layers: Sequence[IntArray],  # nodes of each cluster in visiting order, at least 2 clusters
    stopped: Callable[[], bool],  # asked between clusters
) -> IntArray | None:
    """The cheapest nodes for a closed order of clusters, on costs that are not gathered.

    Returns:
        A node of each; None if it was stopped.
    """
    values = np.where(np.eye(len(layers[0])) > 0.0, 0.0, np.inf)  # (root, node)
    picks: list[IntArray] = []
    for here, there in zip(layers, [*layers[1:], layers[0]], strict=True):
        if stopped():
            return None
        arcs = costs[np.ix_(here, there)]
        pick = (values[:, :, None] + arcs).argmin(axis=1)  # (root, there)
        values = np.take_along_axis(values, pick, 1) + arcs[pick, np.arange(len(there))]
        picks.append(pick)
    at = root = int(np.diag(values).argmin())
    chosen = []
    for pick, nodes in zip(reversed(picks), reversed(layers), strict=True):
        at = int(pick[root, at])
        chosen.append(nodes[at])
    return np.array(chosen[::-1], dtype=np.int64)
