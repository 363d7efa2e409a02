"""`RenewingFollower`: looks for a better plan each time the robot has gone some distance."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol, runtime_checkable

import numpy as np

from pushplan.interaction.path_sweepers import default_interaction
from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.planners.following.replanning import Replanning
from pushplan.world import Planner, Stop, Twist, World


@runtime_checkable
class PreparedPlanner(Protocol):
    """A planner that makes what depends on the robot alone before its first call."""

    def prepare(self, world: World) -> None:
        """Make it; it is kept."""
        ...


class RenewingFollower(PlanFollower):
    """Makes new plans at distances that go with the size of the robot.

    Args:
        planner: makes the plans.
        renewal: distance between them [circumscribed radii].
        replanning: further reasons for a new plan, and how much better it has to be.
        stop: stop rule of each planning call; the planner's own budget if None.
    """

    def __init__(
        self,
        planner: Planner,
        *,
        renewal: float,
        replanning: Replanning | None = None,
        stop: Stop | None = None,
    ) -> None:
        super().__init__(planner, replanning=replanning, stop=stop)
        self._renewal = renewal

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Forget the last episode, and measure the robot of this one."""
        every = self._renewal * world.robot.circumscribed_radius
        self.replanning = replace(self.replanning, every_metres=every)
        if isinstance(self.planner, PreparedPlanner):
            self.planner.prepare(world)
        super().reset(world, rng)

    def _act(self, world: World) -> Twist:
        self.interaction = default_interaction(world)  # open water may get its first obstacle
        return super()._act(world)
