"""Compiled quasi-static pushing: overlaps are resolved by the least total motion.

Objects rest unless something moves them. When the robot advances by a small step, every overlap
is removed by the motion that is least in the norm sum of m (dx² + dy² + c² dθ²), object by object
and point by point (projected Gauss-Seidel). That is Gauss's principle for bodies whose velocity
dies at once, so it is what a simulator with full damping computes, and it is the ellipsoidal
limit surface of Goyal, Ruina and Papadopoulos (1991) for a body pushed on the ground:
(v_x, v_y, ω) is proportional to (f_x, f_y, τ / c²).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.geometry.transforms import transform_points
from pushplan.interaction.contact import contacts, least_overlap
from pushplan.interaction.separation import drag_along, separate
from pushplan.world.checks import FloatArray, IntArray

_NEARBY = 3.0  # reach beyond the robot's within which objects are nearby at first [robot radii]


class Bodies(NamedTuple):
    """Robot, objects and walls as the kernels read them; arrays in SI units."""

    robot_vertices: FloatArray  # (V, 2) convex parts of the robot in its body frame
    robot_offsets: IntArray  # (P + 1,)
    wall_parts: int  # number of the first parts, which count at walls: all but the wheels
    robot_radius: float
    vertices: FloatArray  # (W, 2) outlines of the objects in their body frames
    offsets: IntArray  # (K + 1,)
    radii: FloatArray  # (K,) circumscribed radii
    inverse_masses: FloatArray  # (K,)
    inverse_gyration: FloatArray  # (K,) 1 / c² [1/m²]
    static_vertices: FloatArray  # (X, 2) convex static parts in the world frame
    static_offsets: IntArray  # (S + 1,)
    static_boxes: FloatArray  # (S, 4) x_min, y_min, x_max, y_max of each part


class Settings(NamedTuple):
    """Numerical settings of the kernels."""

    max_step: float  # Longest motion of a robot corner in one resolution step [m]
    tolerance: float  # Overlap that counts as resolved [m]
    jam_depth: float  # Overlap that cannot be resolved and counts as a jam [m]
    iterations: int  # Gauss-Seidel rounds in one step
    friction: float  # Coulomb coefficient between robot and objects
    static_friction: float = 0.0  # Coulomb coefficient between objects and walls


class Scratch(NamedTuple):
    """Memory that one caller reuses from step to step."""

    robot: FloatArray  # (V, 2) robot corners in the world frame
    outlines: FloatArray  # (W, 2) object corners in the world frame
    active: IntArray  # (K,) objects that may move in this step
    before: FloatArray  # (K, 3) poses before this step
    points: FloatArray  # (2, 5) contact points
    fixed: FloatArray  # (3,) a pose that stands for whatever cannot move
    here: FloatArray  # (3,) where a small step begins
    there: FloatArray  # (3,) where it ends
    saved: FloatArray  # (K, 3) poses before it, of the objects nearby
    near: IntArray  # (K,) objects nearby, in order: no other one is touched or moves
    nearby: IntArray  # (1,) how many
    disc: FloatArray  # (3,) x, y, radius: every object whose disc reaches into it is nearby
    tests: IntArray
    """(1,) pairs of outlines that were tested so far: a measure of time without a clock."""


@kernel(allocates=True)
def make_scratch(bodies: Bodies) -> Scratch:
    """Memory for `advance`; one per thread."""
    count = bodies.radii.shape[0]
    return Scratch(
        np.empty_like(bodies.robot_vertices),
        np.empty_like(bodies.vertices),
        np.empty(count, np.int64),
        np.empty((count, 3)),
        np.empty((2, 5)),
        np.zeros(3),
        np.empty(3),
        np.empty(3),
        np.empty((count, 3)),
        np.empty(count, np.int64),
        np.zeros(1, np.int64),
        np.empty(3),
        np.zeros(1, np.int64),
    )


@kernel
def _gather(
    x: float, y: float, reach: float, poses: FloatArray, bodies: Bodies, scratch: Scratch
) -> None:
    """Make every object nearby whose disc comes within ``reach`` of (x, y)."""
    count = 0
    for k in range(poses.shape[0]):
        dx = poses[k, 0] - x
        dy = poses[k, 1] - y
        far = reach + bodies.radii[k]
        if dx * dx + dy * dy < far * far:
            scratch.near[count] = k
            count += 1
    scratch.nearby[0] = count
    scratch.disc[0] = x
    scratch.disc[1] = y
    scratch.disc[2] = reach


@kernel
def _touching(
    x: float, y: float, reach: float, poses: FloatArray, bodies: Bodies, scratch: Scratch
) -> int:
    """Mark nearby objects within ``reach`` of (x, y) as active, and return their number."""
    count = 0
    for i in range(scratch.nearby[0]):
        k = scratch.near[i]
        dx = poses[k, 0] - x
        dy = poses[k, 1] - y
        far = reach + bodies.radii[k]
        if dx * dx + dy * dy < far * far:
            scratch.active[count] = k
            count += 1
    return count


@kernel
def _widen(k: int, count: int, poses: FloatArray, bodies: Bodies, scratch: Scratch) -> None:
    """Make every object nearby where object ``k`` may touch one that is not; ``count`` are active.

    Only active objects have moved since the small step began.
    """
    disc = scratch.disc
    dx = poses[k, 0] - disc[0]
    dy = poses[k, 1] - disc[1]
    room = disc[2] - bodies.radii[k]
    if room > 0.0 and dx * dx + dy * dy < room * room:
        return
    _gather(disc[0], disc[1], np.inf, poses, bodies, scratch)
    for other in range(poses.shape[0]):
        moves = False
        for i in range(count):
            moves = moves or scratch.active[i] == other
        if not moves:
            copy_into(scratch.saved[other], poses[other])


@kernel(inline=True)
def _out_of(
    piece: FloatArray,  # (N, 2) convex corners of what does not yield [m]
    piece_from: FloatArray,  # (3,) where it was
    piece_to: FloatArray,  # (3,) where it is
    friction: float,
    k: int,
    outline: FloatArray,  # (M, 2) corners of object ``k``, changed in place
    poses: FloatArray,
    bodies: Bodies,
    scratch: Scratch,
) -> float:
    """Move object ``k`` out of a piece; returns the deepest overlap found."""
    points = scratch.points
    inv = bodies.inverse_gyration[k]
    found = contacts(piece, outline, points)
    if found == 0:
        return 0.0
    depth: float = points[0, 4] if found == 1 else max(points[0, 4], points[1, 4])
    pushed = separate(points, found, scratch.fixed, 0.0, 0.0, poses[k], 1.0, inv)
    if friction > 0.0:
        limit = friction * pushed
        before = scratch.before[k]
        drag_along(points, found, limit, piece_from, piece_to, before, poses[k], inv)
    transform_points(poses[k], bodies.vertices[bodies.offsets[k] : bodies.offsets[k + 1]], outline)
    return depth


@kernel
def _against_robot(
    k: int,
    robot_from: FloatArray,
    robot_to: FloatArray,
    poses: FloatArray,
    bodies: Bodies,
    settings: Settings,
    scratch: Scratch,
) -> float:
    """Move object ``k`` out of the robot; returns the deepest overlap found."""
    deepest = 0.0
    friction = settings.friction
    parts = bodies.robot_offsets
    first = bodies.offsets[k]
    end = bodies.offsets[k + 1]
    outline = scratch.outlines[first:end]
    transform_points(poses[k], bodies.vertices[first:end], outline)
    for part in range(parts.shape[0] - 1):
        corners = scratch.robot[parts[part] : parts[part + 1]]
        depth = _out_of(corners, robot_from, robot_to, friction, k, outline, poses, bodies, scratch)
        deepest = max(deepest, depth)
    return deepest


@kernel
def _reaches(box: FloatArray, x: float, y: float, r: float) -> bool:
    """Return True if the square around a disc overlaps a box (4,) x_min, y_min, x_max, y_max."""
    across: bool = x + r > box[0] and x - r < box[2]
    return across and y + r > box[1] and y - r < box[3]


@kernel
def _against_static(
    k: int, poses: FloatArray, bodies: Bodies, settings: Settings, scratch: Scratch
) -> float:
    """Move object ``k`` out of the walls; returns the deepest overlap found."""
    deepest = 0.0
    friction = settings.static_friction
    still = scratch.fixed
    boxes = bodies.static_boxes
    parts = bodies.static_offsets
    x = poses[k, 0]
    y = poses[k, 1]
    r = bodies.radii[k]
    first = bodies.offsets[k]
    end = bodies.offsets[k + 1]
    outline = scratch.outlines[first:end]
    transform_points(poses[k], bodies.vertices[first:end], outline)
    for part in range(boxes.shape[0]):
        if _reaches(boxes[part], x, y, r):
            wall = bodies.static_vertices[parts[part] : parts[part + 1]]
            depth = _out_of(wall, still, still, friction, k, outline, poses, bodies, scratch)
            deepest = max(deepest, depth)
    return deepest


@kernel
def _against_objects(
    i: int, count: int, poses: FloatArray, bodies: Bodies, settings: Settings, scratch: Scratch
) -> tuple[float, int]:
    """Move active object ``i`` and its neighbours apart; neighbours that move become active."""
    deepest = 0.0
    points = scratch.points
    masses = bodies.inverse_masses
    gyration = bodies.inverse_gyration
    k = scratch.active[i]
    first = bodies.offsets[k]
    end = bodies.offsets[k + 1]
    body = bodies.vertices[first:end]
    outline = scratch.outlines[first:end]
    transform_points(poses[k], body, outline)
    _widen(k, count, poses, bodies, scratch)
    for place in range(scratch.nearby[0]):
        other = scratch.near[place]
        dx = poses[other, 0] - poses[k, 0]
        dy = poses[other, 1] - poses[k, 1]
        reach = bodies.radii[other] + bodies.radii[k]
        if other == k or dx * dx + dy * dy >= reach * reach:
            continue
        scratch.tests[0] += 1
        a = bodies.offsets[other]
        b = bodies.offsets[other + 1]
        transform_points(poses[other], bodies.vertices[a:b], scratch.outlines[a:b])
        found = contacts(outline, scratch.outlines[a:b], points)
        if found == 0:
            continue
        depth = points[0, 4] if found == 1 else max(points[0, 4], points[1, 4])
        if depth <= settings.tolerance:
            continue
        known = False
        for j in range(count):
            known = known or scratch.active[j] == other
        if not known:
            copy_into(scratch.before[other], poses[other])
            scratch.active[count] = other
            count += 1
        deepest = max(deepest, depth)
        separate(
            points,
            found,
            poses[k],
            masses[k],
            gyration[k],
            poses[other],
            masses[other],
            gyration[other],
        )
        transform_points(poses[k], body, outline)
    return deepest, count


@kernel
def _resolve(
    robot_from: FloatArray,
    robot_to: FloatArray,
    poses: FloatArray,
    bodies: Bodies,
    settings: Settings,
    scratch: Scratch,
) -> float:
    """One small robot step: move the objects out of the way; returns what overlap is left."""
    transform_points(robot_to, bodies.robot_vertices, scratch.robot)
    count = _touching(robot_to[0], robot_to[1], bodies.robot_radius, poses, bodies, scratch)
    for i in range(count):
        copy_into(scratch.before[scratch.active[i]], poses[scratch.active[i]])
    touched = count  # the robot itself reaches only these
    left = 0.0
    for _ in range(settings.iterations):
        left = 0.0
        i = 0
        while i < count:
            k = scratch.active[i]
            if i < touched:
                depth = _against_robot(k, robot_from, robot_to, poses, bodies, settings, scratch)
                left = max(left, depth)
            moved = (
                poses[k, 0] != scratch.before[k, 0]
                or poses[k, 1] != scratch.before[k, 1]
                or poses[k, 2] != scratch.before[k, 2]
            )
            if moved:
                depth, count = _against_objects(i, count, poses, bodies, settings, scratch)
                left = max(left, depth)
                left = max(left, _against_static(k, poses, bodies, settings, scratch))
            i += 1
        if left <= settings.tolerance:
            break
    return left


@kernel
def advance(
    robot_from: FloatArray,  # (3,)
    robot_to: FloatArray,  # (3,) where it goes, along a straight line
    poses: FloatArray,  # (K, 3) of the objects, changed in place; without a jam's small step
    lengths: FloatArray,  # (K,) path lengths of the objects [m], added to in place
    bodies: Bodies,
    settings: Settings,
    scratch: Scratch,
) -> bool:
    """Drive the robot to a near pose, pushing what is in the way; False where it jams."""
    dx = robot_to[0] - robot_from[0]
    dy = robot_to[1] - robot_from[1]
    turn = robot_to[2] - robot_from[2]
    turn -= 2.0 * np.pi * np.rint(turn / (2.0 * np.pi))  # the short way
    motion = np.sqrt(dx * dx + dy * dy) + abs(turn) * bodies.robot_radius
    mid_x = robot_from[0] + 0.5 * dx
    mid_y = robot_from[1] + 0.5 * dy
    reach = bodies.robot_radius + 0.5 * np.sqrt(dx * dx + dy * dy)
    _gather(mid_x, mid_y, reach + _NEARBY * bodies.robot_radius, poses, bodies, scratch)
    if _touching(mid_x, mid_y, reach, poses, bodies, scratch) == 0:
        return True
    steps = max(1, int(np.ceil(motion / settings.max_step)))
    here = scratch.here
    there = scratch.there
    saved = scratch.saved
    copy_into(here, robot_from)
    for step in range(1, steps + 1):
        part = step / steps
        there[0] = robot_from[0] + part * dx
        there[1] = robot_from[1] + part * dy
        there[2] = robot_from[2] + part * turn
        for i in range(scratch.nearby[0]):
            copy_into(saved[scratch.near[i]], poses[scratch.near[i]])
        left = _resolve(here, there, poses, bodies, settings, scratch)
        jams = left > settings.jam_depth
        for i in range(scratch.nearby[0]):
            k = scratch.near[i]
            if jams:
                copy_into(poses[k], saved[k])
            elif poses[k, 0] != saved[k, 0] or poses[k, 1] != saved[k, 1]:
                lengths[k] += np.sqrt(
                    (poses[k, 0] - saved[k, 0]) ** 2 + (poses[k, 1] - saved[k, 1]) ** 2
                )
        if jams:
            return False
        copy_into(here, there)
    return True


@kernel
def robot_held(pose: FloatArray, bodies: Bodies, settings: Settings, scratch: Scratch) -> bool:
    """Return True if the robot at ``pose`` (3,) overlaps static obstacles beyond the jam depth."""
    x = pose[0]
    y = pose[1]
    r = bodies.robot_radius
    placed = False
    boxes = bodies.static_boxes
    for part in range(boxes.shape[0]):
        if not _reaches(boxes[part], x, y, r):
            continue
        if not placed:
            transform_points(pose, bodies.robot_vertices, scratch.robot)
            placed = True
        wall = bodies.static_vertices[bodies.static_offsets[part] : bodies.static_offsets[part + 1]]
        for piece in range(bodies.wall_parts):
            corners = scratch.robot[bodies.robot_offsets[piece] : bodies.robot_offsets[piece + 1]]
            gap = max(least_overlap(wall, corners)[0], least_overlap(corners, wall)[0])
            if gap < -settings.jam_depth:
                return True
    return False


@kernel(allocates=True)
def sweep_path(
    path: FloatArray,  # (N, 3) robot poses
    poses: FloatArray,  # (K, 3) of the objects, changed in place
    bodies: Bodies,
    settings: Settings,
    out: FloatArray,  # (N, K, 3) receives the poses at each path pose
) -> int:
    """Sweep the robot along a path into ``out``; the first pose not reached, or -1."""
    scratch = make_scratch(bodies)
    lengths = np.zeros(poses.shape[0])
    jammed = -1
    copy_into(out[0], poses)
    for n in range(1, path.shape[0]):
        if jammed < 0 and (
            robot_held(path[n], bodies, settings, scratch)
            or not advance(path[n - 1], path[n], poses, lengths, bodies, settings, scratch)
        ):
            jammed = n
        copy_into(out[n], poses)
    return jammed
