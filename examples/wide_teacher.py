"""`push-aware-constant-speed` that plans with a quarter of a metre to the walls, as a teacher.

A network that copies a planner is never as exact as the planner. The planner itself passes the tip
of the maze's wall at a few centimetres; copies of it ran into that wall.

    pushplan dataset export --policy wide=examples/wide_teacher.py:teacher --task maze ...
"""

from pushplan.planners import make_policy
from pushplan.world import Policy

MARGIN = 0.3
"""Distance to walls, in radii of the robot; the planner's own is 0.08."""


def teacher() -> Policy:
    """The policy."""
    return make_policy("push-aware-constant-speed", margin=MARGIN)
