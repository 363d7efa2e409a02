"""`waiting_twist`: what a robot drives that has nothing to drive yet."""

from __future__ import annotations

import math

from pushplan.control.limits import clamp_twist
from pushplan.core import control as core
from pushplan.motion.collision import footprint, obstacles
from pushplan.world import Twist, World
from pushplan.world.checks import expect

_AHEAD = (1.0, 0.5, 0.25, 0.0)
"""Distances straight ahead at which circles are tried [circumscribed radii]."""
_TURNS = (0.0, 0.5, -0.5, 1.0, -1.0)
"""Turn rates of the arcs tried where no circle fits, as fractions of the greatest; first wins."""
_SPACING = 0.15  # distance between the poses that are looked at [circumscribed radii]


def waiting_twist(world: World) -> Twist:
    """Stand still; a robot that cannot drives where it can go on for longest.

    It goes straight as long as there is room a little ahead for the tightest circle that it can
    drive, and then drives that. Where no circle fits it takes the arc that stays clear of what is
    static for longest.

    Args:
        world: the scene now.
    """
    robot = expect("world", world, World).robot
    if robot.can_stop:
        return Twist(0.0, 0.0)
    shape = footprint(robot)
    walls = obstacles(world.static)
    circle = math.tau * robot.turning_radius
    step = min(_SPACING * shape.radius, circle / 16.0)

    def clear(twist: Twist, length: float, ahead: float = 0.0) -> float:
        """Return the clear length of an arc, up to ``length``, that begins straight ahead."""
        turn = step * twist.angular / twist.linear
        first = math.ceil(ahead / step)
        most = math.ceil((ahead + length) / step)
        at = world.robot_pose
        return step * core.clear_steps(step, turn, first, most, shape, walls, at) - ahead

    arcs = [clamp_twist(robot, robot.max_speed, share * robot.max_turn_rate) for share in _TURNS]
    for ahead in _AHEAD:
        for arc in arcs[-2:]:
            if clear(arc, circle, ahead * shape.radius) >= circle:
                return arcs[0] if ahead else arc
    return max(arcs, key=lambda arc: clear(arc, circle + shape.radius))
