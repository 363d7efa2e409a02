"""Shortcutting of drivable paths at random with Dubins curves, compiled.

A piece of the path is replaced by a Dubins path, straight across, through a displaced pose, or to
another end in the goal; the objects are swept along with the candidate from the piece on, and it
is kept when m₀ l₀ + w Σ mᵢ lᵢ falls. Shortcutting is Geraerts and Overmars (2007); what is added
is that the cost of every candidate holds the interaction that it would cause.
"""

from __future__ import annotations

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.motion.arc_rollout import sweep_cost
from pushplan.motion.collision import first_blocked
from pushplan.motion.dubins import dubins, sample_pieces
from pushplan.motion.goal_region import in_goal
from pushplan.motion.path_problem import PathProblem, SweptPath
from pushplan.motion.shortcut_kernels import copy_rest, copy_start, displace
from pushplan.world.checks import FloatArray

PATIENCE = 1_500
"""Pairs of objects that may be tested for one shortcut; that takes some milliseconds."""


@kernel(allocates=True)
def _new_end(
    at: FloatArray, last: FloatArray, draw: FloatArray, problem: PathProblem
) -> FloatArray:
    """A pose in the goal near ``last`` that a robot at ``at`` would drive straight into."""
    goal = problem.goal
    end = np.empty(3)
    if goal[0] == 0.0:
        angle = np.arctan2(last[1] - goal[2], last[0] - goal[1]) + 0.6 * draw[0]
        end[0] = goal[1] + 0.999 * goal[3] * np.cos(angle)
        end[1] = goal[2] + 0.999 * goal[3] * np.sin(angle)
    else:
        behind = (last[0] - goal[1]) * goal[3] + (last[1] - goal[2]) * goal[4]
        behind -= 1e-5 * problem.spacing
        shift = problem.displacement * draw[0]
        end[0] = last[0] - behind * goal[3] - shift * goal[4]
        end[1] = last[1] - behind * goal[4] + shift * goal[3]
    # heading at the end of the turn-then-straight path: nearly the bearing from here
    end[2] = np.arctan2(end[1] - at[1], end[0] - at[0]) + 0.1 * draw[1]
    turn = (end[2] - at[2] + np.pi) % (2.0 * np.pi) - np.pi
    gap = np.sqrt((end[0] - at[0]) ** 2 + (end[1] - at[1]) ** 2)
    # a turn before the straight shifts the bearing by about r (1 - cos turn) / gap
    shifted = problem.turning_radius * (1.0 - np.cos(turn)) / max(gap, problem.turning_radius)
    end[2] += np.sign(turn) * min(shifted, 0.5)
    return end


@kernel
def _pick_piece(count: int, draw: FloatArray) -> tuple[int, int]:
    """First and last pose of the piece to replace: short pieces as often as long ones."""
    span = int(2 + (count - 2) * draw[0] * draw[0])
    first = int(draw[1] * (count - span))
    return first, min(first + span, count - 1)


@kernel(allocates=True)
def _propose(
    path: SweptPath,
    count: int,
    draw: FloatArray,
    normal: FloatArray,
    problem: PathProblem,
    trial: SweptPath,
) -> tuple[int, int, int]:
    """Write a candidate: last pose as in ``path``, number of new poses, of all poses (0: none)."""
    pieces = np.empty((3, 2))
    to_end = draw[2] < 0.2
    first, last = _pick_piece(count, draw)
    if to_end:
        last = count - 1
        first = max(0, count - 1 - (last - first))
    at = path.poses[first]
    target = path.poses[last]
    if to_end:
        target = _new_end(at, path.poses[count - 1], normal, problem)
    size = copy_start(path.poses, path.curvatures, first, trial.poses, trial.curvatures)
    via = np.empty(3)
    stops = 1
    if not to_end and draw[2] < 0.65 and last - first > 3:
        stops = 2
        # displacements of all sizes, from fine adjustments to another side of a box
        shift = problem.displacement * normal[0] * 10.0 ** (-1.5 * draw[3])
        turn = 0.3 * normal[1] * 10.0 ** (-1.5 * draw[3])
        displace(path.poses[(first + last) // 2], shift, turn, via)
    for stop in range(stops):
        goal = via if stops == 2 and stop == 0 else target
        here = trial.poses[size - 1]
        dubins(here, goal, problem.turning_radius, pieces)
        added = sample_pieces(
            here, pieces, problem.spacing, trial.poses[size:], trial.curvatures[size:]
        )
        if added < 0:
            return first, 0, 0
        size += added
    new = size - first - 1
    arrived = trial.poses[size - 1]
    miss = abs(arrived[0] - target[0]) + abs(arrived[1] - target[1])
    if miss > 1e-3 * problem.spacing or (
        to_end and not in_goal(arrived[0], arrived[1], problem.goal)
    ):
        return first, 0, 0
    rest = count - 1 - last
    if to_end or rest == 0:
        return first, new, size
    if size + rest > trial.poses.shape[0]:
        return first, 0, 0
    old = path.poses[:count]
    curvatures = path.curvatures[:count]
    size = copy_rest(old, curvatures, last, trial.poses, trial.curvatures, size)
    return first, new, size


@kernel(allocates=True)
def shortcut(
    path: SweptPath,  # changed in place
    count: int,  # its poses in use
    cost: float,  # its cost [kg m]
    draws: FloatArray,  # (I, 4) uniform in [0, 1)
    normals: FloatArray,  # (I, 2) standard normal
    trial: SweptPath,  # memory of the same size as ``path``
    problem: PathProblem,
) -> tuple[int, float]:
    """Try a shortcut for each row of ``draws``; returns number of poses and cost of the path."""
    shape = problem.footprint
    scratch = np.empty_like(shape.vertices)
    m0 = problem.robot_mass
    weight = problem.push_weight
    for i in range(draws.shape[0]):
        if count < 4:
            break
        first, new, size = _propose(path, count, draws[i], normals[i], problem, trial)
        if size == 0:
            continue
        # no sweep can make up for a path that is too long by itself
        length = path.lengths[first]
        for n in range(first + 1, size):
            dx = trial.poses[n, 0] - trial.poses[n - 1, 0]
            dy = trial.poses[n, 1] - trial.poses[n - 1, 1]
            length += np.sqrt(dx * dx + dy * dy)
        if m0 * length + weight * path.works[first] >= cost:
            continue
        if first_blocked(trial.poses[first + 1 :], new, shape, problem.walls, scratch) < new:
            continue
        trial.lengths[first] = path.lengths[first]
        trial.works[first] = path.works[first]
        copy_into(trial.objects[first], path.objects[first])
        found = sweep_cost(trial, first, size, cost, PATIENCE, problem)
        if found < (1.0 - 1e-9) * cost:
            for n in range(first + 1, size):
                copy_into(path.poses[n], trial.poses[n])
                path.curvatures[n] = trial.curvatures[n]
                copy_into(path.objects[n], trial.objects[n])
                path.lengths[n] = trial.lengths[n]
                path.works[n] = trial.works[n]
            cost = found
            count = size
    return count, cost
