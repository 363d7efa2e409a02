"""Is there a way around walls? A coarse answer, before a search that would take long."""

from __future__ import annotations

from collections.abc import Callable

from pushplan.core import motion as core
from pushplan.motion.collision import goal_numbers
from pushplan.motion.keep_out import keep_out
from pushplan.motion.time_slicing import never
from pushplan.world import World
from pushplan.world.static_map import core_map


def reachable(world: World, stopped: Callable[[], bool] = never) -> bool:
    """Return True if the robot's inscribed disc may get from the start to the goal around walls.

    False only where it certainly does not; ``stopped``, asked about every millisecond, ends the
    search.
    """
    robot = world.robot
    radii = robot.inscribed_radius, robot.circumscribed_radius
    goal = goal_numbers(world.navigation_goal, 0.0)
    search = core.Reachable(core_map(keep_out(world)), *radii, world.robot_pose[:2], goal)
    while not search.run():
        if stopped():
            return True
    return not search.is_sealed
