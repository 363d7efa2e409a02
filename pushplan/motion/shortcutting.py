"""Make a path cheaper without leaving what the robot can drive: random Dubins repairs, compiled.

A piece of the path is replaced by a Dubins path, straight across, through a displaced pose, or to
another end in the goal; the objects are swept along with the candidate from the piece on, and it
is kept when m₀ l₀ + w Σ mᵢ lᵢ falls. Shortcutting is Geraerts and Overmars (2007); what is added
is that every candidate is priced by the interaction that it would cause.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.interaction.kernels import Bodies, Settings, advance, make_scratch
from pushplan.motion.collision import Footprint, Obstacles, first_blocked
from pushplan.motion.dubins import dubins, sample_pieces
from pushplan.world import GoalDisc, NavigationGoal
from pushplan.world.checks import FloatArray

PATIENCE = 1_500
"""Pairs of objects that may be tested for one repair; that takes some milliseconds."""


class Pricing(NamedTuple):
    """What a path costs and where it may go."""

    robot_mass: float
    """m₀ [kg]"""
    push_weight: float
    """w: price of a unit of interaction work."""
    radius: float
    """Least turning radius [m]."""
    spacing: float
    """Greatest distance between two poses of a path [m]."""
    jam: float
    """Added to a path's length at each pose where the robot jams [m], to tell it from any other."""
    spread: float
    """Typical sideways displacement that is tried [m]."""
    goal: FloatArray
    """(5,) 0, x, y, radius, 0 for a disc; 1, x, y, n_x, n_y for a line."""


class Path(NamedTuple):
    """A path with its price; buffers are longer than the ``count`` poses that are in use."""

    poses: FloatArray
    """(M, 3)"""
    curvatures: FloatArray
    """(M,) curvature of the arc that leads to each pose [1/m]"""
    objects: FloatArray
    """(M, K, 3) where the objects are when the robot is at each pose"""
    lengths: FloatArray
    """(M,) path length so far [m]"""
    works: FloatArray
    """(M,) interaction work so far [kg m]"""


def goal_numbers(goal: NavigationGoal, inset: float) -> FloatArray:
    """The goal as `Pricing` holds it, entered by ``inset`` [m] so that noise does not miss it."""
    if isinstance(goal, GoalDisc):
        radius = max(goal.radius - inset, 0.5 * goal.radius)
        return np.array([0.0, goal.center[0], goal.center[1], radius, 0.0])
    point = goal.point + inset * goal.normal
    return np.array([1.0, point[0], point[1], goal.normal[0], goal.normal[1]])


def make_path(capacity: int, objects: int) -> Path:
    """Empty buffers for ``capacity`` poses and ``objects`` objects."""
    return Path(
        np.empty((capacity, 3)),
        np.zeros(capacity),
        np.empty((capacity, objects, 3)),
        np.zeros(capacity),
        np.zeros(capacity),
    )


@kernel(allocates=True)
def in_goal(x: float, y: float, goal: FloatArray) -> bool:
    """Whether a point counts as the goal."""
    if goal[0] == 0.0:
        inside: bool = (x - goal[1]) ** 2 + (y - goal[2]) ** 2 <= goal[3] ** 2
    else:
        inside = (x - goal[1]) * goal[3] + (y - goal[2]) * goal[4] >= 0.0
    return inside


