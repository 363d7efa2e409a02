"""What a push would do, compiled: the pushing law run in closed loop against quasi-static contacts.

Two laws. A *line* push drives straight ahead and is followed until it has done what it can. A
*guided* push leads one object along a path: the robot heads where the object has to go, turned
towards the side to which the object has slipped on the bumper.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.geometry import convex_penetration
from pushplan.geometry.transforms import transform_points
from pushplan.interaction.kernels import (
    Bodies,
    Scratch,
    Settings,
    advance,
    make_scratch,
    robot_held,
)
from pushplan.world import ClearanceArea, Goal, Receptacle, StaticMap
from pushplan.world.checks import BoolArray, FloatArray, frozen

EVENTS = 8
"""How many stages of one push are kept."""
GONE = 1e7
"""Where an object is put that has left the floor [m]."""


class Task(NamedTuple):
    """When an object is done, as kernels read it."""

    polygon: FloatArray
    """(N, 2) the area that objects have to leave, or get into."""
    edges: FloatArray
    """(E, 3) unit normal and offset of the edges within which a delivered object lies."""
    delivers: bool
    """Whether objects have to get into the polygon, and leave the floor there."""
    slack: float
    """By how much an object has to be clear of the polygon's edge [m]."""


def task_of(goal: Goal, static: StaticMap, slack: float) -> Task:
    """The task for kernels. Sides of a receptacle that lie on the bounds do not count."""
    assert isinstance(goal, ClearanceArea | Receptacle)
    polygon = goal.polygon
    along = np.roll(polygon, -1, axis=0) - polygon
    normals = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.hypot(*along.T)[:, None]
    offsets = (normals * polygon).sum(axis=1)
    low, high = static.bounds[:2], static.bounds[2:]
    corners = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    # the sides of a receptacle that stand at the walls
    inner = (corners @ normals.T).max(axis=0) > offsets + 4.0 * slack
    edges = np.column_stack([normals, offsets])[inner]
    return Task(
        polygon,
        frozen(np.ascontiguousarray(edges)),
        isinstance(goal, Receptacle),
        slack,
    )


@kernel
def _may_be_done(x: float, y: float, task: Task) -> bool:
    """Whether an object with its middle at (x, y) could be where it belongs."""
    if task.delivers:
        for e in range(task.edges.shape[0]):
            if task.edges[e, 0] * x + task.edges[e, 1] * y > task.edges[e, 2]:
                return False
        return True
    count = task.polygon.shape[0]
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        ax, ay = task.polygon[i, 0], task.polygon[i, 1]
        ex, ey = task.polygon[j, 0] - ax, task.polygon[j, 1] - ay
        if ex * (y - ay) - ey * (x - ax) < 0.0:
            return True
    return False


@kernel(allocates=True)
def is_done(k: int, poses: FloatArray, bodies: Bodies, task: Task) -> bool:
    """Whether object ``k`` is where it belongs."""
    if poses[k, 0] >= 0.5 * GONE:
        return True
    if not _may_be_done(poses[k, 0], poses[k, 1], task):
        return False
    a, b = bodies.offsets[k], bodies.offsets[k + 1]
    outline = np.empty((b - a, 2))
    transform_points(poses[k], bodies.vertices[a:b], outline)
    if task.delivers:
        for e in range(task.edges.shape[0]):
            for i in range(b - a):
                out = task.edges[e, 0] * outline[i, 0] + task.edges[e, 1] * outline[i, 1]
                if out > task.edges[e, 2] - task.slack:
                    return False
        return True
    return bool(convex_penetration(outline, task.polygon)[0] < -task.slack)


@kernel(allocates=True)
def all_done(poses: FloatArray, bodies: Bodies, task: Task) -> BoolArray:
    """(K,) whether each object is where it belongs."""
    out = np.empty(poses.shape[0], dtype=np.bool_)
    for k in range(poses.shape[0]):
        out[k] = is_done(k, poses, bodies, task)
    return out


