"""Compiled distances of robot and box from static things under a command."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.geometry.convex import convex_distance, convex_penetration
from pushplan.geometry.obstacles import Obstacles
from pushplan.planners.pushing.contact_kernels import Contact, advance, box_pose
from pushplan.world.checks import FloatArray, IntArray

SAMPLES = 4
"""Poses checked along one command."""
HALVINGS = 4
"""How often the piece in which it comes too near is halved."""
GRAZE = 0.1
"""How fast a box that is nearer than the clearance may come nearer, per travel of the bumper: it is
pushed along a wall, and lies against it in the end."""


class ClearanceProblem(NamedTuple):
    """Footprint, box and obstacles, as the kernels read them."""

    vertices: FloatArray
    """(V, 2) corners of the robot's parts, then of the box, in their frames [m]."""
    offsets: IntArray
    own: int  # How many of the parts are the robot's
    radii: FloatArray  # (P,) of the disc about the origin that holds each part [m]
    least: float
    slack: float
    obstacles: Obstacles


@kernel(allocates=True)
def gaps(contact: Contact, state: FloatArray, problem: ClearanceProblem) -> tuple[float, float]:
    """Least distance of the robot and of the box from static things [m], negative inside one."""
    found, box, placed = np.empty(2), np.empty(3), np.empty_like(problem.vertices)
    found[:] = np.inf
    box_pose(contact, state, box)
    obstacles = problem.obstacles
    for p in range(problem.offsets.shape[0] - 1):
        kind = 1 if p >= problem.own else 0
        x, y, theta = state[0], state[1], state[2]
        if kind == 1:
            x, y, theta = box[0], box[1], box[2]
        first, last = problem.offsets[p], problem.offsets[p + 1]
        c, s = np.cos(theta), np.sin(theta)
        for i in range(first, last):
            placed[i, 0] = x + c * problem.vertices[i, 0] - s * problem.vertices[i, 1]
            placed[i, 1] = y + s * problem.vertices[i, 0] + c * problem.vertices[i, 1]
        for k in range(obstacles.radii.shape[0]):
            b = obstacles.boxes[k]
            dx = max(b[0] - x, x - b[2], 0.0)
            dy = max(b[1] - y, y - b[3], 0.0)
            if np.sqrt(dx * dx + dy * dy) - problem.radii[p] >= found[kind]:
                continue
            core = obstacles.vertices[obstacles.offsets[k] : obstacles.offsets[k + 1]]
            gap = convex_distance(placed[first:last], core)
            if gap <= 0.0:
                gap = -max(convex_penetration(placed[first:last], core)[0], 0.0)
            found[kind] = min(found[kind], gap - obstacles.radii[k])
    return found[0], found[1]


@kernel(allocates=True)
def _clear(
    contact: Contact,
    state: FloatArray,
    problem: ClearanceProblem,
    robot: float,
    box: float,
    travel: float,
) -> bool:
    """Whether robot and box keep their distances; a box near a wall may graze along it."""
    here = gaps(contact, state, problem)
    graze = GRAZE * travel if box < problem.least else 0.0
    return here[0] >= robot and here[1] >= box - graze


@kernel(allocates=True)
def free_fraction(
    contact: Contact,
    start: FloatArray,
    v: float,
    w: float,
    duration: float,
    problem: ClearanceProblem,
) -> float:
    """Fraction of a command that keeps robot and box clear of static things."""
    here, before, detail = np.empty(6), np.empty(6), np.empty(6)
    copy_into(here, start)
    now = gaps(contact, here, problem)
    robot = min(problem.least, now[0] - problem.slack)
    box = min(problem.least, now[1] - problem.slack)
    travel_ahead = (abs(v) + abs(w) * (contact.front + contact.depth)) * duration
    for i in range(SAMPLES):
        copy_into(before, here)
        advance(contact, here, v, w, duration / SAMPLES, detail)
        if _clear(contact, here, problem, robot, box, travel_ahead * (i + 1) / SAMPLES):
            continue
        free, step = i / SAMPLES, 0.5 / SAMPLES
        for _ in range(HALVINGS):
            copy_into(here, before)
            advance(contact, here, v, w, step * duration, detail)
            if _clear(contact, here, problem, robot, box, travel_ahead * (free + step)):
                copy_into(before, here)
                free += step
            step *= 0.5
        return free
    return 1.0