@kernel(allocates=True)
def price_from(
    path: Path,
    first: int,
    count: int,
    limit: float,
    patience: int,
    pricing: Pricing,
    bodies: Bodies,
    settings: Settings,
) -> float:
    """Sweep the objects along the poses after ``first`` and fill in lengths and works.

    Args:
        path: poses up to ``count``; objects, lengths and works up to ``first``.
        first: the last pose whose price is known.
        count: poses in use.
        limit: cost at which there is no point in going on [kg m].
        patience: pairs of objects that are tested at most, where many lie in a heap.
        pricing: masses and weight.
        bodies: shapes for the sweep.
        settings: of the sweep.

    Returns:
        The cost [kg m], infinite where it passes ``limit`` or takes too long to find.
    """
    scratch = make_scratch(bodies)
    objects = bodies.radii.shape[0]
    moved = np.zeros(objects)
    m0, weight = pricing.robot_mass, pricing.push_weight
    for n in range(first + 1, count):
        dx = path.poses[n, 0] - path.poses[n - 1, 0]
        dy = path.poses[n, 1] - path.poses[n - 1, 1]
        path.lengths[n] = path.lengths[n - 1] + np.sqrt(dx * dx + dy * dy)
        path.objects[n] = path.objects[n - 1]
        moved[:] = 0.0
        free = advance(
            path.poses[n - 1], path.poses[n], path.objects[n], moved, bodies, settings, scratch
        )
        work = 0.0
        for k in range(objects):
            work += moved[k] / bodies.inverse_masses[k]
        path.works[n] = path.works[n - 1] + work
        if not free:
            path.lengths[n] += pricing.jam
        too_dear = m0 * path.lengths[n] + weight * path.works[n] >= limit
        if too_dear or scratch.tests[0] > patience:
            return np.inf
    cost: float = m0 * path.lengths[count - 1] + weight * path.works[count - 1]
    return cost


@kernel(allocates=True)
def lay_out(start: FloatArray, arcs: FloatArray, path: Path, pricing: Pricing) -> int:
    """Write the poses of consecutive arcs into a path, cut off where the goal is reached.

    Args:
        start: (3,) first pose.
        arcs: (E, 2) length [m] and curvature [1/m].
        path: receives poses and curvatures.
        pricing: spacing and goal.

    Returns:
        The number of poses, or 0 if they do not fit.
    """
    path.poses[0] = start
    path.curvatures[0] = 0.0
    found = sample_pieces(start, arcs, pricing.spacing, path.poses[1:], path.curvatures[1:])
    if found < 0:
        return 0
    for i in range(found + 1):
        if in_goal(path.poses[i, 0], path.poses[i, 1], pricing.goal):
            return i + 1
    return found + 1


@kernel(allocates=True)
def _new_end(at: FloatArray, last: FloatArray, draw: FloatArray, pricing: Pricing) -> FloatArray:
    """A pose in the goal near ``last`` that a robot at ``at`` would drive straight into."""
    goal = pricing.goal
    end = np.empty(3)
    if goal[0] == 0.0:
        angle = np.arctan2(last[1] - goal[2], last[0] - goal[1]) + 0.6 * draw[0]
        end[0] = goal[1] + 0.999 * goal[3] * np.cos(angle)
        end[1] = goal[2] + 0.999 * goal[3] * np.sin(angle)
    else:
        behind = (last[0] - goal[1]) * goal[3] + (last[1] - goal[2]) * goal[4] - 1e-6
        shift = pricing.spread * draw[0]
        end[0] = last[0] - behind * goal[3] - shift * goal[4]
        end[1] = last[1] - behind * goal[4] + shift * goal[3]
    # heading at the end of the turn-then-straight path: nearly the bearing from here
    end[2] = np.arctan2(end[1] - at[1], end[0] - at[0]) + 0.1 * draw[1]
    turn = (end[2] - at[2] + np.pi) % (2.0 * np.pi) - np.pi
    gap = np.sqrt((end[0] - at[0]) ** 2 + (end[1] - at[1]) ** 2)
    # a turn before the straight shifts the bearing by about r (1 - cos turn) / gap
    shifted = pricing.radius * (1.0 - np.cos(turn)) / max(gap, pricing.radius)
    end[2] += np.sign(turn) * min(shifted, 0.5)
    return end


@kernel(allocates=True)
def _pick_piece(count: int, draw: FloatArray) -> tuple[int, int]:
    """First and last pose of the piece to replace: short pieces as often as long ones."""
    span = int(2 + (count - 2) * draw[0] * draw[0])
    first = int(draw[1] * (count - span))
    return first, min(first + span, count - 1)


