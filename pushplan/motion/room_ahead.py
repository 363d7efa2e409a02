"""Whether a robot that can neither reverse nor turn on the spot gets away from where it stands."""

from __future__ import annotations

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.motion.collision import is_free
from pushplan.motion.dubins import along_arc
from pushplan.motion.goal_region import in_goal
from pushplan.motion.path_problem import PathProblem
from pushplan.world.checks import FloatArray

_STEP = 0.08  # length of a step [circumscribed radii]
_CELL = 0.6  # sides of the boxes of poses of which one is looked at each [steps]
_LEAST_TURN = 0.02  # the same of headings at least [rad]
_REACH = 3.0  # distance at which the robot has got away [circumscribed radii]
_MOST = 5_000  # poses that are looked at; then it counts as getting away


@kernel(allocates=True)
def gets_away(problem: PathProblem, start: FloatArray, size: float) -> bool:
    """Tell whether forward arcs lead from a pose (3,) to the goal or three robot sizes away.

    Steps straight ahead and of the least turning radius are tried depth first; objects do not
    count, as they may be pushed.

    Args:
        problem: where the robot may go.
        start: (3,) pose of the robot.
        size: its circumscribed radius [m].
    """
    step = _STEP * size
    cell = _CELL * step
    turn = min(max(cell / problem.turning_radius, _LEAST_TURN), np.pi)
    half, turns = int(_REACH * size / cell) + 2, int(np.ceil(2.0 * np.pi / turn))
    seen = np.zeros((2 * half + 1, 2 * half + 1, turns), dtype=np.bool_)
    stack, pose = np.empty((3 * _MOST, 3)), np.empty(3)
    scratch = np.empty_like(problem.footprint.vertices)
    copy_into(stack[0], start)
    count, looked_at = 1, 0
    while count and looked_at < _MOST:
        count -= 1
        here = stack[count].copy()
        looked_at += 1
        for side in (-1.0, 1.0, 0.0):  # straight ahead is taken up first
            along_arc(here, step, side / problem.turning_radius, pose)
            if not is_free(pose, problem.footprint, problem.walls, scratch):
                continue
            dx, dy = pose[0] - start[0], pose[1] - start[1]
            away = dx * dx + dy * dy > (_REACH * size) ** 2
            if away or in_goal(pose[0], pose[1], problem.goal):
                return True
            j, i = half + int(np.rint(dx / cell)), half + int(np.rint(dy / cell))
            t = int(np.floor(pose[2] % (2.0 * np.pi) / turn)) % turns
            if not seen[i, j, t]:
                seen[i, j, t] = True
                copy_into(stack[count], pose)
                count += 1
    return count > 0