@kernel
def along_path(
    x: float, y: float, path: FloatArray, reached: float, ahead: float
) -> tuple[float, float, float, float]:
    """The carrot on a path: a point some way beyond the nearest one.

    Args:
        x, y: where the object is [m].
        path: (M, 2) [m].
        reached: arc length reached before [m]; the nearest point is looked for from there on.
        ahead: how far beyond the nearest point the carrot is [m].

    Returns:
        The carrot, the arc length of the nearest point, and the distance from it [m].
    """
    best, at, arc = np.inf, reached, 0.0
    for i in range(path.shape[0] - 1):
        dx, dy = path[i + 1, 0] - path[i, 0], path[i + 1, 1] - path[i, 1]
        length = math.sqrt(dx * dx + dy * dy)
        if length > 0.0 and arc + length >= reached and arc <= reached + 3.0 * ahead:
            t = ((x - path[i, 0]) * dx + (y - path[i, 1]) * dy) / length
            t = min(max(t, max(0.0, reached - arc)), length)
            px, py = path[i, 0] + t / length * dx, path[i, 1] + t / length * dy
            away = math.sqrt((px - x) ** 2 + (py - y) ** 2)
            if away < best:
                best, at = away, arc + t
        arc += length
    target, arc = at + ahead, 0.0
    for i in range(path.shape[0] - 1):
        dx, dy = path[i + 1, 0] - path[i, 0], path[i + 1, 1] - path[i, 1]
        length = math.sqrt(dx * dx + dy * dy)
        if length > 0.0 and (arc + length >= target or i == path.shape[0] - 2):
            t = (target - arc) / length  # beyond the end the last leg goes on
            return path[i, 0] + t * dx, path[i, 1] + t * dy, at, best
        arc += length
    return path[-1, 0], path[-1, 1], at, best


class Law(NamedTuple):
    """The geometric pushing law."""

    step: float
    """Distance between two commands [m]."""
    turn: float
    """Greatest turn in one step [rad]."""
    size: float
    """Circumscribed radius of the robot [m]."""
    half: float
    """Half the width of the bumper [m]."""
    front: float
    """How far the bumper is ahead of the robot's origin [m]."""
    ahead: float
    """How far ahead of the object the path is looked at [m]."""
    gain: float
    """Curvature of the robot's path for each radian that it is off its heading, times ``size``."""


@kernel
def guide(
    robot: FloatArray,
    box: FloatArray,
    path: FloatArray,
    reached: float,
    shift: float,
    law: Law,
) -> tuple[float, float, float, bool]:
    """One command of a guided push.

    Args:
        robot: (3,) pose.
        box: (3,) pose of the object that is led.
        path: (M, 2) for its middle [m].
        reached: arc length that it has got to [m].
        shift: how far the robot's middle is meant to be to the left of the object [m].
        law: parameters.

    Returns:
        Step [m], turn [rad], arc length now [m], and whether the object is still on the bumper.
    """
    cx, cy, at, _ = along_path(box[0], box[1], path, reached, law.ahead)
    way = math.atan2(cy - box[1], cx - box[0])
    error = way - robot[2]
    error -= 2.0 * math.pi * np.round(error / (2.0 * math.pi))
    gx, gy = box[0] - robot[0], box[1] - robot[1]
    ux, uy = math.cos(way), math.sin(way)
    left = gx * uy - gy * ux
    c, s = math.cos(robot[2]), math.sin(robot[2])
    side, forward = -s * gx + c * gy, c * gx + s * gy
    holds = abs(side) < 0.95 * law.half and forward > 0.5 * law.front and abs(error) < 1.75
    wanted = law.gain * (error - math.atan((left - shift) / law.size)) * law.step / law.size
    return law.step, min(max(wanted, -law.turn), law.turn), at, holds


class Log(NamedTuple):
    """What a run of a push is written into."""

    track: FloatArray
    """(T, 3) the robot's poses."""
    steps: FloatArray
    """(EVENTS,) how many poses each stage has."""
    poses: FloatArray
    """(EVENTS, K, 3) the objects' poses at the end of each stage."""
    lengths: FloatArray
    """(EVENTS, K) their path lengths [m]."""
    box: FloatArray
    """(4,) x_min, y_min, x_max, y_max of all that moved, and of its surroundings [m]."""


@kernel
def enclose(box: FloatArray, pose: FloatArray, reach: float) -> None:
    """Make a box big enough for a disc."""
    box[0], box[1] = min(box[0], pose[0] - reach), min(box[1], pose[1] - reach)
    box[2], box[3] = max(box[2], pose[0] + reach), max(box[3], pose[1] + reach)


@kernel
def _write(log: Log, stages: int, used: int, poses: FloatArray, lengths: FloatArray) -> int:
    """Write a stage down; returns how many there are then."""
    log.steps[stages] = used
    copy_into(log.poses[stages], poses)
    copy_into(log.lengths[stages], lengths)
    return stages + 1


