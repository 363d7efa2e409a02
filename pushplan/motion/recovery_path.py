"""The recovery behaviour: a drive out of a tight place that the robot itself is in."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.geometry import core_distance
from pushplan.geometry.transforms import arc_step
from pushplan.motion.collision import ConvexObstacles, Footprint, footprint, obstacles, static_depth
from pushplan.world import World
from pushplan.world.checks import FloatArray, IntArray

STEP = 0.08
"""Length of a step [circumscribed radii], and turn of one on the spot [rad]."""
_CELL = 0.6  # sides of the boxes of poses of which one is looked at each [steps]
_REACH = 3.0  # greatest distance of the place to turn [circumscribed radii]
_MOST = 100_000  # poses that are looked at
_CLEARANCE = 1.05  # clearance that the robot needs to turn about [circumscribed radii]
_CURVATURES = (0.0, 0.5, -0.5, 1.0, -1.0)  # of the arcs [1 / circumscribed radius]
_DEEPER = 1e-3  # by how much the robot may get deeper into what it touches [circumscribed radii]


class RecoveryProblem(NamedTuple):
    """Start of a recovery path, and the obstacles that it must not touch."""

    start: FloatArray  # (3,) pose of the robot
    steps: FloatArray  # (A, 2) distance [m] and turn [rad] of each step that it may take
    body: Footprint
    grown: Footprint  # by the distance to keep from what it does not touch
    among: ConvexObstacles
    size: float  # Circumscribed radius of the robot [m]


@kernel
def can_turn(pose: FloatArray, size: float, among: ConvexObstacles) -> bool:
    """Return True if the disc that the robot needs to turn about is within the bounds and free."""
    x = pose[0]
    y = pose[1]
    bounds = among.bounds
    radius = _CLEARANCE * size
    if min(x - bounds[0], bounds[2] - x, y - bounds[1], bounds[3] - y) < radius:
        return False
    for s in range(among.boxes.shape[0]):
        box = among.boxes[s]
        if x + radius <= box[0] or x - radius >= box[2]:
            continue
        if y + radius <= box[1] or y - radius >= box[3]:
            continue
        first = among.offsets[s]
        end = among.offsets[s + 1]
        if core_distance(x, y, among.vertices, first, end) < radius:
            return False
    return True


@kernel
def _gets_deeper(
    pose: FloatArray, problem: RecoveryProblem, allowed: FloatArray, scratch: FloatArray
) -> bool:
    """Return True if the robot, itself or grown, is deeper in something than ``allowed`` (2,)."""
    deeper: bool = (
        static_depth(pose, problem.body, problem.among, scratch) > allowed[0]
        or static_depth(pose, problem.grown, problem.among, scratch) > allowed[1]
    )
    return deeper


@kernel(allocates=True)
def search_recovery(problem: RecoveryProblem) -> tuple[FloatArray, IntArray, int]:
    """Look for the drive with the fewest steps to where the robot can turn.

    Returns:
        (M, 3) poses that were found, (M,) the pose before each, and the last one of the drive; -1
        if there is none.
    """
    start = problem.start
    body = problem.body
    grown = problem.grown
    among = problem.among
    size = problem.size
    unit = _CELL * STEP
    half = int(_REACH / unit)
    turns = math.ceil(2.0 * math.pi / unit)
    seen = np.zeros((2 * half + 1, 2 * half + 1, turns), dtype=np.bool_)
    nodes = np.empty((_MOST, 3))
    before = np.empty(_MOST, dtype=np.int64)
    scratch = np.empty((max(len(body.vertices), len(grown.vertices)), 2))
    pose = np.empty(3)
    between = np.empty(3)
    allowed = np.empty(2)
    allowed[0] = static_depth(start, body, among, scratch) + _DEEPER * size
    allowed[1] = static_depth(start, grown, among, scratch) + _DEEPER * size
    copy_into(nodes[0], start)
    before[0] = -1
    count = 1
    at = 0
    while at < count:
        for distance, turn in problem.steps:
            arc_step(nodes[at], distance, turn, pose)
            j = half + round((pose[0] - start[0]) / (unit * size))
            i = half + round((pose[1] - start[1]) / (unit * size))
            t = math.floor(pose[2] % (2.0 * math.pi) / unit)
            if not (0 <= j <= 2 * half and 0 <= i <= 2 * half) or seen[i, j, t]:
                continue
            if _gets_deeper(pose, problem, allowed, scratch):
                continue
            arc_step(nodes[at], 0.5 * distance, 0.5 * turn, between)
            if _gets_deeper(between, problem, allowed, scratch):
                continue
            seen[i, j, t] = True
            copy_into(nodes[count], pose)
            before[count] = at
            count += 1
            if count == _MOST:
                return nodes, before, -1
            if can_turn(pose, size, among):
                return nodes, before, count - 1
        at += 1
    return nodes, before, -1


def recovery_path(world: World, margin: float) -> FloatArray | None:
    """A drive (N, 3) to the nearest place with clearance to turn about.

    It moves no object if it can; where objects close the way out, it pushes them along. None if
    there is no such place within reach, or the robot is in one. What the robot touches at first it
    may touch on the way, but no deeper: a bumper can hook on a corner. The drive keeps away from
    all else if it can.

    Args:
        world: the snapshot.
        margin: distance to keep from what is static if it can [m].
    """
    size = world.robot.circumscribed_radius
    objects = [world.movables.outline_world(k) for k in range(len(world.movables))]
    start = np.array(world.robot_pose)
    walls = obstacles(world.static)
    steps = STEP * np.array([(size, curvature) for curvature in _CURVATURES])
    if world.robot.min_speed < 0.0:
        steps = np.concatenate([steps, steps * (-1.0, 1.0)])
    steps = np.concatenate([steps, [(0.0, STEP), (0.0, -STEP)]])
    body = footprint(world.robot)
    surroundings = [walls]
    if objects:  # it pushes them only where there is no way between them
        surroundings.insert(0, obstacles(world.static, objects))
    for among in surroundings:
        if can_turn(start, size, among):
            return None
        for distance in dict.fromkeys((margin, 0.0)):
            grown = footprint(world.robot, distance)
            problem = RecoveryProblem(start, steps, body, grown, among, size)
            nodes, before, last = search_recovery(problem)
            path = []
            while last >= 0:
                path.append(nodes[last])
                last = before[last]
            if path:
                return np.array(path[::-1])
    return None
