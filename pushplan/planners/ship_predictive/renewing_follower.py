"""A follower that looks for a better plan each time the ship has gone some distance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pushplan.control import PathFollower
from pushplan.interaction.ice import IceInteraction
from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.planners.following.replanning import Replanning
from pushplan.world import Planner, Stop, World


class RenewingFollower(PlanFollower):
    """Makes new plans at distances that go with the size of the ship.

    Args:
        planner: makes the plans.
        renewal: distance between them [circumscribed radii].
        margin: as in `Replanning`; None takes each new plan.
        stop: stop rule of each planning call; the planner's own budget if None.
    """

    def __init__(
        self,
        planner: Planner,
        *,
        renewal: float = 1.2,
        margin: float | None = 0.01,
        stop: Stop | None = None,
    ) -> None:
        rule = Replanning(every_metres=renewal, margin=margin)
        super().__init__(
            planner, PathFollower(), replanning=rule, interaction=IceInteraction(), stop=stop
        )
        self._renewal = rule.every_metres

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Forget the last episode, and measure the ship of this one."""
        every = self._renewal * world.robot.circumscribed_radius
        self.replanning = replace(self.replanning, every_metres=every)
        super().reset(world, rng)
