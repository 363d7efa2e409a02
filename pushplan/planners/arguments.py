"""Checks that planners and policies make before they begin."""

from __future__ import annotations

from pushplan.world import Drive, InvalidInputError, World


def check_pusher(world: World) -> None:
    """Refuse a world in which no object can be pushed to a goal.

    Args:
        world: the snapshot.

    Raises:
        InvalidInputError: if the goal is one for the robot, or the robot cannot stop.
    """
    if world.robot.drive is not Drive.DIFFERENTIAL:
        raise InvalidInputError("pushing objects needs a robot with a differential drive")
    _ = world.area_goal
