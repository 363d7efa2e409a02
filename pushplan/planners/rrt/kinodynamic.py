"""`KinodynamicRRT`: a random tree of drivable arcs, made cheaper until the stop rule fires."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pushplan.interaction import InteractionModel, QuasiStatic
from pushplan.motion.path_planner import plan_path
from pushplan.motion.path_search_config import PathSearchConfig
from pushplan.world import PlanResult, Stop, World
from pushplan.world.checks import expect
from pushplan.world.planning_call import PlanningCall
from pushplan.world.stop import DefaultBudget


@dataclass(frozen=True)
class KinodynamicRRTConfig(PathSearchConfig):
    """Parameters of `KinodynamicRRT`, all of them described in `PathSearchConfig`."""


@dataclass(frozen=True)
class KinodynamicRRT:
    """Kinodynamic RRT for a robot with bounded turn rate that may push what is in its way.

    The first plan is a drive along the shortest path around the walls, if the robot can drive it.
    Then trees of arcs grow from the robot among the objects (LaValle and Kuffner 2001); targets
    are drawn mostly around a coarse path that already trades length for pushing. Paths are
    shortcut at random with Dubins curves, each candidate at the cost m₀ l₀ + w Σ mᵢ lᵢ that the
    interaction model predicts; the cheapest one is returned when the stop rule fires.
    Constant-speed robots turn no tighter than v / ω; differential drives slow down in tight turns.

    Use it where a first plan is needed in milliseconds and the world is two-dimensional with
    convex objects. Without a stop rule it returns after a fixed number of iterations, so the same
    seed gives the same plan.

    Args:
        config: parameters.
        interaction: predicts the objects; a model without a compiled form is slow here.
    """

    config: KinodynamicRRTConfig = field(default_factory=KinodynamicRRTConfig)
    interaction: InteractionModel = field(default_factory=QuasiStatic)

    def __post_init__(self) -> None:
        expect("config", self.config, KinodynamicRRTConfig)
        expect("interaction", self.interaction, InteractionModel)  # type: ignore[type-abstract]

    def plan(
        self, world: World, *, stop: Stop | None = None, rng: np.random.Generator | None = None
    ) -> PlanResult:
        """Plan from ``world``; see `pushplan.world.Planner`.

        One iteration is an edge or a shortcut.

        Raises:
            InvalidInputError: if the world's goal is not one for the robot.
        """
        call = PlanningCall(world, stop, rng, DefaultBudget(self.config.default_iterations))
        return plan_path(call, self.config, self.interaction, "kinodynamic")
