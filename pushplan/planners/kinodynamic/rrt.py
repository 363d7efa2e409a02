"""`KinodynamicRRT`: a random tree of drivable arcs, made cheaper until the stop rule fires."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np

from pushplan.interaction import QuasiStatic
from pushplan.planners.kinodynamic.collision import Footprint, footprint, is_free, obstacles
from pushplan.planners.kinodynamic.guide import guide_path
from pushplan.planners.kinodynamic.improve import (
    JAM_COST,
    Path,
    Pricing,
    goal_numbers,
    improve,
    lay_out,
    make_path,
    price_from,
)
from pushplan.planners.kinodynamic.timing import reachable, start_margin, timed_plan, turning_radius
from pushplan.planners.kinodynamic.tree import TreeLimits, grow_tree
from pushplan.world import (
    MaxIterations,
    Plan,
    PlanResult,
    PlanStats,
    PlanStatus,
    Stop,
    StopCheck,
    World,
)
from pushplan.world.checks import FloatArray, integer, number


@dataclass(frozen=True)
class KinodynamicRRTConfig:
    """Parameters of `KinodynamicRRT`. Lengths are in units of the robot's circumscribed radius R.

    Args:
        push_weight: w, the price of a unit of interaction work against a unit of travel work.
        margin: clearance kept from walls [R]; less where the robot starts nearer.
        turn_share: share of the greatest turn rate that plans use; the rest is for tracking.
        inset: how far into the goal a plan ends [R].
        spacing: distance between the poses of a path [R].
        edge: longest edge of the tree [R].
        guide_share: share of targets near the coarse shortest path; the rest are uniform.
        guide_spread: standard deviation of those targets about it [R].
        avoid_iterations: tree iterations that treat objects as obstacles, before they count as
            things that may be pushed.
        tree_iterations: iterations after which a tree is given up for a new one.
        repairs: repairs tried on each tree's path before the next tree.
        batch: repairs between two looks at the stop rule.
        default_iterations: budget where no stop rule is given.
    """

    push_weight: float = 3.0
    margin: float = 0.06
    turn_share: float = 0.9
    inset: float = 0.05
    spacing: float = 0.15
    edge: float = 1.6
    guide_share: float = 0.8
    guide_spread: float = 0.5
    avoid_iterations: int = 200
    tree_iterations: int = 2000
    repairs: int = 600
    batch: int = 20
    default_iterations: int = 4000

    def __post_init__(self) -> None:
        number("push_weight", self.push_weight, low=0.0)
        for name in ("margin", "inset"):
            number(name, getattr(self, name), low=0.0, high=1.0)
        for name in ("turn_share", "guide_share"):
            number(name, getattr(self, name), low=0.0, high=1.0, open_low=name == "turn_share")
        for name in ("spacing", "edge", "guide_spread"):
            number(name, getattr(self, name), low=0.0, open_low=True)
        integer("avoid_iterations", self.avoid_iterations, low=0)
        for name in ("tree_iterations", "repairs", "batch", "default_iterations"):
            integer(name, getattr(self, name), low=1)


@dataclass(frozen=True)
class KinodynamicRRT:
    """Kinodynamic RRT for a robot with bounded turn rate that may push what is in its way.

    A tree of arcs grows from the robot, first with the objects as obstacles, then with only what
    is static (LaValle and Kuffner 2001, on OMPL); targets are drawn mostly around a coarse path
    that already trades length for pushing. The first path is repaired at random with Dubins
    curves, each candidate priced by m₀ l₀ + w Σ mᵢ lᵢ as the interaction model predicts it; the
    cheapest path over all trees is returned when the stop rule fires. Constant-speed robots turn
    no tighter than v / ω; differential drives slow down in tight turns.

    Use it where a first plan is needed in milliseconds and the world is two-dimensional with
    convex objects. Without a stop rule it returns after a fixed number of iterations, so the same
    seed gives the same plan.

    Args:
        config: parameters.
        interaction: the quasi-static model that prices contacts.
    """

    config: KinodynamicRRTConfig = field(default_factory=KinodynamicRRTConfig)
    interaction: QuasiStatic = field(default_factory=QuasiStatic)

    def plan(
        self,
        world: World,
        *,
        stop: Stop | None = None,
        rng: np.random.Generator | None = None,
    ) -> PlanResult:
        """Plan from ``world``; see `pushplan.world.Planner`. One iteration is an edge or a repair.

        Raises:
            InvalidInputError: if the world's goal is not one for the robot.
        """
        began = time.perf_counter()
        stop = MaxIterations(self.config.default_iterations) if stop is None else stop
        rng = np.random.default_rng(0) if rng is None else rng
        search = _Search(world, self.config, self.interaction, stop.start(), rng, began)
        status = search.run()
        if status is None:
            status = PlanStatus.CANCELLED if stop.cancelled else PlanStatus.TIMED_OUT
        stats = PlanStats(
            wall_time_s=time.perf_counter() - began,
            first_solution_s=search.first_solution_s,
            iterations=search.iterations,
            nodes=search.nodes,
            detail={"trees": float(search.trees)},
        )
        return PlanResult(status, search.plan() if status.has_plan else None, stats)


class _Search:
    """One planning call."""

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
        self.radius = turning_radius(world.robot, config.turn_share)
        self.pricing = Pricing(
            robot_mass=world.robot.mass,
            push_weight=float(config.push_weight),
            radius=self.radius,
            spacing=config.spacing * self.size,
            spread=1.5 * self.size,
            goal=goal_numbers(self.goal, config.inset * self.size),
        )
        self.limits = TreeLimits(
            max_curvature=1.0 / self.radius,
            edge_length=config.edge * self.size,
            spacing=config.spacing * self.size,
            turn_weight=0.5 * self.size,
        )
        self.bodies, self.settings = interaction.bodies(world), interaction.settings(world)
        self.iterations = self.nodes = self.trees = 0
        self.best: Path | None = None
        self.best_cost = np.inf
        self.first_solution_s = float("nan")

    def run(self) -> PlanStatus | None:
        """Search until the stop rule fires; None where there is no plan by then."""
        margin = start_margin(self.world, self.config.margin * self.size)
        if margin is None:
            return PlanStatus.START_BLOCKED
        if not reachable(self.world):
            return PlanStatus.GOAL_UNREACHABLE
        shape = footprint(self.world.robot, margin)
        if self.goal.distance(*self.world.robot_pose[:2]) <= 0.0:
            here = make_path(1, len(self.world.movables))
            here.poses[0] = self.world.robot_pose
            here.objects[0] = self.world.movables.poses
            self._keep(here, 1, 0.0)
            return PlanStatus.SOLVED
        avoid = True
        while not self.stopped():
            if avoid:
                self._one_tree(shape, np.inf, self.config.avoid_iterations)
                avoid = False
            if not self.stopped():
                self._one_tree(shape, self.config.push_weight, self.config.tree_iterations)
        return PlanStatus.SOLVED if self._solved(self.best_cost) else None

    def stopped(self) -> bool:
        """Whether the stop rule fires now."""
        solved = self._solved(self.best_cost)
        return self.check(self.iterations, self.best_cost if solved else np.inf)

    def _solved(self, cost: float) -> bool:
        """Whether a path of this cost is free of jams."""
        return cost < JAM_COST * self.pricing.robot_mass

    def _one_tree(self, shape: Footprint, push_weight: float, budget: int) -> None:
        """Grow a tree, lay its path out, and repair it."""
        world = self.world
        objects = world.movables
        blocked = [objects.outline_world(k) for k in range(len(objects))]
        among = obstacles(world.static, blocked if np.isinf(push_weight) else ())
        walls = obstacles(world.static)
        if not is_free(world.robot_pose, shape, among, np.empty_like(shape.vertices)):
            return  # the robot touches an object already: only pushing helps
        last = self.iterations + budget

        def done() -> bool:
            self.iterations += 1
            return self.iterations >= last or self.stopped()

        self.trees += 1
        guide = guide_path(world, push_weight)
        if len(guide) == 0:
            self.iterations += 1
            return
        arcs = grow_tree(
            world.robot_pose,
            self.goal,
            _Targets(guide, self.config, self.size, world.static.bounds, self.rng),
            self.limits,
            shape,
            among,
            int(self.rng.integers(1, 2**31)),
            done,
        )
        if arcs is None:
            return
        self.nodes += len(arcs)
        capacity = 3 * int(arcs[:, 0].sum() / self.pricing.spacing + len(arcs)) + 200
        path, trial = make_path(capacity, len(objects)), make_path(capacity, len(objects))
        count = lay_out(world.robot_pose, arcs, path, self.pricing)
        path.objects[0] = objects.poses
        cost = price_from(path, 0, count, np.inf, self.pricing, self.bodies, self.settings)
        self._keep(path, count, cost)
        for _ in range(0, self.config.repairs, self.config.batch):
            if self.stopped():
                break
            draws = self.rng.random((self.config.batch, 4))
            normals = self.rng.standard_normal((self.config.batch, 2))
            count, cost = improve(
                path,
                count,
                cost,
                draws,
                normals,
                trial,
                self.pricing,
                shape,
                walls,
                self.bodies,
                self.settings,
            )
            self.iterations += self.config.batch
            self._keep(path, count, cost)

    def _keep(self, path: Path, count: int, cost: float) -> None:
        if cost >= self.best_cost:
            return
        if np.isnan(self.first_solution_s) and self._solved(cost):
            self.first_solution_s = time.perf_counter() - self.began
        self.best_cost = cost
        self.best = Path(*(part[:count].copy() for part in path))

    def plan(self) -> Plan:
        """The best path so far as a plan."""
        assert self.best is not None
        return timed_plan(self.world, self.best, self.config.turn_share)


class _Targets:
    """Draws the poses that a tree grows towards."""

    def __init__(
        self,
        guide: FloatArray,
        config: KinodynamicRRTConfig,
        size: float,
        bounds: FloatArray,
        rng: np.random.Generator,
    ) -> None:
        self.guide, self.config, self.bounds, self.rng = guide, config, bounds, rng
        self.spread = config.guide_spread * size
        index = np.arange(len(guide))
        ahead, behind = (
            guide[np.minimum(index + 3, len(guide) - 1)],
            guide[np.maximum(index - 3, 0)],
        )
        self.headings = np.arctan2(ahead[:, 1] - behind[:, 1], ahead[:, 0] - behind[:, 0])
        self.block = np.empty((0, 3))
        self.used = 0

    def __call__(self) -> FloatArray:
        if self.used == len(self.block):
            self.block, self.used = self._draw(128), 0
        self.used += 1
        target: FloatArray = self.block[self.used - 1]
        return target

    def _draw(self, count: int) -> FloatArray:
        rng, bounds = self.rng, self.bounds
        near = rng.random(count) < self.config.guide_share
        index = rng.integers(len(self.guide), size=count)
        offsets = rng.standard_normal((count, 3)) * [self.spread, self.spread, 0.4]
        guided = np.column_stack([self.guide[index], self.headings[index]]) + offsets
        spread = rng.random((count, 3))
        low, high = [*bounds[:2], -np.pi], [*bounds[2:], np.pi]
        uniform = low + spread * (np.asarray(high) - low)
        return np.where(near[:, None], guided, uniform)
