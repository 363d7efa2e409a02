"""Compiled poses of the robot behind an object."""

from __future__ import annotations

import math

import numpy as np

from pushplan.compiled import kernel
from pushplan.motion.collision import ConvexObstacles, Footprint, is_free
from pushplan.world.checks import FloatArray


@kernel(allocates=True)
def pose_behind_outline(
    pose: FloatArray,  # (3,) of the object
    outline: FloatArray,  # (N, 2) in its frame [m]
    heading: float,
    shift: float,  # of the robot's middle to the left [m]
    distance: float,  # of the robot's middle from the outline [m]
) -> FloatArray:
    """(3,) pose of a robot that touches an outline from behind and faces along a heading."""
    c, s = math.cos(heading), math.sin(heading)
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    depth = -np.inf
    for i in range(outline.shape[0]):
        x, y = outline[i, 0], outline[i, 1]
        depth = max(depth, -((cos * x - sin * y) * c + (sin * x + cos * y) * s))
    depth += distance
    return np.array([pose[0] - depth * c - shift * s, pose[1] - depth * s + shift * c, heading])


@kernel(allocates=True)
def first_free(
    start: FloatArray,
    u: FloatArray,  # (2,) direction
    step: float,
    limit: float,
    shape: Footprint,
    among: ConvexObstacles,
    scratch: FloatArray,
) -> float:
    """How far along ``u`` a free pose is [m]; inf if there is none nearer than the limit."""
    pose, n = start.copy(), 0
    while n * step < limit:
        pose[0], pose[1] = start[0] + n * step * u[0], start[1] + n * step * u[1]
        if is_free(pose, shape, among, scratch):
            return n * step
        n += 1
    return np.inf


@kernel(allocates=True)
def missing_clearance(
    pose: FloatArray,  # (3,) of the object
    outline: FloatArray,  # (N, 2) in its frame [m]
    headings: FloatArray,  # (H,) in which it may be pushed [rad]
    shifts: FloatArray,  # (S,) of the robot's middle to the left [m]
    distance: float,  # of the robot's middle from the outline [m]
    limit: float,
    shape: Footprint,
    among: ConvexObstacles,
    scratch: FloatArray,
) -> float:
    """How much farther on an object would have to be for the robot to fit behind it [m]."""
    least = limit
    u = np.empty(2)
    for heading in headings:
        u[0], u[1] = math.cos(heading), math.sin(heading)
        for shift in shifts:
            start = pose_behind_outline(pose, outline, heading, shift, distance)
            least = min(least, first_free(start, u, limit / 40.0, least, shape, among, scratch))
    return least
