"""`PushAware`: paths that know what they push, better the longer one waits."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pushplan.interaction import InteractionModel, QuasiStatic
from pushplan.motion.path_planner import plan_path
from pushplan.planners.push_aware.push_aware_config import PushAwareConfig
from pushplan.world import PlanResult, Stop, World
from pushplan.world.checks import expect
from pushplan.world.planning_call import PlanningCall
from pushplan.world.stop import DefaultBudget


def cautious_model(friction: float = 0.1, static_friction: float = 0.5) -> QuasiStatic:
    """A quasi-static model in which walls hold what is squeezed against them.

    A constant-speed robot cannot back out of a squeeze, so a path must not lead into one.

    Args:
        friction: Coulomb coefficient between robot and objects.
        static_friction: the same between objects and walls.
    """
    return QuasiStatic(friction=friction, static_friction=static_friction)


@dataclass(frozen=True)
class PushAware:
    """Minimises m₀ l₀ + w Σ mᵢ lᵢ, with the objects carried along every branch of the search.

    The first plan follows the shortest path around the walls in Dubins curves, or is that of a
    kinodynamic random tree. Then best-first searches over (x, y, heading), whose nodes hold where
    the objects are by then, take turns with random trees, each under the cost of the best plan so
    far, and what they find is shortcut at random with Dubins curves. The cheapest path is returned
    when the stop rule fires; waiting longer never costs more.

    Use it where a tenth of a second is worth a better path, and the world is two-dimensional with
    convex objects. ``stats.detail`` holds ``cost``, ``bound``, which no plan can undercut, and
    ``gap``, cost / bound - 1. Without a stop rule it returns after a fixed number of iterations,
    so the same seed gives the same plan.

    Args:
        config: parameters.
        interaction: predicts the objects, `cautious_model` by default; a model without a compiled
            form is slow here.
    """

    config: PushAwareConfig = field(default_factory=PushAwareConfig)
    interaction: InteractionModel = field(default_factory=cautious_model)

    def __post_init__(self) -> None:
        expect("config", self.config, PushAwareConfig)
        expect("interaction", self.interaction, InteractionModel)  # type: ignore[type-abstract]

    def plan(
        self, world: World, *, stop: Stop | None = None, rng: np.random.Generator | None = None
    ) -> PlanResult:
        """Plan from ``world``; see `pushplan.world.Planner`.

        One iteration is an edge of a tree, an expanded node or a shortcut.

        Raises:
            InvalidInputError: if the world's goal is not one for the robot.
        """
        call = PlanningCall(world, stop, rng, DefaultBudget(self.config.default_iterations))
        return plan_path(call, self.config, self.interaction, "push_aware")
