"""Which objects a step of the robot can concern, so that a simulator can leave out the rest."""

from __future__ import annotations

import math

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry import convex_distance, convex_overlap
from pushplan.geometry.transforms import transform_points
from pushplan.world.checks import BoolArray, FloatArray, IntArray


@kernel(allocates=True)
def within_reach(
    robot: FloatArray,  # (3,) pose of the robot
    reach: float,  # how far any of its points moves in the step [m]
    parts: FloatArray,  # corners of its footprint, body frame
    part_offsets: IntArray,  # where each part starts
    rows: FloatArray,  # (K, 3) poses of the objects
    speeds: FloatArray,  # (K,) how far each object would move by itself in the step [m]
    vertices: FloatArray,  # corners of the objects, body frames
    offsets: IntArray,  # where each object starts
    radii: FloatArray,  # (K,) their circumscribed radii [m]
) -> BoolArray:
    """(K,) objects in reach of the robot, those in motion, and those in reach of either."""
    count = rows.shape[0]
    near, found = np.zeros(count, dtype=np.bool_), np.zeros(count, dtype=np.bool_)
    corners = np.empty_like(parts)
    transform_points(robot, parts, corners)
    size = 0.0
    for i in range(parts.shape[0]):
        size = max(size, math.hypot(parts[i, 0], parts[i, 1]))
    shapes = np.empty_like(vertices)
    for k in range(count):
        a, b = offsets[k], offsets[k + 1]
        near[k] = speeds[k] > 0.0
        gap = math.hypot(rows[k, 0] - robot[0], rows[k, 1] - robot[1]) - size - radii[k]
        if near[k] or gap > reach + speeds[k]:
            continue
        transform_points(rows[k], vertices[a:b], shapes[a:b])
        for p in range(part_offsets.shape[0] - 1):
            part = corners[part_offsets[p] : part_offsets[p + 1]]
            if convex_distance(part, shapes[a:b]) <= reach:
                near[k] = True
                break
    for k in range(count):
        if not near[k]:
            continue
        found[k] = True
        for j in range(count):
            if found[j] or near[j]:
                continue
            gap = math.hypot(rows[k, 0] - rows[j, 0], rows[k, 1] - rows[j, 1])
            found[j] = gap - radii[k] - radii[j] <= 0.5 * reach + speeds[k]
    return found


@kernel(allocates=True)
def footprint_gap(
    robot: FloatArray,  # (3,) pose of the robot
    parts: FloatArray,  # corners of its footprint, body frame
    part_offsets: IntArray,  # where each part starts
    vertices: FloatArray,  # corners of the cores of the obstacles, world frame
    offsets: IntArray,  # where each core starts
    radii: FloatArray,  # how far each obstacle reaches beyond its core [m]
) -> float:
    """Distance [m] between the robot's footprint and what is static, 0 or less where they touch."""
    corners = np.empty_like(parts)
    transform_points(robot, parts, corners)
    best = math.inf
    for k in range(radii.shape[0]):
        core = vertices[offsets[k] : offsets[k + 1]]
        for p in range(part_offsets.shape[0] - 1):
            part = corners[part_offsets[p] : part_offsets[p + 1]]
            best = min(best, convex_distance(part, core) - radii[k])
    return best


@kernel(allocates=True)
def struck(
    loaded: BoolArray,  # (K,) which objects were simulated
    paths: FloatArray,  # (T, K, 3) their poses; those of the others do not change
    rows: FloatArray,  # (K, 3) poses before the step
    vertices: FloatArray,  # corners of the objects, body frames
    offsets: IntArray,  # where each object starts
    radii: FloatArray,  # (K,) their circumscribed radii [m]
) -> BoolArray:
    """Objects that were left out although something that moved came to overlap them."""
    steps, count = paths.shape[0], rows.shape[0]
    found = np.zeros(count, dtype=np.bool_)
    here, there = np.empty_like(vertices), np.empty_like(vertices)
    for k in range(count):
        if not loaded[k]:
            continue
        last = paths[steps - 1, k]
        if last[0] == rows[k, 0] and last[1] == rows[k, 1] and last[2] == rows[k, 2]:
            continue
        way = math.hypot(last[0] - rows[k, 0], last[1] - rows[k, 1])
        a, b = offsets[k], offsets[k + 1]
        for j in range(count):
            if loaded[j] or found[j]:
                continue
            gap = math.hypot(rows[j, 0] - last[0], rows[j, 1] - last[1]) - radii[j] - radii[k]
            if gap > way:
                continue
            c, d = offsets[j], offsets[j + 1]
            transform_points(rows[j], vertices[c:d], there[c:d])
            for t in range(steps):
                pose = paths[t, k]
                transform_points(pose, vertices[a:b], here[a:b])
                if convex_overlap(here[a:b], there[c:d]):
                    found[j] = True
                    break
    return found
