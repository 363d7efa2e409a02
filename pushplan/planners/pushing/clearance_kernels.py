"""Compiled distances of robot and box from static things under a command."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import copy_into, kernel, owned
from pushplan.geometry.convex import convex_distance, convex_penetration
from pushplan.geometry.obstacles import Obstacles
from pushplan.planners.pushing.box_motion_kernels import advance, box_pose
from pushplan.planners.pushing.contact_kernels import Contact
from pushplan.world import RobotModel
from pushplan.world.checks import FloatArray, IntArray
from pushplan.world.outline import flatten

SAMPLES = 4
"""Poses checked along one command."""
HALVINGS = 4
"""Number of halvings of the piece in which robot or box comes too near."""
GRAZE = 0.1
"""Greatest rate at which a box nearer than the clearance may come nearer, per travel of the bumper:
it is pushed along a wall, and lies against it in the end."""


class ClearanceProblem(NamedTuple):
    """Footprint and box, as the kernels read them, and memory."""

    vertices: FloatArray
    """(V, 2) corners of the robot's parts, then of the box, in their frames [m]."""
    offsets: IntArray  # (P + 1,) where each part starts; the last is the box
    radii: FloatArray  # (P,) of the disc about the origin that holds each part [m]
    least: float  # Distance to keep [m]
    slack: float  # Distance by which a body that is too near already may come nearer [m]
    placed: FloatArray  # (V, 2)
    box: FloatArray  # (3,)
    states: FloatArray  # (2, 6)
    detail: FloatArray  # (6,)


def clearance_problem(
    robot: RobotModel, outline: FloatArray, least: float, slack: float
) -> ClearanceProblem:
    """Footprint and box.

    Args:
        robot: its parts.
        outline: (N, 2) corners of the box [m].
        least: see `ClearanceProblem`.
        slack: the same.
    """
    vertices, offsets = flatten([*robot.wall_parts, outline])
    reach = np.hypot(vertices[:, 0], vertices[:, 1])
    return ClearanceProblem(
        owned(vertices),
        owned(offsets),
        np.maximum.reduceat(reach, offsets[:-1]),
        least,
        slack,
        np.zeros(vertices.shape),
        np.zeros(3),
        np.zeros((2, 6)),
        np.zeros(6),
    )


@kernel
def gaps(
    contact: Contact,
    normal: float,
    state: FloatArray,
    problem: ClearanceProblem,
    obstacles: Obstacles,
) -> tuple[float, float]:
    """Least distance of the robot and of the box from static things [m], negative inside one."""
    box = problem.box
    placed = problem.placed
    robot_gap = np.inf
    box_gap = np.inf
    box_pose(contact, state, box)
    parts = problem.offsets.shape[0] - 1
    for p in range(parts):
        x = state[0]
        y = state[1]
        theta = state[2]
        least = robot_gap
        if p == parts - 1:
            x = box[0]
            y = box[1]
            theta = box[2] - normal
            least = box_gap
        first = problem.offsets[p]
        last = problem.offsets[p + 1]
        c = np.cos(theta)
        s = np.sin(theta)
        for i in range(first, last):
            placed[i, 0] = x + c * problem.vertices[i, 0] - s * problem.vertices[i, 1]
            placed[i, 1] = y + s * problem.vertices[i, 0] + c * problem.vertices[i, 1]
        for k in range(obstacles.radii.shape[0]):
            b = obstacles.boxes[k]
            dx = max(b[0] - x, x - b[2], 0.0)
            dy = max(b[1] - y, y - b[3], 0.0)
            if np.sqrt(dx * dx + dy * dy) - problem.radii[p] >= least:
                continue
            core = obstacles.vertices[obstacles.offsets[k] : obstacles.offsets[k + 1]]
            gap = convex_distance(placed[first:last], core)
            if gap <= 0.0:
                gap = -max(convex_penetration(placed[first:last], core)[0], 0.0)
            least = min(least, gap - obstacles.radii[k])
        if p == parts - 1:
            box_gap = least
        else:
            robot_gap = least
    return robot_gap, box_gap


@kernel
def _clear(
    contact: Contact,
    normal: float,
    state: FloatArray,
    problem: ClearanceProblem,
    obstacles: Obstacles,
    robot: float,
    box: float,
    travel: float,
) -> bool:
    """Return True if robot and box keep their distances; a box near a wall may graze along it."""
    here = gaps(contact, normal, state, problem, obstacles)
    graze = GRAZE * travel if box < problem.least else 0.0
    return here[0] >= robot and here[1] >= box - graze


@kernel
def free_fraction(
    contact: Contact,
    normal: float,  # of the pushed face in the box's frame [rad]
    start: FloatArray,
    v: float,
    w: float,
    duration: float,
    problem: ClearanceProblem,
    obstacles: Obstacles,
) -> float:
    """Fraction of a command that keeps robot and box clear of static things."""
    here = problem.states[0]
    before = problem.states[1]
    detail = problem.detail
    copy_into(here, start)
    now = gaps(contact, normal, here, problem, obstacles)
    robot = min(problem.least, now[0] - problem.slack)
    box = min(problem.least, now[1] - problem.slack)
    travel_ahead = (abs(v) + abs(w) * (contact.front + contact.depth)) * duration
    for i in range(SAMPLES):
        copy_into(before, here)
        advance(contact, here, v, w, duration / SAMPLES, detail)
        if _clear(
            contact, normal, here, problem, obstacles, robot, box, travel_ahead * (i + 1) / SAMPLES
        ):
            continue
        free = i / SAMPLES
        step = 0.5 / SAMPLES
        for _ in range(HALVINGS):
            copy_into(here, before)
            advance(contact, here, v, w, step * duration, detail)
            if _clear(
                contact, normal, here, problem, obstacles, robot, box, travel_ahead * (free + step)
            ):
                copy_into(before, here)
                free += step
            step *= 0.5
        return free
    return 1.0
