"""One call of the kinodynamic planner."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pushplan.geometry import VisibilityGraph
from pushplan.interaction import QuasiStatic
from pushplan.motion.coarse_path import guide_path, reachable
from pushplan.motion.collision import footprint, is_free, obstacles
from pushplan.motion.dubins import step_along
from pushplan.motion.polyline import polyline_plan
from pushplan.motion.shortcutting import (
    Path,
    Pricing,
    goal_numbers,
    improve,
    lay_out,
    make_path,
    price_from,
)
from pushplan.motion.speed_profile import TIGHTEST, start_margin, timed_plan, turning_radius
from pushplan.motion.time_slicing import Pace
from pushplan.planners.rrt.kinodynamic_config import KinodynamicRRTConfig
from pushplan.planners.rrt.targets import Targets
from pushplan.planners.rrt.tree import TreeLimits, grow_tree
from pushplan.world import Drive, Plan, PlanStatus, StopCheck, World
from pushplan.world.checks import FloatArray

_THIN_MARGIN = 0.05
"""Margin below which a post could hide between two poses of the usual spacing [R]."""
_LEAST_SPACING = 0.02
"""Least spacing for that reason [R]."""
_ENDLESS = 2**62


class Search:
    """One planning call: trees, their paths, and the best path so far."""

    def __init__(
        self,
        world: World,
        config: KinodynamicRRTConfig,
        interaction: QuasiStatic,
        check: StopCheck,
        rng: np.random.Generator,
        began: float,
    ) -> None:
        self.world, self.config, self.check, self.rng, self.began = world, config, check, rng, began
        self.size = world.robot.circumscribed_radius
        self.goal = world.navigation_goal
        radius = turning_radius(world.robot, config.turn_share)
        self.pricing = Pricing(
            robot_mass=world.robot.mass,
            push_weight=float(config.push_weight),
            radius=radius,
            spacing=config.spacing * self.size,
            jam=self._jam_length(),
            spread=1.5 * self.size,
            goal=goal_numbers(self.goal, config.inset * self.size),
        )
        self.limits = TreeLimits(
            max_curvature=1.0 / radius,
            edge_length=config.edge * self.size,
            spacing=config.spacing * self.size,
            turn_weight=0.5 * self.size,
        )
        self.bodies, self.settings = interaction.bodies(world), interaction.settings(world)
        self.guide_share = config.guide_share
        self.walls = obstacles(world.static)
        self.shape = footprint(world.robot)
        self.margin = 0.0
        self.rounds = 0
        self.tight = self.sealed = False
        # crowded worlds are slow to sweep: look at the stop rule more often
        self.batch = max(1, 10 * config.batch // (10 + len(world.movables)))
        self.iterations = self.nodes = self.trees = 0
        self._repair_pace, self._pricing_pace = Pace(), Pace()
        self.best: Path | None = None
        self.best_cost = np.inf
        self._exact: FloatArray | None = None
        self.first_solution_s = float("nan")

    def run(self) -> PlanStatus | None:
        """Search until the stop rule fires; None where there is no plan by then."""
        status = self._begin()
        if status is not None:
            return status
        while not self.stopped():
            self._one_round()
            if self.sealed:
                return PlanStatus.GOAL_UNREACHABLE
            if not self._solved(self.best_cost):
                self._relax()
        return PlanStatus.SOLVED if self._solved(self.best_cost) else None

    def _begin(self) -> PlanStatus | None:
        """Find the margin that can be kept; a status where the call ends here already."""
        margin = start_margin(self.world, self.config.margin * self.size)
        if margin is None:
            return PlanStatus.START_BLOCKED
        self._set_margin(margin)
        if self.goal.distance(*self.world.robot_pose[:2]) <= 0.0:
            here = make_path(1, len(self.world.movables))
            here.poses[0] = self.world.robot_pose
            here.objects[0] = self.world.movables.poses
            self._keep(here, 1, 0.0)
            return PlanStatus.SOLVED
        return None

    def _set_margin(self, margin: float) -> None:
        """Keep ``margin`` [m] from walls; with little of it poses lie closer, for what is thin."""
        self.margin = margin
        self.shape = footprint(self.world.robot, margin)
        spacing = self.config.spacing * self.size
        if margin < _THIN_MARGIN * self.size:
            spacing = min(spacing, max(2.0 * margin, _LEAST_SPACING * self.size))
        self.pricing = self.pricing._replace(spacing=spacing)
        self.limits = replace(self.limits, spacing=spacing)

    def _jam_length(self) -> float:
        """A length [m] that no path without a jam comes near."""
        world = self.world
        extent = float((world.static.bounds[2:] - world.static.bounds[:2]).sum())
        load = self.config.push_weight * float(world.movables.masses.sum()) / world.robot.mass
        return 1e4 * (extent + self.size) * (1.0 + load)

    @property
    def _jam_cost(self) -> float:
        """A cost [kg m] that no path without a jam comes near."""
        return self.pricing.jam * self.pricing.robot_mass

    def stopped(self) -> bool:
        """Whether the stop rule fires now."""
        return self.check(self.iterations, self._best_plan_cost())

    def _best_plan_cost(self) -> float:
        """The cost of the best plan [kg m], infinite while there is none."""
        return self.best_cost if self._solved(self.best_cost) else np.inf

    def _solved(self, cost: float) -> bool:
        """Whether a path of this cost is free of jams."""
        return cost < self._jam_cost

    def _one_round(self) -> None:
        """A path around the objects and one among them; the cheaper is worked out further."""
        config = self.config
        cheaper: _Candidate | None = None
        for weight, budget in (
            (np.inf, config.avoid_iterations),
            (config.push_weight, config.tree_iterations),
        ):
            if self.stopped():
                return
            candidate = self._grow(weight, budget)
            if candidate is None:
                continue
            self._repair(candidate, config.repairs)
            if cheaper is None or candidate.cost < cheaper.cost:
                cheaper = candidate
        while cheaper is not None and not self.stopped():
            before = cheaper.cost
            self._repair(cheaper, config.repairs)
            if cheaper.cost > (1.0 - config.least_gain) * before:
                return

    def _relax(self) -> None:
        """Look farther from the guide; from the second time on, with tighter turns and less margin.

        That helps where the robot starts in a tight place or has to turn round first.
        A constant-speed robot may then use its whole turn rate; one that can slow down turns on
        half the radius, to a tenth of its size.
        """
        self.guide_share *= 0.5  # the way out may be the other way
        self.rounds += 1
        if self.rounds < 2:
            return
        self._set_margin(0.4 * self.margin if self.margin > 0.01 * self.size else 0.0)
        radius = self.world.robot.turning_radius
        if self.world.robot.drive is Drive.DIFFERENTIAL:
            radius = 0.5 * self.pricing.radius
        radius = max(radius, TIGHTEST * self.size)
        self.pricing = self.pricing._replace(radius=radius)
        self.limits = replace(self.limits, max_curvature=1.0 / radius)

    def _grow(self, push_weight: float, budget: int) -> _Candidate | None:
        """The path of a new tree; an infinite weight treats objects as obstacles."""
        world = self.world
        self.trees += 1
        self.iterations += 1
        among = self.walls
        if np.isinf(push_weight):
            boxes = [world.movables.outline_world(k) for k in range(len(world.movables))]
            among = obstacles(world.static, boxes)
            if not is_free(world.robot_pose, self.shape, among, np.empty_like(self.shape.vertices)):
                return None  # the robot touches an object already: only pushing helps
        guide = guide_path(world, push_weight)
        if self.stopped():
            return None
        if len(guide) == 0:
            if self._exact is None:
                self.sealed = not reachable(world)
                if self.sealed or self.stopped():
                    return None
                self._exact = self._exact_guide()
            guide = self._exact
        last = self.iterations + budget

        def done() -> bool:
            self.iterations += 1
            return self.iterations >= last or self.stopped()

        spread = self.config.guide_spread * self.size
        arcs = grow_tree(
            world.robot_pose,
            self.goal,
            Targets(guide, self.guide_share, spread, world.static.bounds, self.rng),
            self.limits,
            self.shape,
            among,
            int(self.rng.integers(1, 2**31)),
            done,
            self.stopped,
        )
        if arcs is None:
            return None
        self.nodes += len(arcs)
        steps = [length / step_along(bend, self.pricing.spacing) for length, bend in arcs.tolist()]
        capacity = 3 * int(sum(steps) + len(arcs)) + 200
        path = make_path(capacity, len(world.movables))
        count = lay_out(world.robot_pose, arcs, path, self.pricing)
        assert count > 0  # there is room for three times as many poses
        cost = self._price(path, count, np.inf)
        if cost is None:
            return None
        self._keep(path, count, cost)
        return _Candidate(path, make_path(capacity, len(world.movables)), count, cost)

    def _price(self, path: Path, count: int, limit: float) -> float | None:
        """Sweep the objects along a path; its cost [kg m], None where it passes the limit.

        Sweeping through a crowd takes its time: None too where the stop rule fires meanwhile.
        """
        path.objects[0] = self.world.movables.poses
        cost, priced = 0.0, 1
        for first, last in self._pricing_pace.pieces(count - 1, self.stopped):
            priced = last + 1
            cost = price_from(
                path, first, priced, limit, _ENDLESS, self.pricing, self.bodies, self.settings
            )
            if not cost < limit:
                return None
        return cost if priced == count else None

    def _exact_guide(self) -> FloatArray:
        """A path around the walls alone, where the coarse grid misses a narrow way."""
        clearance = self.world.robot.inscribed_radius
        graph = VisibilityGraph(self.world.static, clearance)
        corners = graph.to_goal(self.world.robot_pose[:2], self.goal).points
        if len(corners) == 0:
            return self.world.robot_pose[None, :2]
        return polyline_plan(self.world, corners, self.size).poses[:, :2]

    def _repair(self, candidate: _Candidate, repairs: int) -> None:
        """Try a number of repairs, as long as the stop rule allows."""
        for _ in range(0, repairs, self.batch):
            if self.stopped():
                return
            draws = self.rng.random((self.batch, 4))
            normals = self.rng.standard_normal((self.batch, 2))
            # between pieces only the clock counts: what else may fire has been looked at
            late = partial(self.check, self.iterations, self._best_plan_cost())
            for first, last in self._repair_pace.pieces(self.batch, late):
                candidate.count, candidate.cost = improve(
                    candidate.path,
                    candidate.count,
                    candidate.cost,
                    draws[first:last],
                    normals[first:last],
                    candidate.trial,
                    self.pricing,
                    self.shape,
                    self.walls,
                    self.bodies,
                    self.settings,
                )
                self._keep(candidate.path, candidate.count, candidate.cost)
            self.iterations += self.batch

    def _keep(self, path: Path, count: int, cost: float) -> None:
        if cost >= self.best_cost:
            return
        if np.isnan(self.first_solution_s) and self._solved(cost):
            self.first_solution_s = time.perf_counter() - self.began
        self.best_cost = cost
        self.tight = self.rounds > 1
        self.best = Path(*(part[:count].copy() for part in path))

    def plan(self) -> Plan:
        """The best path so far as a plan."""
        assert self.best is not None
        return timed_plan(self.world, self.best, self.config.turn_share)


@dataclass
class _Candidate:
    """A path that is being repaired, with the memory for it."""

    path: Path
    trial: Path
    count: int
    cost: float
