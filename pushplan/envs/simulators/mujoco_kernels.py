"""Compiled loops over the arrays of a MuJoCo scene; they run many times in every step."""

from __future__ import annotations

import math

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray

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
