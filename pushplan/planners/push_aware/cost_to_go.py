"""Least driven length to the goal from every pose, around walls and under the turn limit.

The core's `CostToGo` is the value function of a forward car of bounded curvature on a grid of
(x, y, heading). Objects are not in it, so one table serves every call on a map; it is made and kept
a little at a time.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable

from pushplan.core import planners as core
from pushplan.motion.collision import footprint, goal_numbers, obstacles
from pushplan.world import NavigationGoal, RobotModel, StaticMap


class CostToGoMaker:
    """Makes one table in small steps, so that a planning call can stop in between.

    What is done is kept for the next call. Thread-safe.
    """

    def __init__(
        self,
        robot: RobotModel,  # gives footprint and size
        static: StaticMap,  # the map
        goal: NavigationGoal,
        radius: float,  # least turning radius [m]
        inset: float,  # depth in the goal at which paths end [m]
    ) -> None:
        self._table = core.CostToGo(
            footprint(robot),
            obstacles(static),
            goal_numbers(goal, inset),
            robot.circumscribed_radius,
            radius,
        )
        self._lock = threading.Lock()

    def make(self, stopped: Callable[[], bool]) -> core.CostToGo | None:
        """Work until the table is done; None if the stop rule fires before, or it is of no use."""
        table = self._table
        while not table.done:
            if stopped():
                return None
            with self._lock:
                table.step()
        return table if table.useful else None


cost_to_go_maker = functools.lru_cache(maxsize=8)(CostToGoMaker)
"""The maker of a table, with what is done of it; cached."""
