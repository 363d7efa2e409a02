"""Compiled loops over the arrays of a MuJoCo scene; they run many times in every step."""

from __future__ import annotations

import math

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry.convex import convex_penetration
from pushplan.geometry.transforms import transform_points
from pushplan.world.checks import BoolArray, FloatArray, IntArray

TILT = 1e-4
"""Square of half the sine of the greatest tilt at which an object may rest."""


@kernel(allocates=True)
def quiet_objects(
    velocities: FloatArray,  # (K, 3) of floating bodies, or (K, 6) of free ones, turning last
    positions: FloatArray,  # (K, 3) x, y, theta, or (K, 7) x, y, z and a quaternion w x y z
    before: FloatArray,  # the same, one sample earlier
    radii: FloatArray,  # (K,) of the objects [m]; they turn a rate of rotation into a speed
    speed: float,  # below which an object counts as quiet [m/s]
    interval: float,  # since the sample before [s]
    quiet: BoolArray,  # (K,) receives the answer
) -> None:
    """Which objects have hardly moved of late, and do not stand tilted."""
    free = velocities.shape[1] == 6
    linear = 3 if free else 2
    for k in range(len(velocities)):
        fastest = 0.0
        for j in range(velocities.shape[1]):
            size = 1.0 if j < linear else radii[k]
            fastest = max(fastest, abs(velocities[k, j]) * size)
        moved = 0.0
        for j in range(linear):
            moved = max(moved, abs(positions[k, j] - before[k, j]))
        if free:
            x, y = positions[k, 4], positions[k, 5]
            upright = x * x + y * y < TILT
            # half the turn, near enough while it is small
            for j in range(4, 7):
                moved = max(moved, 2.0 * abs(positions[k, j] - before[k, j]) * radii[k])
        else:
            upright = True
            moved = max(moved, abs(positions[k, 2] - before[k, 2]) * radii[k])
        quiet[k] = upright and fastest < speed and moved < speed * interval


@kernel(allocates=True)
def _root(parent: IntArray, k: int) -> int:
    """The representative of the set that ``k`` is in (union-find)."""
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k


@kernel(allocates=True)
def rest_cycles(
    poses: FloatArray,  # (K, 3) x, y [m], theta [rad]
    vertices: FloatArray,  # (V, 2) outlines in body frames, flattened [m]
    offsets: IntArray,  # (K + 1,) where each begins
    radii: FloatArray,  # (K,) of the discs that hold them [m]
    quiet: BoolArray,  # (K,) which may sleep
    gap: float,  # nearer objects form a group [m]
    asleep: IntArray,  # (1 + K,) receives the next tree of each sleeper's group, the robot's first
) -> None:
    """Let quiet objects sleep, together with all that they may touch."""
    # MuJoCo wakes bodies that sleep together at once, and expects that no two bodies touch that
    # sleep apart: objects closer than gap form a group, one restless member keeps it awake
    count = len(poses)
    parent = np.arange(count)
    corners = np.empty_like(vertices)
    for k in range(count):
        a, b = offsets[k], offsets[k + 1]
        transform_points(poses[k], vertices[a:b], corners[a:b])
    for a in range(count):
        for b in range(a + 1, count):
            reach = radii[a] + radii[b] + gap
            dx, dy = poses[a, 0] - poses[b, 0], poses[a, 1] - poses[b, 1]
            if dx * dx + dy * dy > reach * reach:
                continue
            one = corners[offsets[a] : offsets[a + 1]]
            other = corners[offsets[b] : offsets[b + 1]]
            if convex_penetration(one, other)[0] > -gap:
                parent[_root(parent, a)] = _root(parent, b)
    restless = np.zeros(count, dtype=np.bool_)
    for k in range(count):
        if not quiet[k]:
            restless[_root(parent, k)] = True
    last = np.full(count, -1)  # of the members found so far of the group with this root
    first = np.full(count, -1)
    for k in range(count):
        root = _root(parent, k)
        if restless[root]:
            continue
        if last[root] < 0:
            first[root] = k
        else:
            asleep[1 + last[root]] = 1 + k
        asleep[1 + k] = 1 + first[root]
        last[root] = k


def rest_gap(radii: FloatArray) -> float:
    """Objects closer than this [m] may touch: a hundredth of the smallest one's radius."""
    return 0.01 * float(radii.min()) if len(radii) else math.inf


ASLEEP, AWAKE, STATIC = 0, 1, -1
"""States of a body, as in MuJoCo's mjtSleepState."""


@kernel(allocates=True)
def planar_rows(
    qpos: FloatArray,  # (N, nq) one free body (x, y, z, quaternion w x y z), joints, free bodies
    first: int,  # where the second free body begins
    out: FloatArray,  # (N, B, 3) receives x, y [m] and theta [rad] of each free body
) -> None:
    """Planar poses of free bodies."""
    for n in range(len(qpos)):
        for b in range(out.shape[1]):
            at = first + 7 * (b - 1) if b else 0
            w, x = qpos[n, at + 3], qpos[n, at + 4]
            y, z = qpos[n, at + 5], qpos[n, at + 6]
            out[n, b, 0], out[n, b, 1] = qpos[n, at], qpos[n, at + 1]
            out[n, b, 2] = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


@kernel(allocates=True)
def sleep_lists(
    asleep: FloatArray,  # (T,) negative where a tree is awake
    tree_of_body: FloatArray,  # (B,) tree of each body, -1 where it is static
    parent: FloatArray,  # (B,) parent of each body
    tree_of_dof: FloatArray,  # (V,) tree of each degree of freedom
    tree_awake: FloatArray,  # (T,) receives whether a tree is awake
    body_awake: FloatArray,  # (B,) receives the state of each body
    bodies: FloatArray,  # (B,) receives the indices of the bodies that are awake or static
    parents: FloatArray,  # (B,) receives the indices of the bodies whose parent is awake or static
    dofs: FloatArray,  # (V,) receives the indices of the degrees of freedom that are awake
) -> tuple[int, int, int, int]:
    """Derive MuJoCo's lists of what is awake; the numbers of trees, bodies, children and dofs."""
    trees = 0
    for t in range(len(asleep)):
        tree_awake[t] = 1 if asleep[t] < 0 else 0
        trees += tree_awake[t]
    some, children, moving = 0, 0, 0
    for b in range(len(body_awake)):
        tree = tree_of_body[b]
        body_awake[b] = STATIC if tree < 0 else (AWAKE if tree_awake[tree] else ASLEEP)
        if body_awake[b] != ASLEEP:
            bodies[some] = b
            some += 1
        if b > 0 and body_awake[parent[b]] != ASLEEP:
            parents[children] = b
            children += 1
    for v in range(len(tree_of_dof)):
        if tree_awake[tree_of_dof[v]]:
            dofs[moving] = v
            moving += 1
    return trees, some, children, moving


@kernel(allocates=True)
def drag_damping(
    velocities: FloatArray,  # (B, 3) of floating bodies [m/s, m/s, rad/s]
    drag: FloatArray,  # (B, 4) linear and quadratic coefficients of translation, then of rotation
    damping: FloatArray,  # (B, 3) receives b + c |v|, [N s/m] and [N m s]
) -> None:
    """Linear damping that equals combined linear and quadratic drag at the velocities now."""
    for i in range(len(velocities)):
        vx, vy, w = velocities[i, 0], velocities[i, 1], velocities[i, 2]
        along = drag[i, 0] + drag[i, 1] * math.sqrt(vx * vx + vy * vy)
        damping[i, 0] = along
        damping[i, 1] = along
        damping[i, 2] = drag[i, 2] + drag[i, 3] * abs(w)
