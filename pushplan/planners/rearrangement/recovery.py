"""The way out of a tight place that the robot itself is in."""

from __future__ import annotations

import math

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry import core_distance
from pushplan.motion.collision import Footprint, Obstacles, footprint, obstacles
from pushplan.planners.rearrangement.route import depth_inside
from pushplan.planners.rearrangement.scene import Scene
from pushplan.world.checks import FloatArray, IntArray

_STEP = 0.08
"""Length of a step [circumscribed radii], and turn of one on the spot [rad]."""
_CELL = 0.6
"""Sides of the boxes of poses of which one is looked at each [steps]."""
_REACH = 3.0
"""How far away the room to turn may be [circumscribed radii]."""
_MOST = 100_000
"""Poses that are looked at."""
_ROOM = 1.05
"""Room that the robot needs to turn about [circumscribed radii]."""
_DEEPER = 1e-3
"""By how much the robot may get deeper into what it touches [circumscribed radii]."""


def way_out(scene: Scene) -> FloatArray | None:
    """A drive (N, 3) that moves no object, to the nearest place with room to turn about.

    None if there is no such place within reach, or the robot is in one. What the robot touches at
    first it may touch on the way, but no deeper: a bumper can hook on a corner. The drive keeps
    away from all else if it can.
    """
    world = scene.world
    objects = [world.movables.outline_world(k) for k in range(len(world.movables))]
    among, start = obstacles(world.static, objects), np.array(world.robot_pose)
    if _has_room(start, _ROOM * scene.size, among):
        return None
    steps = scene.size * _STEP * np.array([(1.0, 0.0), (1.0, 1.0), (1.0, -1.0)])
    steps[:, 1] /= scene.size
    if world.robot.min_speed < 0.0:
        steps = np.concatenate([steps, steps * (-1.0, 1.0)])
    steps = np.concatenate([steps, [(0.0, _STEP), (0.0, -_STEP)]])
    for share in (0.5, 0.0):
        shape = footprint(world.robot, share * scene.config.margin * scene.size)
        path = _search(start, steps, shape, among, scene.size)
        if len(path):
            return path
    return None


@kernel(allocates=True)
def _has_room(pose: FloatArray, radius: float, among: Obstacles) -> bool:
    """Whether a disc about a pose is within the bounds and overlaps nothing."""
    x, y, bounds = pose[0], pose[1], among.bounds
    if min(x - bounds[0], bounds[2] - x, y - bounds[1], bounds[3] - y) < radius:
        return False
    for s in range(among.boxes.shape[0]):
        box = among.boxes[s]
        if x + radius <= box[0] or x - radius >= box[2]:
            continue
        if y + radius <= box[1] or y - radius >= box[3]:
            continue
        first, end = among.offsets[s], among.offsets[s + 1]
        if core_distance(x, y, among.vertices, first, end) < radius:
            return False
    return True


@kernel(allocates=True)
def stepped(pose: FloatArray, way: float, turn: float) -> FloatArray:
    """(3,) where a step leads from a pose."""
    middle = pose[2] + 0.5 * turn
    x, y = pose[0] + way * math.cos(middle), pose[1] + way * math.sin(middle)
    return np.array([x, y, pose[2] + turn])


@kernel(allocates=True)
def _up_to(node: int, nodes: FloatArray, before: IntArray) -> FloatArray:
    """(N, 3) the poses that have led to one."""
    chain = [node]
    while before[chain[-1]] >= 0:
        chain.append(before[chain[-1]])
    path: FloatArray = nodes[np.array(chain[::-1])]
    return path


@kernel(allocates=True)
def _search(
    start: FloatArray, steps: FloatArray, shape: Footprint, among: Obstacles, size: float
) -> FloatArray:
    """The drive with the fewest steps, (N, 3), to room enough; (0, 3) if there is none.

    Args:
        start: (3,) pose of the robot.
        steps: (A, 2) way [m] and turn [rad] of each step that it may take.
        shape: its footprint.
        among: what it must not touch.
        size: its circumscribed radius [m].
    """
    unit = _CELL * _STEP
    half, turns = int(_REACH / unit), math.ceil(2.0 * math.pi / unit)
    seen = np.zeros((2 * half + 1, 2 * half + 1, turns), dtype=np.bool_)
    nodes, before = np.empty((_MOST, 3)), np.empty(_MOST, dtype=np.int64)
    scratch = np.empty_like(shape.vertices)
    limit = depth_inside(start, shape, among, scratch) + _DEEPER * size
    nodes[0], before[0], count = start, -1, 1
    at = 0
    while at < count:
        for way, turn in steps:
            pose = stepped(nodes[at], way, turn)
            j = half + round((pose[0] - start[0]) / (unit * size))
            i = half + round((pose[1] - start[1]) / (unit * size))
            t = math.floor(pose[2] % (2.0 * math.pi) / unit)
            if not (0 <= j <= 2 * half and 0 <= i <= 2 * half) or seen[i, j, t]:
                continue
            if depth_inside(pose, shape, among, scratch) > limit:
                continue
            between = stepped(nodes[at], 0.5 * way, 0.5 * turn)
            if depth_inside(between, shape, among, scratch) > limit:
                continue
            seen[i, j, t] = True
            nodes[count], before[count] = pose, at
            count += 1
            if count == _MOST:
                return nodes[:0]
            if _has_room(pose, _ROOM * size, among):
                return _up_to(count - 1, nodes, before)
        at += 1
    return nodes[:0]
