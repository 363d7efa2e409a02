"""Compiled contacts of a crowd of convex bodies within one small step: found once, solved often.

Bodies rest unless something moves them. In a step the hull moves by a known displacement; every
pair that comes near gets one or two contact points with a gap, and the displacements of the bodies
are those that close no gap beyond zero with the least total motion and Coulomb friction, by
projected Gauss-Seidel on accumulated impulses (Catto, "Iterative Dynamics with Temporal Coherence",
2005, with velocities that start from zero). Pairs are looked for only around bodies that move.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry.transforms import transform_points
from pushplan.world.checks import FloatArray, IntArray

ROBOT = -1
"""Number of the hull where bodies are numbered."""


class Crowd(NamedTuple):
    """Shapes and masses, as the kernels read them."""

    hull: FloatArray
    """(V, 2) convex parts of the robot in its body frame [m]."""
    hull_offsets: IntArray
    """(P + 1,)"""
    hull_radius: float
    vertices: FloatArray
    """(W, 2) outlines of the objects in their body frames [m]."""
    offsets: IntArray
    """(K + 1,)"""
    radii: FloatArray
    """(K,) circumscribed radii [m]."""
    masses: FloatArray
    """(K,) [kg]."""
    inverse_gyration: FloatArray
    """(K,) 1 / c² [1/m²], c² being inertia over mass."""


class Solver(NamedTuple):
    """Numerical settings."""

    step: float
    """Longest motion of a hull corner in one step [m]."""
    iterations: int
    """Gauss-Seidel rounds in a step."""
    hull_friction: float
    friction: float
    """Coulomb coefficients between hull and object, and between objects."""
    still: float
    """Displacement in a step below which a body does not look for neighbours [m]."""


class Memory(NamedTuple):
    """Memory that one caller reuses; see `make_memory`."""

    hull: FloatArray
    """(V, 2) hull corners in the world frame."""
    corners: FloatArray
    """(W, 2) object corners in the world frame, kept up to date."""
    moves: FloatArray
    """(K, 3) displacement of each object in this step."""
    state: IntArray
    """(K,) 0 out of it, 1 in contact with something, 2 its neighbours are known."""
    pairs: IntArray
    """(C, 2) bodies of each contact point."""
    points: FloatArray
    """(C, 11) of each contact point: normal, arms from both bodies, gap, both effective inverse
    masses, accumulated impulses along and across the normal."""
    spot: FloatArray
    """(2, 5) points of one pair: x, y, normal, gap."""


@kernel(allocates=True)
def make_memory(crowd: Crowd) -> Memory:
    """Memory for `advance_ice`; one per thread and crowd."""
    count = crowd.radii.shape[0]
    room = 24 * count + 64
    return Memory(
        np.empty_like(crowd.hull),
        np.empty_like(crowd.vertices),
        np.zeros((count, 3)),
        np.zeros(count, np.int64),
        np.empty((room, 2), np.int64),
        np.empty((room, 11)),
        np.empty((2, 5)),
    )


@kernel(allocates=True)
def _widest_gap(a: FloatArray, b: FloatArray, enough: float) -> tuple[float, int]:
    """Greatest gap from an edge of ``a`` to ``b`` and that edge; stops at one beyond ``enough``."""
    best, edge = -np.inf, 0
    count = a.shape[0]
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        nx, ny = a[j, 1] - a[i, 1], a[i, 0] - a[j, 0]
        scale = 1.0 / np.sqrt(nx * nx + ny * ny)
        gap = np.inf
        for k in range(b.shape[0]):
            d = (b[k, 0] - a[i, 0]) * nx + (b[k, 1] - a[i, 1]) * ny
            if d < gap:
                gap = d
        gap *= scale
        if gap > best:
            best, edge = gap, i
            if best > enough:
                break
    return best, edge


@kernel(allocates=True)
def near_contacts(a: FloatArray, b: FloatArray, margin: float, out: FloatArray) -> int:
    """Points where two convex polygons touch or may soon touch.

    Args:
        a: (N, 2) counter-clockwise corners [m].
        b: (M, 2) counter-clockwise corners [m].
        margin: widest gap that counts [m].
        out: (2, 5) receives x, y [m], unit normal from ``a`` to ``b``, gap [m] (negative: overlap).

    Returns:
        0, 1 or 2 points.
    """
    gap_a, edge_a = _widest_gap(a, b, margin)
    if gap_a > margin:
        return 0
    gap_b, edge_b = _widest_gap(b, a, margin)
    if gap_b > margin:
        return 0
    flip = gap_b > gap_a + 1e-9 + 0.01 * abs(gap_a)
    ref, inc, edge = (b, a, edge_b) if flip else (a, b, edge_a)
    count = ref.shape[0]
    p, q = ref[edge], ref[edge + 1 if edge + 1 < count else 0]
    tx, ty = q[0] - p[0], q[1] - p[1]
    length = np.sqrt(tx * tx + ty * ty)
    tx, ty = tx / length, ty / length
    nx, ny = ty, -tx
    side, facing = 0, np.inf
    total = inc.shape[0]
    for i in range(total):
        j = i + 1 if i + 1 < total else 0
        ex, ey = inc[j, 0] - inc[i, 0], inc[j, 1] - inc[i, 1]
        d = (ey * nx - ex * ny) / np.sqrt(ex * ex + ey * ey)
        if d < facing:
            facing, side = d, i
    u, w = inc[side], inc[side + 1 if side + 1 < total else 0]
    su, sw = (u[0] - p[0]) * tx + (u[1] - p[1]) * ty, (w[0] - p[0]) * tx + (w[1] - p[1]) * ty
    du, dw = (u[0] - p[0]) * nx + (u[1] - p[1]) * ny, (w[0] - p[0]) * nx + (w[1] - p[1]) * ny
    sign = -1.0 if flip else 1.0
    found = 0
    span = sw - su
    for end in range(2):
        s, d = (su, du) if end == 0 else (sw, dw)
        clipped = min(max(s, 0.0), length)
        if clipped != s:
            if abs(span) < 1e-12 * length:
                continue
            share = (clipped - su) / span
            if share < 0.0 or share > 1.0:  # the incident edge lies beside the reference edge
                continue
            d = du + share * (dw - du)
        if d <= margin:
            out[found, 0] = p[0] + clipped * tx + d * nx
            out[found, 1] = p[1] + clipped * ty + d * ny
            out[found, 2] = sign * nx
            out[found, 3] = sign * ny
            out[found, 4] = d
            found += 1
    return found


@kernel(allocates=True)
def _note(
    a: int,
    b: int,
    found: int,
    count: int,
    origin: FloatArray,
    poses: FloatArray,
    crowd: Crowd,
    memory: Memory,
) -> int:
    """Add the points in ``memory.spot`` between bodies a and b to the contacts."""
    for i in range(found):
        if count >= memory.pairs.shape[0]:
            return count
        x, y, nx, ny, gap = memory.spot[i]
        row = memory.points[count]
        ax, ay = (
            (x - origin[0], y - origin[1]) if a == ROBOT else (x - poses[a, 0], y - poses[a, 1])
        )
        bx, by = x - poses[b, 0], y - poses[b, 1]
        base = 1.0 / crowd.masses[b]
        turn_b = base * crowd.inverse_gyration[b]
        along = base + turn_b * (bx * ny - by * nx) ** 2
        across = base + turn_b * (bx * nx + by * ny) ** 2
        if a != ROBOT:
            base = 1.0 / crowd.masses[a]
            turn_a = base * crowd.inverse_gyration[a]
            along += base + turn_a * (ax * ny - ay * nx) ** 2
            across += base + turn_a * (ax * nx + ay * ny) ** 2
        row[0], row[1], row[2], row[3], row[4], row[5] = nx, ny, ax, ay, bx, by
        row[6], row[7], row[8], row[9], row[10] = gap, along, across, 0.0, 0.0
        memory.pairs[count, 0], memory.pairs[count, 1] = a, b
        count += 1
    return count


@kernel(allocates=True)
def _meet_neighbours(
    k: int,
    count: int,
    margin: float,
    origin: FloatArray,
    poses: FloatArray,
    crowd: Crowd,
    memory: Memory,
) -> int:
    """Contacts of body ``k``, which has begun to move, with all that are near and not yet met."""
    memory.state[k] = 2
    own = memory.corners[crowd.offsets[k] : crowd.offsets[k + 1]]
    for j in range(poses.shape[0]):
        if j == k or memory.state[j] == 2:
            continue
        dx, dy = poses[j, 0] - poses[k, 0], poses[j, 1] - poses[k, 1]
        reach = crowd.radii[j] + crowd.radii[k] + margin
        if dx * dx + dy * dy >= reach * reach:
            continue
        other = memory.corners[crowd.offsets[j] : crowd.offsets[j + 1]]
        found = near_contacts(own, other, margin, memory.spot)
        if found:
            count = _note(k, j, found, count, origin, poses, crowd, memory)
            if memory.state[j] == 0:
                memory.state[j] = 1
    return count


@kernel(allocates=True)
def _relax(
    count: int, by: FloatArray, poses: FloatArray, crowd: Crowd, solver: Solver, memory: Memory
) -> None:
    """One round over all contacts: impulses that keep gaps open and hinder sliding."""
    moves, points, pairs = memory.moves, memory.points, memory.pairs
    for i in range(count):
        a, b = pairs[i, 0], pairs[i, 1]
        row = points[i]
        nx, ny, ax, ay, bx, by_ = row[0], row[1], row[2], row[3], row[4], row[5]
        move = by if a == ROBOT else moves[a]
        rx = moves[b, 0] - moves[b, 2] * by_ - move[0] + move[2] * ay
        ry = moves[b, 1] + moves[b, 2] * bx - move[1] - move[2] * ax
        old = row[9]
        row[9] = max(0.0, old - (rx * nx + ry * ny + row[6]) / row[7])
        friction = solver.hull_friction if a == ROBOT else solver.friction
        limit = friction * row[9]
        slid = row[10]
        row[10] = min(max(slid - (ry * nx - rx * ny) / row[8], -limit), limit)
        push, drag = row[9] - old, row[10] - slid
        if push == 0.0 and drag == 0.0:
            continue
        ix, iy = push * nx - drag * ny, push * ny + drag * nx
        weight = 1.0 / crowd.masses[b]
        moves[b, 0] += weight * ix
        moves[b, 1] += weight * iy
        moves[b, 2] += weight * crowd.inverse_gyration[b] * (bx * iy - by_ * ix)
        if a != ROBOT:
            weight = 1.0 / crowd.masses[a]
            moves[a, 0] -= weight * ix
            moves[a, 1] -= weight * iy
            moves[a, 2] -= weight * crowd.inverse_gyration[a] * (ax * iy - ay * ix)


@kernel(allocates=True)
def advance_ice(
    here: FloatArray,
    by: FloatArray,
    poses: FloatArray,
    crowd: Crowd,
    solver: Solver,
    memory: Memory,
) -> float:
    """Move the hull by one small step among the objects.

    Args:
        here: (3,) pose of the hull before.
        by: (3,) its displacement.
        poses: (K, 3) poses of the objects, changed in place; ``memory.corners`` must fit them.
        crowd: shapes and masses.
        solver: settings.
        memory: from `make_memory`.

    Returns:
        The work, sum of mass times way over the objects [kg m].
    """
    count = 0
    margin = solver.step
    transform_points(here, crowd.hull, memory.hull)
    memory.state[:] = 0
    any_near = False
    for k in range(poses.shape[0]):
        dx, dy = poses[k, 0] - here[0], poses[k, 1] - here[1]
        reach = crowd.hull_radius + crowd.radii[k] + margin
        if dx * dx + dy * dy >= reach * reach:
            continue
        own = memory.corners[crowd.offsets[k] : crowd.offsets[k + 1]]
        for part in range(crowd.hull_offsets.shape[0] - 1):
            piece = memory.hull[crowd.hull_offsets[part] : crowd.hull_offsets[part + 1]]
            found = near_contacts(piece, own, margin, memory.spot)
            if found:
                count = _note(ROBOT, k, found, count, here, poses, crowd, memory)
                memory.state[k] = 1
                any_near = True
    if not any_near:
        return 0.0
    memory.moves[:] = 0.0
    for _ in range(solver.iterations):
        _relax(count, by, poses, crowd, solver, memory)
        for k in range(poses.shape[0]):
            if memory.state[k] == 1:
                moved = abs(memory.moves[k, 0]) + abs(memory.moves[k, 1])
                if moved + abs(memory.moves[k, 2]) * crowd.radii[k] > solver.still:
                    count = _meet_neighbours(k, count, margin, here, poses, crowd, memory)
    work = 0.0
    for k in range(poses.shape[0]):
        if memory.state[k] > 0:
            dx, dy, turn = memory.moves[k, 0], memory.moves[k, 1], memory.moves[k, 2]
            if dx != 0.0 or dy != 0.0 or turn != 0.0:
                poses[k, 0] += dx
                poses[k, 1] += dy
                poses[k, 2] += turn
                work += crowd.masses[k] * np.sqrt(dx * dx + dy * dy)
                a, b = crowd.offsets[k], crowd.offsets[k + 1]
                transform_points(poses[k], crowd.vertices[a:b], memory.corners[a:b])
    return work


@kernel(allocates=True)
def sweep_ice(
    path: FloatArray,
    poses: FloatArray,
    crowd: Crowd,
    solver: Solver,
    memory: Memory,
    out: FloatArray,
) -> float:
    """Sweep the hull along a path.

    Args:
        path: (N, 3) poses of the hull.
        poses: (K, 3) poses of the objects, changed in place.
        crowd: shapes and masses.
        solver: settings.
        memory: from `make_memory`.
        out: (N, K, 3) receives the poses at each path pose, or (0, K, 3).

    Returns:
        The work [kg m].
    """
    work = 0.0
    for k in range(poses.shape[0]):
        a, b = crowd.offsets[k], crowd.offsets[k + 1]
        transform_points(poses[k], crowd.vertices[a:b], memory.corners[a:b])
    keep = out.shape[0] > 0
    if keep:
        out[0] = poses
    here, by = np.empty(3), np.empty(3)
    for n in range(1, path.shape[0]):
        turn = path[n, 2] - path[n - 1, 2]
        turn -= 2.0 * np.pi * np.round(turn / (2.0 * np.pi))
        dx, dy = path[n, 0] - path[n - 1, 0], path[n, 1] - path[n - 1, 1]
        motion = np.sqrt(dx * dx + dy * dy) + abs(turn) * crowd.hull_radius
        steps = max(1, int(np.ceil(motion / solver.step)))
        by[0], by[1], by[2] = dx / steps, dy / steps, turn / steps
        for step in range(steps):
            here[:] = path[n - 1] + step * by
            work += advance_ice(here, by, poses, crowd, solver, memory)
        if keep:
            out[n] = poses
    return work
