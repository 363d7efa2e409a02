"""One call of the push-aware planner."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pushplan.geometry import VisibilityGraph
from pushplan.interaction import QuasiStatic
from pushplan.planners.kinodynamic.collision import footprint
from pushplan.planners.kinodynamic.improve import lay_out, make_path, price_from
from pushplan.planners.kinodynamic.search import Search, _Candidate
from pushplan.planners.kinodynamic.timing import start_margin, turning_radius
from pushplan.planners.push_aware.best_first import Branching, Nodes, expand, plant, trace
from pushplan.planners.push_aware.config import PushAwareConfig
from pushplan.planners.push_aware.cost_to_go import CostToGo
from pushplan.planners.push_aware.tables import table_maker
from pushplan.world import PlanStatus, StopCheck, World
from pushplan.world.checks import FloatArray


@dataclass(frozen=True)
class _Style:
    """How one search of the lattice differs from another."""

    arc: float
    curvatures: int
    greed: float
    signatures: int


class PushAwareSearch(Search):
    """A first plan, then searches over poses and pushed objects, each under the best cost so far.

    Everything that makes and repairs the first plan is that of the kinodynamic planner.
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
        self.expansions = self.searches = 0
        self._nodes: Nodes | None = None

    def run(self) -> PlanStatus | None:
        """Search until the stop rule fires; None where there is no plan by then."""
        status = self._first_plan()
        if status is not None:
            return status
        table = self._table()
        if table is not None:
            self._search(table, self._first_style())
        while not self.stopped():
            if table is not None:
                self._search(table, self._random_style())
            self._one_round()
        return PlanStatus.SOLVED if self._solved(self.best_cost) else None

    def lower_bound(self) -> float:
        """What no plan can cost less than [kg m]: the way of the inscribed disc past the walls."""
        world = self.world
        graph = VisibilityGraph(world.static, world.robot.inscribed_radius)
        return world.robot.mass * float(graph.to_goal(world.robot_pose[:2], self.goal).length)

    def _first_plan(self) -> PlanStatus | None:
        """Grow trees until one reaches the goal, and repair it a little.

        Returns:
            A status where the call ends here: the start is blocked, the robot is there already,
            or no way leads to the goal.
        """
        margin = start_margin(self.world, self.config.margin * self.size)
        if margin is None:
            return PlanStatus.START_BLOCKED
        self.margin = margin
        self.shape = footprint(self.world.robot, margin)
        if self.goal.distance(*self.world.robot_pose[:2]) <= 0.0:
            here = make_path(1, len(self.world.movables))
            here.poses[0] = self.world.robot_pose
            here.objects[0] = self.world.movables.poses
            self._keep(here, 1, 0.0)
            return PlanStatus.SOLVED
        while not self.stopped():
            self._one_round()
            if self.sealed:
                return PlanStatus.GOAL_UNREACHABLE
            if self._solved(self.best_cost):
                return None
            self._relax()
            self._relax()  # where a first tree fails, the start is most often a tight one
            table = self._table()
            if table is not None:
                self._search(table, replace(self._random_style(), greed=1.3, signatures=1))
        return None

    def _table(self) -> CostToGo | None:
        """Lengths to the goal without objects; the same for every call on this map."""
        radius = turning_radius(self.world.robot, self.config.turn_share)
        inset = self.config.inset * self.size
        return table_maker(self.world.robot, self.world.static, self.goal, radius, inset).make(
            self.stopped
        )

    def _first_style(self) -> _Style:
        config = self.config
        return _Style(config.arc, config.curvatures, config.greed, 1)

    def _random_style(self) -> _Style:
        """Other edges and another greed each time: what one search misses another finds."""
        config, rng = self.config, self.rng
        return _Style(
            arc=config.arc * float(rng.uniform(0.7, 1.5)),
            curvatures=int(rng.integers(1, 4)) * 2 + 1,
            greed=config.greed * float(rng.uniform(0.98, 1.03)),
            signatures=16 if rng.random() < 0.1 else 1,
        )

    def _memory(self, table: CostToGo, signatures: int) -> Nodes:
        """Memory for one search; kept for the next where it fits."""
        cells = (*table.values.shape, signatures)
        if self._nodes is not None:
            if self._nodes.best.shape == cells:
                return self._nodes
            return self._nodes._replace(best=np.empty(cells))
        count, objects = self.config.nodes, len(self.world.movables)
        rows = int(self.config.memory * 2**20 / (24 * max(objects, 1)))
        self._nodes = Nodes(
            poses=np.empty((count, 3)),
            costs=np.empty(count),
            estimates=np.empty(count),
            parents=np.empty(count, np.int64),
            arcs=np.empty((count, 2)),
            rows=np.empty(count, np.int64),
            objects=np.empty((max(2, min(rows, count)), objects, 3)),
            queue=np.empty(count, np.int64),
            best=np.empty(cells),
            counts=np.zeros(4, np.int64),
        )
        return self._nodes

    def _search(self, table: CostToGo, style: _Style) -> None:
        """One best-first search under the best cost so far, and repairs of what it finds."""
        config = self.config
        nodes = self._memory(table, style.signatures)
        bends = np.linspace(-1.0, 1.0, style.curvatures) / self.pricing.radius
        branching = Branching(bends, style.arc * table.cell, style.greed, config.trust)
        plant(nodes, self.world.robot_pose, self.world.movables.poses, 0.0)
        self.searches += 1
        batch = max(1, 10 * config.expansions // (10 + len(self.world.movables)))
        bound = self._bound()
        while not self.stopped():
            before = int(nodes.counts[3])
            node = expand(
                nodes,
                batch,
                bound,
                table,
                branching,
                self.pricing,
                self.shape,
                self.walls,
                self.bodies,
                self.settings,
            )
            driven = int(nodes.counts[3]) - before
            self.iterations += max(1, driven)
            self.expansions += driven
            if node == -2:
                return
            if node >= 0:
                candidate = self._candidate(trace(nodes, node))
                if candidate is not None:
                    self._finish(candidate)
                return

    def _bound(self) -> float:
        """Cost beyond which a path of a search is of no use [kg m]: repairs may still help it."""
        return (
            (1.0 + self.config.slack) * self.best_cost if self._solved(self.best_cost) else np.inf
        )

    def _candidate(self, arcs: FloatArray) -> _Candidate | None:
        """The path along some arcs, priced; None if it does not cost what a plan may cost."""
        world = self.world
        length = float(arcs[:, 0].sum())
        turns = float(np.abs(arcs[:, 0] * arcs[:, 1]).sum())
        capacity = 3 * int(length / self.pricing.spacing + turns / 0.15 + len(arcs)) + 200
        path = make_path(capacity, len(world.movables))
        count = lay_out(world.robot_pose, arcs, path, self.pricing)
        path.objects[0] = world.movables.poses
        cost = price_from(path, 0, count, np.inf, self.pricing, self.bodies, self.settings)
        if not self._solved(cost):
            return None
        self._keep(path, count, cost)
        return _Candidate(path, make_path(capacity, len(world.movables)), count, cost)

    def _finish(self, candidate: _Candidate) -> None:
        """Repair a path for as long as that pays."""
        while not self.stopped():
            before = candidate.cost
            self._repair(candidate, self.config.repairs)
            if candidate.cost > (1.0 - self.config.least_gain) * before:
                return
