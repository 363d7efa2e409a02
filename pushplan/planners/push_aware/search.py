"""One call of the push-aware planner."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pushplan.interaction import QuasiStatic
from pushplan.motion.collision import first_blocked
from pushplan.motion.dubins import step_along
from pushplan.motion.shortcutting import lay_out, make_path
from pushplan.motion.speed_profile import turning_radius
from pushplan.planners.push_aware.best_first import Branching, make_search
from pushplan.planners.push_aware.cost_to_go import CostToGo, length_to_go
from pushplan.planners.push_aware.dubins_warm_start import taut_arcs
from pushplan.planners.push_aware.nodes import Nodes, make_nodes, plant, trace
from pushplan.planners.push_aware.push_aware_config import PushAwareConfig
from pushplan.planners.push_aware.random_tree import DRAWS, grow
from pushplan.planners.push_aware.tables import table_maker
from pushplan.planners.rrt.kinodynamic_search import Search, _Candidate
from pushplan.search.astar import EXHAUSTED, FOUND
from pushplan.world import Drive, GoalDisc, PlanStatus, StopCheck, World
from pushplan.world.checks import FloatArray

_RANDOM_NODES = 20_000
"""Nodes of a random tree at most; then another is begun."""
_SIGNATURES = 4
"""Ways to have pushed the objects that some searches tell apart in each cell."""
_LONGEST_ARC = 2.0
"""Longest arc of the random tree [R]."""


@dataclass(frozen=True)
class _Style:
    """How one search of the lattice differs from another."""

    arc: float
    curvatures: int
    greed: float
    signatures: int
    masses: FloatArray


class PushAwareSearch(Search):
    """A first plan, then searches over poses and pushed objects, each under the best cost so far.

    Trees and repairs are those of the kinodynamic planner.
    """

    config: PushAwareConfig

    def __init__(
        self,
        world: World,
        config: PushAwareConfig,
        interaction: QuasiStatic,
        check: StopCheck,
        rng: np.random.Generator,
        began: float,
    ) -> None:
        super().__init__(world, config, interaction, check, rng, began)
        radius = self._radius()
        self.pricing = self.pricing._replace(radius=radius)
        self.limits = replace(self.limits, max_curvature=1.0 / radius)
        self.expansions = self.searches = self.random_arcs = 0
        self._patience = float(config.first_search)
        self._nodes: Nodes | None = None
        self._tree: Nodes | None = None

    def run(self) -> PlanStatus | None:
        """Search until the stop rule fires; None where there is no plan by then."""
        status = self._first_plan()
        if status is not None:
            return status
        table = self._table()
        if table is not None:
            self._search(table, self._first_style(table))
        while not self.stopped():
            begun = self.iterations
            if table is not None:
                self._search(table, self._random_style(table))
            for _ in range(2):
                self._one_round()
            self._grow_at_random(self.config.random_share * (self.iterations - begun))
        return PlanStatus.SOLVED if self._solved(self.best_cost) else None

    def _first_plan(self) -> PlanStatus | None:
        """Drive along the taut path or, where that fails, grow trees until one gets to the goal.

        Returns:
            A status where the call ends here: the start is blocked, the robot is there already,
            or no way leads to the goal.
        """
        status = self._begin()
        if status is not None:
            return status
        self._shoot()
        while not self.stopped():
            self._one_round()
            if self._solved(self.best_cost):
                return None
            if self.sealed:
                return PlanStatus.GOAL_UNREACHABLE
            self._relax()
            self._relax()  # where a first tree fails, the start is most often a tight one
            self._shoot()
            table = self._table()
            if table is not None:
                self._search(table, replace(self._first_style(table), greed=1.3))
        return None

    def _shoot(self) -> None:
        """Try to drive along the taut path, objects or not."""
        depth = 1.01 * self.config.inset * self.size
        if isinstance(self.goal, GoalDisc):
            depth = self.goal.radius - 0.99 * float(self.pricing.goal[3])
        radius = self.pricing.radius
        for clearance in (max(1.25 * self.size, 1.02 * radius), 1.1 * self.size):
            arcs = taut_arcs(self.world, self.goal, clearance, radius, depth)
            if arcs is None:
                continue
            if self._candidate(arcs, free=False) is not None:
                return

    def _table(self) -> CostToGo | None:
        """Lengths to the goal without objects; the same for every call on this map."""
        robot, static = self.world.robot, self.world.static
        inset = self.config.inset * self.size
        maker = table_maker(robot, static, self.goal, self._radius(), inset)
        return maker.make(self.stopped)

    def _radius(self) -> float:
        """Least turning radius of plans [m], as long as there is a way with it."""
        if self.world.robot.drive is Drive.DIFFERENTIAL:
            return self.config.differential_radius * self.size
        return turning_radius(self.world.robot, self.config.turn_share)

    def _first_style(self, table: CostToGo) -> _Style:
        config = self.config
        greed = max(config.greed, 0.5 * (1.0 + self._dearness(table)))
        return _Style(config.arc, config.curvatures, greed, 1, self.world.movables.masses)

    def _random_style(self, table: CostToGo) -> _Style:
        """Other edges, another greed and other prices: what one search misses another finds."""
        config, rng = self.config, self.rng
        masses = self.world.movables.masses
        most = max(1.03 * config.greed, self._dearness(table))
        return _Style(
            arc=config.arc * float(rng.uniform(0.7, 1.5)),
            curvatures=int(rng.integers(1, 4)) * 2 + 1,
            greed=float(rng.uniform(0.98 * config.greed, most)),
            signatures=_SIGNATURES if rng.random() < 0.1 else 1,
            masses=masses * np.exp(config.doubt * rng.standard_normal(len(masses))),
        )

    def _dearness(self, table: CostToGo) -> float:
        """What the best plan costs, over what its way would cost without objects, at most 2.

        Among many objects the way that is left costs so much more than its length, too, and a
        search that knows wastes no time on what only looks cheap.
        """
        x, y, theta = (float(value) for value in self.world.robot_pose)
        alone = self.world.robot.mass * float(length_to_go(table, x, y, theta))
        if not self._solved(self.best_cost) or not 0.0 < alone < np.inf:
            return 1.3
        return min(max(self.best_cost / alone, 1.0), 2.0)

    def _memory(self, table: CostToGo, signatures: int) -> Nodes:
        """Memory for one search; kept for the next where it fits."""
        rows, cols, headings = table.values.shape
        cells = (rows, cols, headings, signatures)
        if self._nodes is None:
            config = self.config
            count = len(self.world.movables)
            self._nodes = make_nodes(config.nodes, count, config.memory, cells)
        if self._nodes.best.shape != cells:
            self._nodes = self._nodes._replace(best=np.empty(cells))
        return self._nodes

    def _search(self, table: CostToGo, style: _Style) -> None:
        """One best-first search under the best cost so far, and repairs of what it finds."""
        nodes = self._memory(table, style.signatures)
        bends = np.linspace(-1.0, 1.0, style.curvatures) / self.pricing.radius
        branching = Branching(
            bends, style.arc * table.cell, style.greed, self.config.trust, style.masses
        )
        plant(nodes, self.world.robot_pose, self.world.movables.poses, 0.0)
        self.searches += 1
        star = make_search(
            nodes,
            table,
            branching,
            self._bound(1.0 + self.config.slack),
            self.pricing,
            self.shape,
            self.walls,
            self.bodies,
            self.settings,
        )
        while not self.stopped():
            before = int(nodes.counts[3])
            if before >= self._patience:
                self._patience *= 1.25  # the trees may know better; then this takes longer
                return
            outcome = star.run(2 * self._few())
            driven = int(nodes.counts[3]) - before
            self.iterations += max(1, driven)
            self.expansions += driven
            if outcome == FOUND:
                candidate = self._candidate(trace(nodes, star.goal // 2))
                if candidate is not None:
                    self._finish(candidate)
                return
            if outcome == EXHAUSTED or nodes.counts[2]:
                return

    def _grow_at_random(self, arcs: float) -> None:
        """Add arcs to the random tree, and repair what gets to the goal with it."""
        world, few = self.world, self._few()
        if self._tree is None:
            config = self.config
            count = min(config.nodes, _RANDOM_NODES)
            self._tree = make_nodes(count, len(world.movables), config.memory)
            plant(self._tree, world.robot_pose, world.movables.poses, 0.0)
        last = self.iterations + arcs
        while self.iterations < last and not self.stopped():
            bound = self._bound(1.0)
            if not np.isfinite(bound):
                return
            node = grow(
                self._tree,
                self.rng.random((few, DRAWS)),
                bound,
                _LONGEST_ARC * self.size,
                np.array([2.0 * self.size, np.pi, 2.0 * self.size * world.robot.mass]),
                self.pricing,
                self.shape,
                self.walls,
                self.bodies,
                self.settings,
            )
            self.iterations += few
            self.random_arcs += few
            if node >= 0:
                candidate = self._candidate(trace(self._tree, node))
                if candidate is not None:
                    self._finish(candidate)
            if node == -2:
                plant(self._tree, world.robot_pose, world.movables.poses, 0.0)

    def _few(self) -> int:
        """Arcs to drive between two looks at the stop rule."""
        return max(1, 10 * self.config.expansions // (10 + len(self.world.movables)))

    def _bound(self, factor: float) -> float:
        """``factor`` times the best cost so far [kg m], infinite while there is no plan."""
        return factor * self._best_plan_cost()

    def _candidate(self, arcs: FloatArray, *, free: bool = True) -> _Candidate | None:
        """The path along some arcs, priced; None if it is not one that could be a plan.

        Args:
            arcs: (E, 2) length [m] and curvature [1/m].
            free: whether it is known to touch no wall.
        """
        world = self.world
        steps = [length / step_along(bend, self.pricing.spacing) for length, bend in arcs.tolist()]
        capacity = 3 * int(sum(steps) + len(arcs)) + 200
        path = make_path(capacity, len(world.movables))
        count = lay_out(world.robot_pose, arcs, path, self.pricing)
        if not free:
            corners = np.empty_like(self.shape.vertices)
            blocked = first_blocked(path.poses, count, self.shape, self.walls, corners) < count
            x, y = path.poses[count - 1, :2]
            if blocked or self.goal.distance(float(x), float(y)) > 0.0:
                return None
        cost = self._price(path, count, self._jam_cost)
        if cost is None:
            return None
        self._keep(path, count, cost)
        return _Candidate(path, make_path(capacity, len(world.movables)), count, cost)

    def _one_round(self) -> None:
        """Paths of two trees: around the objects, and among them at a price that varies."""
        config = self.config
        doubt = float(np.exp(config.doubt * self.rng.standard_normal())) if self.trees else 1.0
        for weight, budget in (
            (np.inf, config.avoid_iterations),
            (config.push_weight * doubt, config.tree_iterations),
        ):
            if self.stopped():
                return
            candidate = self._grow(weight, budget)
            if candidate is not None:
                self._finish(candidate)

    def _finish(self, candidate: _Candidate) -> None:
        """Repair a path for as long as that pays, and it may still become the best."""
        config = self.config
        while not self.stopped():
            before = candidate.cost
            self._repair(candidate, config.repairs)
            gain = before - candidate.cost
            behind = candidate.cost - self.best_cost
            if gain <= config.least_gain * before or behind > 5.0 * gain:
                return
