"""The policy of the planner for navigation among movable obstacles."""

from __future__ import annotations

from typing import Any

import numpy as np

from pushplan.perception.movability import Movability
from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.planners.namo.planner import Namo
from pushplan.world import Planner, Stop, Twist, World


class NamoFollower(PlanFollower):
    """Follows plans among objects of which some may not move, whatever it is told of them.

    An object that stops the robot is believed fixed from then on, and a new plan is made without
    it. Where there is no plan any more, what was told is dropped.

    Args:
        planner: makes the plans; `Namo` by default.
        stop: stop rule of each planning call.
    """

    actions = ("velocity", "turn_rate")

    def __init__(self, planner: Planner | None = None, stop: Stop | None = None) -> None:
        super().__init__(planner or Namo(), stop=stop)
        self.movability: Movability | None = None

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Forget the last episode."""
        self.movability = Movability(world.robot)
        super().reset(world, rng)

    def act(self, world: World, observation: Any = None) -> Twist:
        """The twist for this step."""
        if self.movability is None:
            self.reset(world, self._rng)
        assert self.movability is not None
        twist = super().act(self.movability.update(world), observation)
        if self.plan_log and not self.plan_log[-1].status.has_plan:
            self.movability.drop_prior()
        self.movability.send(twist)
        return twist


def namo(planner: Planner | None = None, stop: Stop | None = None) -> NamoFollower:
    """Opens closed ways on purpose, and drives as ``push-aware`` where the way is open.

    Args:
        planner: `Namo` by default.
        stop: stop rule of each planning call.
    """
    return NamoFollower(planner, stop)