@kernel(allocates=True)
def _propose(
    path: Path,
    count: int,
    draw: FloatArray,
    normal: FloatArray,
    pricing: Pricing,
    trial: Path,
) -> tuple[int, int, int]:
    """Write a candidate into ``trial``.

    Returns:
        The last pose that it shares with ``path``, the number of new poses, and its length in
        poses; 0 in the end if it does not fit.
    """
    pieces = np.empty((3, 2))
    to_end = draw[2] < 0.2
    first, last = _pick_piece(count, draw)
    if to_end:
        last = count - 1
        first = max(0, count - 1 - (last - first))
    at = path.poses[first]
    target = path.poses[last]
    if to_end:
        target = _new_end(at, path.poses[count - 1], normal, pricing)
    trial.poses[: first + 1] = path.poses[: first + 1]
    trial.curvatures[: first + 1] = path.curvatures[: first + 1]
    size = first + 1
    via = np.empty(3)
    stops = 1
    if not to_end and draw[2] < 0.65 and last - first > 3:
        stops = 2
        middle = path.poses[(first + last) // 2]
        # displacements of all sizes, from fine adjustments to another side of a box
        shift = pricing.spread * normal[0] * 10.0 ** (-1.5 * draw[3])
        via[0] = middle[0] - shift * np.sin(middle[2])
        via[1] = middle[1] + shift * np.cos(middle[2])
        via[2] = middle[2] + 0.3 * normal[1] * 10.0 ** (-1.5 * draw[3])
    for stop in range(stops):
        goal = via if stops == 2 and stop == 0 else target
        here = trial.poses[size - 1].copy()
        dubins(here, goal, pricing.radius, pieces)
        added = sample_pieces(
            here, pieces, pricing.spacing, trial.poses[size:], trial.curvatures[size:]
        )
        if added < 0:
            return first, 0, 0
        size += added
    new = size - first - 1
    arrived = trial.poses[size - 1]
    miss = abs(arrived[0] - target[0]) + abs(arrived[1] - target[1])
    if miss > 1e-3 * pricing.spacing or (
        to_end and not in_goal(arrived[0], arrived[1], pricing.goal)
    ):
        return first, 0, 0
    rest = count - 1 - last
    if to_end or rest == 0:
        return first, new, size
    if size + rest > trial.poses.shape[0]:
        return first, 0, 0
    trial.poses[size : size + rest] = path.poses[last + 1 : count]
    # the new piece may end with whole turns more or less than the old one
    turns = np.round((trial.poses[size - 1, 2] - path.poses[last, 2]) / (2.0 * np.pi))
    trial.poses[size : size + rest, 2] += 2.0 * np.pi * turns
    trial.curvatures[size : size + rest] = path.curvatures[last + 1 : count]
    return first, new, size + rest


@kernel(allocates=True)
def improve(
    path: Path,
    count: int,
    cost: float,
    draws: FloatArray,
    normals: FloatArray,
    trial: Path,
    pricing: Pricing,
    shape: Footprint,
    among: Obstacles,
    bodies: Bodies,
    settings: Settings,
) -> tuple[int, float]:
    """Try one random repair for each row of ``draws``; keep those that lower the cost.

    Args:
        path: the path, changed in place.
        count: its poses in use.
        cost: its cost [kg m].
        draws: (I, 4) uniform in [0, 1).
        normals: (I, 2) standard normal.
        trial: memory of the same size as ``path``.
        pricing: what a path costs.
        shape: footprint with its margin.
        among: what it must not touch.
        bodies: shapes for the sweep.
        settings: of the sweep.

    Returns:
        Number of poses and cost [kg m] of the path.
    """
    scratch = np.empty_like(shape.vertices)
    m0, weight = pricing.robot_mass, pricing.push_weight
    for i in range(draws.shape[0]):
        if count < 4:
            break
        first, new, size = _propose(path, count, draws[i], normals[i], pricing, trial)
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
        if first_blocked(trial.poses[first + 1 :], new, shape, among, scratch) < new:
            continue
        trial.lengths[first] = path.lengths[first]
        trial.works[first] = path.works[first]
        trial.objects[first] = path.objects[first]
        price = price_from(trial, first, size, cost, PATIENCE, pricing, bodies, settings)
        if price < (1.0 - 1e-9) * cost:
            for n in range(first + 1, size):
                path.poses[n] = trial.poses[n]
                path.curvatures[n] = trial.curvatures[n]
                path.objects[n] = trial.objects[n]
                path.lengths[n] = trial.lengths[n]
                path.works[n] = trial.works[n]
            cost, count = price, size
    return count, cost
