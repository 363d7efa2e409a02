"""Random changes of a path that keep it drivable: Dubins curves through displaced poses. Compiled.

Shortcutting after Geraerts and Overmars, "Creating high-quality paths for motion planning" (2007).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.motion.shortcut_kernels import copy_rest, copy_start, displace, lay_dubins
from pushplan.world.checks import FloatArray


class ShortcutProblem(NamedTuple):
    """Constraints on a changed path, and the scale of its changes."""

    radius: float  # Least turning radius [m]
    spacing: float  # Greatest distance between two poses [m]
    spread: float  # Typical sideways displacement [m]
    most_turn: float  # Greatest turn of a curve [rad]
    end_fraction: float  # Fraction of the changes that are changes of the end
    goal: FloatArray  # (4,) point x, y and unit normal of the line where the path ends


@kernel(allocates=True)
def propose(
    path: FloatArray,  # (N, 3) poses
    curvatures: FloatArray,  # (N,) that lead to them [1/m]
    draws: FloatArray,  # (4,) uniform in [0, 1): length, place, kind and scale of the change
    normals: FloatArray,  # (2,) standard normal: sideways displacement and turn
    problem: ShortcutProblem,
    out: FloatArray,  # (M, 3) receives the poses
    out_curvatures: FloatArray,  # (M,)
) -> tuple[int, int, int]:
    """Last pose shared with ``path``, first pose of its rest in ``out``, their number or 0."""
    count = path.shape[0]
    span = int(4 + (count - 5) * draws[0])
    if count < 6 or out.shape[0] < 2 * count:
        return 0, 0, 0
    limits = (problem.radius, problem.spacing, problem.most_turn)
    shift = problem.spread * 10.0 ** (-1.3 * draws[3]) * normals[0]
    target = np.empty(3)
    if draws[2] < problem.end_fraction:  # another end: sideways, and straight into the line
        first = max(0, count - 1 - span)
        _displace_end(path[count - 1], shift, draws, normals, problem, target)
        size = copy_start(path, curvatures, first, out, out_curvatures)
        added = lay_dubins(path[first], target, limits, out[size:], out_curvatures[size:])
        if added < 1:
            return first, 0, 0
        return first, size + added, size + added
    first = int(draws[1] * (count - span))
    last = min(first + span, count - 1)
    size = copy_start(path, curvatures, first, out, out_curvatures)
    if draws[2] < 0.9:
        displace(path[(first + last) // 2], shift, 0.15 * normals[1], target)
        added = lay_dubins(path[first], target, limits, out[size:], out_curvatures[size:])
        if added < 1:
            return first, 0, 0
        size += added
    added = lay_dubins(out[size - 1], path[last], limits, out[size:], out_curvatures[size:])
    if added < 1 or size + added + count - last > out.shape[0]:
        return first, 0, 0
    size += added
    return first, size, copy_rest(path, curvatures, last, out, out_curvatures, size)


@kernel
def _displace_end(
    end: FloatArray,
    shift: float,
    draws: FloatArray,
    normals: FloatArray,
    problem: ShortcutProblem,
    out: FloatArray,
) -> None:
    """Write another end (3,) on the line, ``shift`` [m] beside the one that there is."""
    goal = problem.goal
    gap = (end[0] - goal[0]) * goal[2] + (end[1] - goal[1]) * goal[3]
    out[0] = end[0] - gap * goal[2] - shift * goal[3]
    out[1] = end[1] - gap * goal[3] + shift * goal[2]
    if draws[2] < 0.5 * problem.end_fraction:
        out[2] = np.arctan2(goal[3], goal[2]) + 0.1 * normals[1]
    else:
        out[2] = end[2] + 0.2 * normals[1]
