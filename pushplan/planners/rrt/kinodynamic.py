"""`KinodynamicRRT`: a random tree of drivable arcs, made cheaper until the stop rule fires."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np

from pushplan.interaction import QuasiStatic
from pushplan.planners.arguments import check_call
from pushplan.planners.rrt.kinodynamic_config import KinodynamicRRTConfig
from pushplan.planners.rrt.kinodynamic_search import Search
from pushplan.world import PlanResult, PlanStats, PlanStatus, Stop, StopCheck, World
from pushplan.world.checks import expect


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

    def __post_init__(self) -> None:
        expect("config", self.config, KinodynamicRRTConfig)
        expect("interaction", self.interaction, QuasiStatic)

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
        check_call(world, stop, rng)
        stop = DefaultBudget(self.config.default_iterations) if stop is None else stop
        rng = np.random.default_rng(0) if rng is None else rng
        search = Search(world, self.config, self.interaction, stop.start(), rng, began)
        status = search.run()
        if status is None:
            status = PlanStatus.CANCELLED if stop.cancelled else PlanStatus.TIMED_OUT
        stats = PlanStats(
            wall_time_s=time.perf_counter() - began,
            first_solution_s=search.first_solution_s,
            iterations=search.iterations,
            nodes=search.nodes,
            detail={"trees": float(search.trees), "tight": float(search.tight)},
        )
        return PlanResult(status, search.plan() if status.has_plan else None, stats)


@dataclass(frozen=True)
class DefaultBudget(Stop):
    """A number of iterations, and three times as many while there is no plan."""

    iterations: int

    def start(self) -> StopCheck:
        """Arm the rule for one call."""
        return lambda done, cost: done >= self.iterations * (3 if cost == np.inf else 1)
