"""A step of `IceInteraction` in compiled searches and rollouts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.geometry.angles import wrap_angle
from pushplan.geometry.transforms import transform_points
from pushplan.interaction.advance import advance_objects
from pushplan.interaction.ice_bodies import IceProblem
from pushplan.interaction.ice_contacts import advance_ice
from pushplan.world.checks import FloatArray, IntArray


class IceContacts(NamedTuple):
    """`IceInteraction` in compiled form, with memory for one thread."""

    inverse_masses: FloatArray  # (K,)
    radii: FloatArray  # (K,) circumscribed radii [m]
    tests: IntArray  # (1,) steps of the hull so far
    problem: IceProblem
    known: FloatArray  # (K, 3) the poses for which the corners in the memory are worked out


@kernel
def _step(
    model: IceContacts,
    robot_from: FloatArray,
    robot_to: FloatArray,
    poses: FloatArray,
    moved: FloatArray,
) -> bool:
    """Drive the hull a step among the floes, which never hold it."""
    problem, known = model.problem, model.known
    bodies, scratch = problem.bodies, problem.scratch
    for k in range(poses.shape[0]):  # only where the last step left other corners behind
        if poses[k, 0] != known[k, 0] or poses[k, 1] != known[k, 1] or poses[k, 2] != known[k, 2]:
            copy_into(known[k], poses[k])
            a, b = bodies.offsets[k], bodies.offsets[k + 1]
            transform_points(poses[k], bodies.vertices[a:b], scratch.corners[a:b])
    turn = wrap_angle(robot_to[2] - robot_from[2])
    dx, dy = robot_to[0] - robot_from[0], robot_to[1] - robot_from[1]
    motion = np.sqrt(dx * dx + dy * dy) + abs(turn) * bodies.hull_radius
    steps = max(1, int(np.ceil(motion / problem.settings.step)))
    here, by = scratch.pose[0], scratch.pose[1]
    by[0], by[1], by[2] = dx / steps, dy / steps, turn / steps
    work = 0.0
    for step in range(steps):
        for i in range(3):
            here[i] = robot_from[i] + step * by[i]
        work += advance_ice(poses, problem)
        model.tests[0] += 1
    if work > 0.0:
        for k in range(poses.shape[0]):
            gx, gy = poses[k, 0] - known[k, 0], poses[k, 1] - known[k, 1]
            if gx != 0.0 or gy != 0.0 or poses[k, 2] != known[k, 2]:
                moved[k] += np.sqrt(gx * gx + gy * gy)
                copy_into(known[k], poses[k])
    return True


advance_objects.add(IceContacts, _step)