@kernel
def _take_stock(
    poses: FloatArray,
    saved: FloatArray,
    done: BoolArray,
    bodies: Bodies,
    task: Task,
    box: FloatArray,
    room: float,
) -> bool:
    """After a step: take away what is delivered; returns whether one more object is done."""
    news = False
    for k in range(poses.shape[0]):
        if poses[k, 0] != saved[k, 0] or poses[k, 1] != saved[k, 1]:
            enclose(box, poses[k], bodies.radii[k] + room)
            was = done[k]
            done[k] = is_done(k, poses, bodies, task)
            news = news or (done[k] and not was)
            if done[k] and task.delivers:
                poses[k, 0] = GONE * (1.0 + k)
    return news


class Run(NamedTuple):
    """Memory of one push."""

    here: FloatArray
    """(3,) the robot."""
    there: FloatArray
    """(3,) where it goes."""
    poses: FloatArray
    """(K, 3)"""
    saved: FloatArray
    """(K, 3) before the step."""
    lengths: FloatArray
    """(K,) path lengths [m]."""
    done: BoolArray
    """(K,)"""
    scratch: Scratch


@kernel(allocates=True)
def roll_out(
    start: FloatArray,
    first: FloatArray,
    led: int,
    path: FloatArray,
    shift: float,
    limit: float,
    wanted: BoolArray,
    law: Law,
    bodies: Bodies,
    settings: Settings,
    task: Task,
    log: Log,
) -> tuple[int, int, int]:
    """Run a push until nothing that is wanted can come of it any more.

    Args:
        start: (3,) pose of the robot.
        first: (K, 3) poses of the objects.
        led: index of the object of a guided push, -1 for a line push.
        path: (M, 2) path of the led object [m].
        shift: see `guide`.
        limit: greatest length of the robot's path [m].
        wanted: (K,) objects that are to be done; the push ends when all are.
        law: parameters.
        bodies, settings: of the interaction model.
        task: when objects are done.
        log: receives what happens.

    Returns:
        How many stages and poses there are, and how it ended: 0 as wanted, 1 at the limit, 2
        jammed, 3 lost. A stage ends where one more object is done; a last stage that ends
        otherwise is kept too.
    """
    poses = first.copy()
    run = Run(
        start.copy(),
        np.empty(3),
        poses,
        np.empty_like(poses),
        np.zeros(poses.shape[0]),
        all_done(poses, bodies, task),
        make_scratch(bodies),
    )
    return _run(run, led, path, shift, limit, wanted, law, bodies, settings, task, log)


@kernel
def _run(
    run: Run,
    led: int,
    path: FloatArray,
    shift: float,
    limit: float,
    wanted: BoolArray,
    law: Law,
    bodies: Bodies,
    settings: Settings,
    task: Task,
    log: Log,
) -> tuple[int, int, int]:
    """`roll_out` in memory that is given."""
    here, there, poses, saved, lengths, done, scratch = run
    copy_into(log.track[0], here)
    room = 2.0 * law.step
    log.box[0], log.box[1], log.box[2], log.box[3] = np.inf, np.inf, -np.inf, -np.inf
    enclose(log.box, here, bodies.robot_radius + room)
    stages, used, travelled, reached, end = 0, 1, 0.0, 0.0, 1
    while used < log.track.shape[0] and travelled < limit:
        ds, turn = law.step, 0.0
        if led >= 0:
            ds, turn, reached, holds = guide(here, poses[led], path, reached, shift, law)
            if not holds and not done[led]:
                end = 3
                break
        there[0] = here[0] + ds * math.cos(here[2] + 0.5 * turn)
        there[1] = here[1] + ds * math.sin(here[2] + 0.5 * turn)
        there[2] = here[2] + turn
        copy_into(saved, poses)
        if robot_held(there, bodies, settings, scratch) or not advance(
            here, there, poses, lengths, bodies, settings, scratch
        ):
            end = 2
            break
        copy_into(here, there)
        copy_into(log.track[used], here)
        used += 1
        travelled += ds
        enclose(log.box, here, bodies.robot_radius + room)
        news = _take_stock(poses, saved, done, bodies, task, log.box, room)
        if news and stages < EVENTS - 1:
            stages = _write(log, stages, used, poses, lengths)
        if not _is_wanting(wanted, done):
            end = 0
            break
    if stages == 0 or log.steps[stages - 1] != used:
        stages = _write(log, stages, used, poses, lengths)
    return stages, used, end


@kernel
def _is_wanting(wanted: BoolArray, done: BoolArray) -> bool:
    """Whether something that is wanted is not done."""
    for k in range(wanted.shape[0]):
        if wanted[k] and not done[k]:
            return True
    return False
