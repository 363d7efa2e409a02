"""`PlanController`: the controller that suits a plan."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from pushplan.control import PathFollower, PurePursuit
from pushplan.geometry.angles import wrap_angle
from pushplan.world import Controller, Drive, Plan, Twist, World

_OFF = 0.05
"""Turn from pose to pose [rad] that the turn rates of a trajectory may leave unexplained."""


class PlanController:
    """`PathFollower` for trajectories, pure pursuit for paths without turn rates.

    Args:
        follows: drives whose trajectories are followed; the plans of others are pursued too.
    """

    def __init__(self, follows: Collection[Drive] = tuple(Drive)) -> None:
        self._follows = follows
        self._follower = PathFollower()
        self._pursuit = PurePursuit()
        self._plan: Plan | None = None
        self._chosen: Controller = self._follower

    def reset(self, world: World) -> None:
        """See `pushplan.world.Controller`."""
        self._follower.reset(world)
        self._pursuit.reset(world)
        self._plan = None

    def command(self, world: World, plan: Plan) -> Twist:
        """See `pushplan.world.Controller`."""
        if plan is not self._plan:
            follows = world.robot.drive in self._follows and is_trajectory(plan)
            chosen = self._follower if follows else self._pursuit
            if chosen is not self._chosen:
                chosen.reset(world)
            self._plan = plan
            self._chosen = chosen
        return self._chosen.command(world, plan)


def is_trajectory(plan: Plan) -> bool:
    """Return True if the turn rates of a plan yield its headings; those of a polyline do not."""
    turns = wrap_angle(np.diff(plan.poses[:, 2]))
    by_rates = plan.turn_rates[:-1] * np.diff(plan.times)
    return bool((np.abs(wrap_angle(turns - by_rates)) <= _OFF).all())
