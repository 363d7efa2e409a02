"""One call of the push-aware planner."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pushplan.core import planners as core
from pushplan.core import search
from pushplan.motion.dubins_warm_start import set_aside_drive
from pushplan.motion.keep_out import keep_out
from pushplan.motion.local_windows import warm_start
from pushplan.motion.path_improver import Candidate, PathImprover
from pushplan.motion.path_search_config import INSET, LEAST_GAIN
from pushplan.motion.random_tree.tree_paths import TreePaths
from pushplan.motion.start_turn import start_turn
from pushplan.motion.work_bound import length_bound
from pushplan.planners.push_aware.cost_to_go import cost_to_go_maker
from pushplan.planners.push_aware.push_aware_config import PushAwareConfig
from pushplan.world import PlanStatus
from pushplan.world.checks import FloatArray

_FIRST_SEARCH = 1000.0
"""Arcs driven in a search at most; more after each that took them all."""
_PATIENCE_GROWTH = 1.25  # factor on it then
_COST_SIGMA = 0.7
"""Perturbation of objects' costs from one search to the next: deviation of their logarithm."""

_ARC = 2.0  # length of an edge of the search [cells of the table]
_CURVATURES = 5  # of an edge, spread evenly between the sharpest turns
_NODES = 100_000  # nodes of one search at most
_MEMORY = 48.0  # of the objects' poses in one search at most [MiB]
_EXPANSIONS = 30
"""Half the arcs driven at most between two looks at the stop rule, fewer among many objects."""
_HOPEFUL_GAINS = 5.0
"""Rounds of shortcuts, each with the last one's gain, in which a path may still become the best."""
_SLACK = 0.05
"""Fraction by which a path of the search may cost more than the best plan before it is shortcut."""
_UNSOLVED_RATIO = 1.3  # cost of a plan over that of its path without objects, where none is known
_MOST_RATIO = 2.0  # the same at most: more inflation would make searches greedy
_RANDOM_NODES = 20_000  # nodes of a random tree at most; then another is begun
_SIGNATURES = 4  # ways to have pushed the objects that some searches tell apart in each cell
_LONGEST_ARC = 2.0  # longest arc of the random tree [R]
_DRAWS = 6  # random numbers that one arc of the random tree takes
_LARGE_TURN = 0.5  # turn on the spot from which on arcs without it are a detour [rad]


@dataclass(frozen=True)
class _SearchVariant:
    """Settings in which one search of the lattice differs from another."""

    arc: float
    curvatures: int
    inflation: float
    signatures: int
    masses: FloatArray


