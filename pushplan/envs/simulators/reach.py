"""Objects that a step of the robot can affect, so that a simulator can leave out the rest."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry import convex_distance, convex_overlap
from pushplan.geometry.obstacles import Obstacles, core_distance
from pushplan.geometry.transforms import transform_points
from pushplan.world.checks import BoolArray, FloatArray, IntArray

_ADVANCES = 64  # looks at the gap at most


class Shapes(NamedTuple):
    """Outlines of the robot and the objects, body frames [m]."""

    parts: FloatArray  # corners of the robot's footprint
    part_offsets: IntArray  # start of each part
    vertices: FloatArray  # corners of the objects
    offsets: IntArray  # start of each object
    radii: FloatArray  # (K,) their circumscribed radii


@kernel(allocates=True)
def within_reach(
    robot: FloatArray,  # (3,) pose of the robot
    reach: float,  # greatest distance that one of its points moves in the step [m]
    shapes: Shapes,
    rows: FloatArray,  # (K, 3) poses of the objects
    speeds: FloatArray,  # (K,) how far each object would move by itself in the step [m]
) -> BoolArray:
    """(K,) objects in reach of the robot, those in motion, and those in reach of either."""
    parts, part_offsets, vertices, offsets, radii = shapes
    count = rows.shape[0]
    near = np.zeros(count, dtype=np.bool_)
    found = np.zeros(count, dtype=np.bool_)
    corners = np.empty_like(parts)
    transform_points(robot, parts, corners)
    size = 0.0
    for i in range(parts.shape[0]):
        size = max(size, math.hypot(parts[i, 0], parts[i, 1]))
    placed = np.empty_like(vertices)
    for k in range(count):
        a = offsets[k]
        b = offsets[k + 1]
        near[k] = speeds[k] > 0.0
        gap = math.hypot(rows[k, 0] - robot[0], rows[k, 1] - robot[1]) - size - radii[k]
        if near[k] or gap > reach + speeds[k]:
            continue
        transform_points(rows[k], vertices[a:b], placed[a:b])
        for p in range(part_offsets.shape[0] - 1):
            part = corners[part_offsets[p] : part_offsets[p + 1]]
            if convex_distance(part, placed[a:b]) <= reach:
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
def clear_time(
    robot: FloatArray,  # (3,) pose of the robot
    course: float,  # in which direction of the world it begins to go [rad]
    linear: float,  # its speed in this direction [m/s]
    angular: float,  # its turn rate [rad/s]
    holds: bool,  # True if it keeps its course; else this turns with it
    limit: float,  # no longer than this [s]
    margin: float,  # distance that counts as contact [m]
    shapes: Shapes,
    rows: FloatArray,  # (K, 3) poses of the objects
    obstacles: Obstacles,  # static obstacles
) -> float:
    """Time [s] for which a robot that drives an arc certainly touches nothing.

    Conservative advancement (Mirtich 1996): what is a distance away is not reached before the
    fastest point of the robot has gone that far.
    """
    parts, part_offsets, vertices, offsets, radii = shapes
    size = 0.0
    for i in range(parts.shape[0]):
        size = max(size, math.hypot(parts[i, 0], parts[i, 1]))
    speed = abs(linear) + abs(angular) * size
    reach = speed * limit + margin
    outlines = np.empty_like(vertices)
    near = np.empty(rows.shape[0], np.int64)
    count = 0
    for k in range(rows.shape[0]):
        gap = math.hypot(rows[k, 0] - robot[0], rows[k, 1] - robot[1]) - size - radii[k]
        if gap <= reach:
            a = offsets[k]
            b = offsets[k + 1]
            transform_points(rows[k], vertices[a:b], outlines[a:b])
            near[count] = k
            count += 1
    corners, starts, grown, _ = obstacles
    close = np.empty(grown.shape[0], np.int64)
    walls = 0
    for k in range(grown.shape[0]):
        gap = core_distance(robot[0], robot[1], corners, starts[k], starts[k + 1])
        if gap - grown[k] - size <= reach:
            close[walls] = k
            walls += 1
    if count + walls == 0:
        return limit
    placed = np.empty_like(parts)
    here = np.empty(3)
    time = 0.0
    for _ in range(_ADVANCES):
        arc_pose(robot, course, linear, angular, holds, time, here)
        transform_points(here, parts, placed)
        least = math.inf
        for index in range(count + walls):
            if index < count:
                k = near[index]
                shape = outlines[offsets[k] : offsets[k + 1]]
                round_by = 0.0
                gap = math.hypot(rows[k, 0] - here[0], rows[k, 1] - here[1]) - radii[k]
            else:
                k = close[index - count]
                shape = corners[starts[k] : starts[k + 1]]
                round_by = grown[k]
                gap = core_distance(here[0], here[1], corners, starts[k], starts[k + 1]) - round_by
            if gap - size >= least:
                continue
            for p in range(part_offsets.shape[0] - 1):
                part = placed[part_offsets[p] : part_offsets[p + 1]]
                least = min(least, convex_distance(part, shape) - round_by)
        if least <= margin:
            break
        if speed == 0.0:
            return limit
        time += (least - 0.5 * margin) / speed
        if time >= limit:
            return limit
    return time


@kernel
def arc_pose(
    start: FloatArray,
    course: float,
    linear: float,
    angular: float,
    holds: bool,
    time: float,
    out: FloatArray,
) -> None:
    """Fill (3,) ``out`` with the pose after some time [s]; arguments as in `clear_time`."""
    half = 0.5 * angular * time
    chord = linear * time
    middle = course
    if not holds:
        middle += half
        if half != 0.0:
            chord *= math.sin(half) / half
    out[0] = start[0] + chord * math.cos(middle)
    out[1] = start[1] + chord * math.sin(middle)
    out[2] = start[2] + 2.0 * half


@kernel(allocates=True)
def struck(
    loaded: BoolArray,  # (K,) which objects were simulated
    paths: FloatArray,  # (T, K, 3) their poses; those of the others do not change
    rows: FloatArray,  # (K, 3) poses before the step
    shapes: Shapes,
) -> BoolArray:
    """Objects that were left out although something that moved came to overlap them."""
    _, _, vertices, offsets, radii = shapes
    steps = paths.shape[0]
    count = rows.shape[0]
    found = np.zeros(count, dtype=np.bool_)
    here = np.empty_like(vertices)
    there = np.empty_like(vertices)
    for k in range(count):
        if not loaded[k]:
            continue
        last = paths[steps - 1, k]
        if last[0] == rows[k, 0] and last[1] == rows[k, 1] and last[2] == rows[k, 2]:
            continue
        way = math.hypot(last[0] - rows[k, 0], last[1] - rows[k, 1])
        a = offsets[k]
        b = offsets[k + 1]
        for j in range(count):
            if loaded[j] or found[j]:
                continue
            gap = math.hypot(rows[j, 0] - last[0], rows[j, 1] - last[1]) - radii[j] - radii[k]
            if gap > way:
                continue
            c = offsets[j]
            d = offsets[j + 1]
            transform_points(rows[j], vertices[c:d], there[c:d])
            for t in range(steps):
                pose = paths[t, k]
                transform_points(pose, vertices[a:b], here[a:b])
                if convex_overlap(here[a:b], there[c:d]):
                    found[j] = True
                    break
    return found
