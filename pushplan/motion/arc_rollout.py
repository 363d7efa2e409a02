"""Driving arcs and paths with the objects carried along, compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.interaction.advance import advance_objects
from pushplan.motion.collision import is_free
from pushplan.motion.dubins import along_arc, sample_pieces, step_along
from pushplan.motion.goal_region import in_goal
from pushplan.motion.path_problem import PathProblem, SweptPath
from pushplan.world.checks import FloatArray


class ArcMemory(NamedTuple):
    """Memory that `roll_arc` reuses, and what it found."""

    corners: FloatArray  # (V, 2) of the footprint
    end: FloatArray  # (3,) pose that was reached
    last: FloatArray  # (3,) pose before it
    objects: FloatArray  # (K, 3) poses of the objects there
    moved: FloatArray  # (K,) path lengths of the objects along the arc [m]


@kernel(allocates=True)
def make_arc_memory(problem: PathProblem) -> ArcMemory:
    """Memory for `roll_arc`; one per thread."""
    count = problem.contacts.radii.shape[0]
    corners = np.empty_like(problem.footprint.vertices)
    return ArcMemory(corners, np.empty(3), np.empty(3), np.empty((count, 3)), np.empty(count))


@kernel
def roll_arc(
    problem: PathProblem,
    start: FloatArray,  # (3,) pose
    objects: FloatArray,  # (K, 3) poses of the objects there
    longest: float,  # length of the arc [m]
    curvature: float,  # [1/m]
    memory: ArcMemory,  # receives the end
) -> float:
    """Length driven [m]: less than the arc's where it enters the goal, 0 where it is blocked."""
    steps = int(np.ceil(longest / step_along(curvature, problem.spacing)))
    copy_into(memory.objects, objects)
    memory.moved[:] = 0.0
    end = memory.end
    last = memory.last
    copy_into(last, start)
    for step in range(1, steps + 1):
        length = longest * step / steps
        along_arc(start, length, curvature, end)
        if not is_free(end, problem.footprint, problem.walls, memory.corners):
            return 0.0
        if not advance_objects(problem.contacts, last, end, memory.objects, memory.moved):
            return 0.0
        if in_goal(end[0], end[1], problem.goal):
            return length
        copy_into(last, end)
    return longest


@kernel
def work_of(moved: FloatArray, inverse_masses: FloatArray) -> float:
    """Sum over the objects of mass times path length [kg m]."""
    work = 0.0
    for k in range(moved.shape[0]):
        work += moved[k] / inverse_masses[k]
    return work


@kernel(allocates=True)
def sweep_cost(
    path: SweptPath,  # poses up to ``count``; objects, lengths and works up to ``first``
    first: int,  # the last pose whose cost is known
    count: int,  # poses in use
    limit: float,  # cost at which there is no point in going on [kg m]
    patience: int,  # pairs of objects that are tested at most, where many lie in a heap
    problem: PathProblem,
) -> float:
    """Cost [kg m] of a path, filled in from ``first`` on; inf past ``limit`` or ``patience``."""
    contacts = problem.contacts
    contacts.tests[0] = 0
    moved = np.zeros(contacts.radii.shape[0])
    m0 = problem.robot_mass
    weight = problem.push_weight
    for n in range(first + 1, count):
        dx = path.poses[n, 0] - path.poses[n - 1, 0]
        dy = path.poses[n, 1] - path.poses[n - 1, 1]
        path.lengths[n] = path.lengths[n - 1] + np.sqrt(dx * dx + dy * dy)
        copy_into(path.objects[n], path.objects[n - 1])
        moved[:] = 0.0
        free = advance_objects(contacts, path.poses[n - 1], path.poses[n], path.objects[n], moved)
        path.works[n] = path.works[n - 1] + work_of(moved, contacts.inverse_masses)
        if not free:
            path.lengths[n] += problem.jam_length
        too_costly = m0 * path.lengths[n] + weight * path.works[n] >= limit
        if too_costly or contacts.tests[0] > patience:
            return np.inf
    cost: float = m0 * path.lengths[count - 1] + weight * path.works[count - 1]
    return cost


@kernel
def lay_out(
    start: FloatArray,  # (3,) first pose
    arcs: FloatArray,  # (E, 2) length [m] and curvature [1/m]
    path: SweptPath,  # receives poses and curvatures
    problem: PathProblem,
) -> int:
    """Write the poses of arcs into a path, up to the goal; returns their number, 0: no room."""
    copy_into(path.poses[0], start)
    path.curvatures[0] = 0.0
    found = sample_pieces(start, arcs, problem.spacing, path.poses[1:], path.curvatures[1:])
    if found < 0:
        return 0
    for i in range(found + 1):
        if in_goal(path.poses[i, 0], path.poses[i, 1], problem.goal):
            return i + 1
    return found + 1