class PushAwareSearch:
    """A first plan, then searches over poses and pushed objects, each below the best cost."""

    def __init__(
        self,
        improver: PathImprover,  # keeps the best path
        config: PushAwareConfig,
    ) -> None:
        self.improver = improver
        self.config = config
        self.trees = TreePaths(improver)
        self.world = improver.world
        self.rng = improver.rng
        self.size = improver.size
        self.expansions = self.searches = self.random_arcs = 0
        self.bound = 0.0
        """Lower bound on the cost of every plan [kg m]."""
        self._radius = improver.turning_radius
        self._patience = _FIRST_SEARCH
        self._nodes: core.PushTree | None = None
        self._cells = (0, 0, 0, 0)
        self._tree: core.PushTree | None = None

    def run(self) -> PlanStatus | None:
        """Search until the stop rule fires; None where there is no plan by then."""
        improver = self.improver
        status = self._first_plan()
        self.bound = length_bound(improver.given, improver.stopped)
        if status is not None:
            return status
        table = self._table()
        if table is not None:
            self._search(table, self._first_variant(table))
        self._turn_first(table)
        while not improver.stopped():
            begun = improver.iterations
            if table is not None:
                self._search(table, self._random_variant(table))
            for _ in range(2):
                self._one_round()
            self._grow_at_random(self.config.random_fraction * (improver.iterations - begun))
        return PlanStatus.SOLVED if improver.falls_back() else None

    def _first_plan(self) -> PlanStatus | None:
        """Drive along the shortest path or, where that fails, grow trees until one has a plan.

        Returns:
            A status where the call ends here: the start is blocked, the robot is there already,
            or no way leads to the goal or on at all.
        """
        improver = self.improver
        trees = self.trees
        status = improver.begin()
        if status is not None:
            return status
        trees.look_ahead()
        warm_start(improver)
        if not improver.solved:
            set_aside_drive(improver)
        while not improver.stopped():
            if trees.boxed_in:
                return PlanStatus.START_BLOCKED
            self._one_round()
            if improver.solved:
                return None
            if trees.sealed:
                return PlanStatus.GOAL_UNREACHABLE
            trees.change_start()
            if len(improver.lead.pieces):
                warm_start(improver)
                if improver.solved:
                    return None
            trees.relax()
            trees.relax()  # where a first tree fails, the start is most often a tight one
            warm_start(improver)
            table = self._table()
            if table is not None:
                self._search(table, replace(self._first_variant(table), inflation=_UNSOLVED_RATIO))
        return None

    def _turn_first(self, table: core.CostToGo | None) -> None:
        """Try paths that begin with a turn on the spot, and go on with them if they cost less."""
        improver = self.improver
        if improver.stopped():
            return
        lead = None if len(improver.lead.pieces) else start_turn(improver)
        if lead is None or lead.pieces[0, 0] < _LARGE_TURN or improver.stopped():
            return
        before = improver.best_cost
        improver.begin_with(lead)
        warm_start(improver)
        self._one_round()
        if table is not None:
            self._search(table, self._first_variant(table))
        if not improver.best_cost < before:
            improver.begin_with(None)

    def _table(self) -> core.CostToGo | None:
        """Lengths to the goal without objects; the same for every call on this map."""
        robot = self.world.robot
        static = keep_out(self.world)
        inset = INSET * self.size
        maker = cost_to_go_maker(robot, static, self.improver.goal, self._radius, inset)
        return maker.make(self.improver.stopped)

    def _first_variant(self, table: core.CostToGo) -> _SearchVariant:
        inflation = max(self.config.heuristic_inflation, 0.5 * (1.0 + self._cost_ratio(table)))
        return _SearchVariant(_ARC, _CURVATURES, inflation, 1, self.world.movables.masses)

    def _random_variant(self, table: core.CostToGo) -> _SearchVariant:
        """Other edges, another inflation and other costs: what one search misses another finds."""
        config = self.config
        rng = self.rng
        masses = self.world.movables.masses
        most = max(1.03 * config.heuristic_inflation, self._cost_ratio(table))
        return _SearchVariant(
            arc=_ARC * float(rng.uniform(0.7, 1.5)),
            curvatures=int(rng.integers(1, 4)) * 2 + 1,
            inflation=float(rng.uniform(0.98 * config.heuristic_inflation, most)),
            signatures=_SIGNATURES if rng.random() < 0.1 else 1,
            masses=masses * np.exp(_COST_SIGMA * rng.standard_normal(len(masses))),
        )

    def _cost_ratio(self, table: core.CostToGo) -> float:
        """Return the cost of the best plan over that of its path without objects, at most 2.

        Among many objects the rest of a path costs so much more than its length, too, and a
        search that knows wastes no time on what only looks cheap.
        """
        x, y, theta = (float(value) for value in self.world.robot_pose)
        alone = self.world.robot.mass * table.length_to_go(x, y, theta)
        if not self.improver.solved or not 0.0 < alone < np.inf:
            return _UNSOLVED_RATIO
        return min(max(self.improver.best_cost / alone, 1.0), _MOST_RATIO)

    def _memory(self, table: core.CostToGo, signatures: int) -> core.PushTree:
        """Memory for one search; kept for the next where it fits."""
        cells = (*table.shape, signatures)
        if self._nodes is None:
            self._nodes = core.PushTree(_NODES, len(self.world.movables), _MEMORY, *cells)
        elif self._cells != cells:
            self._nodes.set_cells(*cells)
        self._cells = cells
        return self._nodes

    def _search(self, table: core.CostToGo, variant: _SearchVariant) -> None:
        """One best-first search under the best cost so far, and shortcutting of what it finds."""
        improver = self.improver
        nodes = self._memory(table, variant.signatures)
        self._plant(nodes)
        self.searches += 1
        star = core.push_search(
            nodes,
            table,
            curvatures=np.linspace(-1.0, 1.0, variant.curvatures) / improver.turning_radius,
            length=variant.arc * table.cell,
            inflation=variant.inflation,
            pruning_factor=self.config.pruning_factor,
            masses=variant.masses,
            bound=(1.0 + _SLACK) * improver.plan_cost,
            problem=improver.problem,
            model=improver.contacts,
            size=2 * _NODES,
        )
        while not improver.stopped():
            before = nodes.driven
            if before >= self._patience:
                self._patience *= _PATIENCE_GROWTH  # the trees may know better meanwhile
                return
            outcome = star.run(2 * self._batch())
            driven = nodes.driven - before
            improver.iterations += max(1, driven)
            self.expansions += driven
            if outcome == search.SearchStatus.FOUND:
                self._try(nodes.arcs_to(star.goal))
                return
            if outcome == search.SearchStatus.EXHAUSTED or nodes.full:
                return

    def _grow_at_random(self, arcs: float) -> None:
        """Add arcs to the random tree, and shortcut what gets to the goal with it."""
        improver = self.improver
        world = self.world
        batch = self._batch()
        if self._tree is None:
            self._tree = core.PushTree(_RANDOM_NODES, len(world.movables), _MEMORY)
            self._plant(self._tree)
        scales = np.array([2.0 * self.size, np.pi, 2.0 * self.size * world.robot.mass])
        last = improver.iterations + arcs
        while improver.iterations < last and not improver.stopped():
            bound = improver.plan_cost
            if not np.isfinite(bound):
                return
            draws = self.rng.random((batch, _DRAWS))
            longest = _LONGEST_ARC * self.size
            node = core.grow(
                self._tree, draws, bound, longest, scales, improver.problem, improver.contacts
            )
            improver.iterations += batch
            self.random_arcs += batch
            if node >= 0:
                self._try(self._tree.arcs_to(node))
            if node == -2:
                self._plant(self._tree)

    def _plant(self, tree: core.PushTree) -> None:
        """Begin a search where the robot and the objects are."""
        tree.plant(self.improver.lead.pose, self.improver.lead.objects, 0.0)

    def _batch(self) -> int:
        """Arcs to drive between two looks at the stop rule."""
        return max(1, 10 * _EXPANSIONS // (10 + len(self.world.movables)))

    def _try(self, arcs: FloatArray) -> None:
        """Shortcut the path along some arcs, where it could be a plan."""
        candidate = self.improver.candidate(arcs, self.improver.jam_cost)
        if candidate is not None:
            self._finish(candidate)

    def _one_round(self) -> None:
        """Paths of two trees: around the objects, and among them at a weight that varies."""
        push_weight = self.config.push_weight
        if self.trees.trees:  # the first two take the weight as it is
            push_weight *= float(np.exp(_COST_SIGMA * self.rng.standard_normal()))
        for candidate in self.trees.grow_two(push_weight):
            self._finish(candidate)

    def _finish(self, candidate: Candidate) -> None:
        """Shortcut a path for as long as that pays, and it may still become the best."""
        improver = self.improver
        while not improver.stopped():
            before = candidate.cost
            improver.shortcut(candidate)
            gain = before - candidate.cost
            behind = candidate.cost - improver.best_cost
            if gain <= LEAST_GAIN * before or behind > _HOPEFUL_GAINS * gain:
                return
