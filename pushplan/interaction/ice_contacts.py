"""Compiled contacts of a crowd of convex bodies within one small step: found once, solved often.

Bodies rest unless something moves them. In a step the hull moves by a known displacement; every
pair that comes near gets one or two contact points with a gap, and the displacements of the bodies
are those that close no gap beyond zero with the least total motion and Coulomb friction, by
projected Gauss-Seidel on accumulated impulses (Catto, "Iterative Dynamics with Temporal Coherence",
2005, with velocities that start from zero). Pairs are looked for only around bodies that move.
"""

from __future__ import annotations

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.geometry.angles import wrap_angle
from pushplan.geometry.transforms import transform_outlines, transform_points
from pushplan.interaction.contact import clip_facing
from pushplan.interaction.ice_bodies import IceProblem
from pushplan.world.checks import FloatArray


@kernel
def _widest_gap(a: FloatArray, b: FloatArray, enough: float) -> tuple[float, int]:
    """Greatest gap from an edge of ``a`` to ``b`` and that edge; stops at one beyond ``enough``."""
    best = -np.inf
    edge = 0
    count = a.shape[0]
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        nx = a[j, 1] - a[i, 1]
        ny = a[i, 0] - a[j, 0]
        scale = 1.0 / np.sqrt(nx * nx + ny * ny)
        gap = np.inf
        for k in range(b.shape[0]):
            d = (b[k, 0] - a[i, 0]) * nx + (b[k, 1] - a[i, 1]) * ny
            if d < gap:
                gap = d
        gap *= scale
        if gap > best:
            best = gap
            edge = i
            if best > enough:
                break
    return best, edge


@kernel
def near_contacts(
    a: FloatArray,  # (N, 2) counter-clockwise corners [m]
    b: FloatArray,  # (M, 2) counter-clockwise corners [m]
    margin: float,  # widest gap that counts [m]
    out: FloatArray,  # (2, 5) x, y [m], unit normal from a to b, gap [m] (negative: overlap)
) -> int:
    """Write 0, 1 or 2 points where two convex polygons touch or may soon touch; their number."""
    gap_a, edge_a = _widest_gap(a, b, margin)
    if gap_a > margin:
        return 0
    gap_b, edge_b = _widest_gap(b, a, margin)
    if gap_b > margin:
        return 0
    if gap_b > gap_a + 1e-9 + 0.01 * abs(gap_a):
        return int(clip_facing(b, edge_b, a, -1.0, margin, False, out))
    return int(clip_facing(a, edge_a, b, 1.0, margin, False, out))


ROBOT = -1
"""Number of the hull where bodies are numbered."""


@kernel
def _add_contacts(
    a: int, b: int, found: int, count: int, poses: FloatArray, problem: IceProblem
) -> int:
    """Add the points in ``scratch.spot`` between bodies a and b to ``count`` contacts."""
    bodies = problem.bodies
    scratch = problem.scratch
    here = scratch.pose[0] if a == ROBOT else poses[a]
    for i in range(found):
        if count >= scratch.pairs.shape[0]:
            return count
        spot = scratch.spot[i]
        row = scratch.points[count]
        x = spot[0]
        y = spot[1]
        nx = spot[2]
        ny = spot[3]
        gap = spot[4]
        ax = x - here[0]
        ay = y - here[1]
        bx = x - poses[b, 0]
        by = y - poses[b, 1]
        base = 1.0 / bodies.masses[b]
        turn_b = base * bodies.inverse_gyration[b]
        along = base + turn_b * (bx * ny - by * nx) ** 2
        across = base + turn_b * (bx * nx + by * ny) ** 2
        if a != ROBOT:
            base = 1.0 / bodies.masses[a]
            turn_a = base * bodies.inverse_gyration[a]
            along += base + turn_a * (ax * ny - ay * nx) ** 2
            across += base + turn_a * (ax * nx + ay * ny) ** 2
        row[0] = nx
        row[1] = ny
        row[2] = ax
        row[3] = ay
        row[4] = bx
        row[5] = by
        row[6] = gap
        row[7] = along
        row[8] = across
        row[9] = 0.0
        row[10] = 0.0
        scratch.pairs[count, 0] = a
        scratch.pairs[count, 1] = b
        count += 1
    return count


@kernel
def _meet_neighbours(k: int, count: int, poses: FloatArray, problem: IceProblem) -> int:
    """Contacts of body ``k``, which has begun to move, with all that are near and not yet met."""
    bodies = problem.bodies
    scratch = problem.scratch
    margin = problem.settings.step
    scratch.state[k] = 2
    own = scratch.corners[bodies.offsets[k] : bodies.offsets[k + 1]]
    for j in range(poses.shape[0]):
        if j == k or scratch.state[j] == 2:
            continue
        dx = poses[j, 0] - poses[k, 0]
        dy = poses[j, 1] - poses[k, 1]
        reach = bodies.radii[j] + bodies.radii[k] + margin
        if dx * dx + dy * dy >= reach * reach:
            continue
        other = scratch.corners[bodies.offsets[j] : bodies.offsets[j + 1]]
        found = near_contacts(own, other, margin, scratch.spot)
        if found:
            count = _add_contacts(k, j, found, count, poses, problem)
            if scratch.state[j] == 0:
                scratch.state[j] = 1
    return count


@kernel
def _relax(count: int, problem: IceProblem) -> None:
    """One round over all contacts: impulses that keep gaps open and hinder sliding."""
    bodies = problem.bodies
    settings = problem.settings
    scratch = problem.scratch
    moves = scratch.moves
    points = scratch.points
    pairs = scratch.pairs
    for i in range(count):
        a = pairs[i, 0]
        b = pairs[i, 1]
        row = points[i]
        nx = row[0]
        ny = row[1]
        ax = row[2]
        ay = row[3]
        bx = row[4]
        by = row[5]
        move = scratch.pose[1] if a == ROBOT else moves[a]
        rx = moves[b, 0] - moves[b, 2] * by - move[0] + move[2] * ay
        ry = moves[b, 1] + moves[b, 2] * bx - move[1] - move[2] * ax
        old = row[9]
        row[9] = max(0.0, old - (rx * nx + ry * ny + row[6]) / row[7])
        friction = settings.hull_friction if a == ROBOT else settings.friction
        limit = friction * row[9]
        slid = row[10]
        row[10] = min(max(slid - (ry * nx - rx * ny) / row[8], -limit), limit)
        push = row[9] - old
        drag = row[10] - slid
        if push == 0.0 and drag == 0.0:
            continue
        ix = push * nx - drag * ny
        iy = push * ny + drag * nx
        weight = 1.0 / bodies.masses[b]
        moves[b, 0] += weight * ix
        moves[b, 1] += weight * iy
        moves[b, 2] += weight * bodies.inverse_gyration[b] * (bx * iy - by * ix)
        if a != ROBOT:
            weight = 1.0 / bodies.masses[a]
            moves[a, 0] -= weight * ix
            moves[a, 1] -= weight * iy
            moves[a, 2] -= weight * bodies.inverse_gyration[a] * (ax * iy - ay * ix)


@kernel
def _meet_hull(poses: FloatArray, problem: IceProblem) -> int:
    """Contacts of the hull at ``scratch.pose[0]`` with the objects; their number."""
    bodies = problem.bodies
    scratch = problem.scratch
    margin = problem.settings.step
    here = scratch.pose[0]
    transform_points(here, bodies.hull, scratch.hull)
    scratch.state[:] = 0
    count = 0
    for k in range(poses.shape[0]):
        dx = poses[k, 0] - here[0]
        dy = poses[k, 1] - here[1]
        reach = bodies.hull_radius + bodies.radii[k] + margin
        if dx * dx + dy * dy >= reach * reach:
            continue
        own = scratch.corners[bodies.offsets[k] : bodies.offsets[k + 1]]
        for part in range(bodies.hull_offsets.shape[0] - 1):
            piece = scratch.hull[bodies.hull_offsets[part] : bodies.hull_offsets[part + 1]]
            found = near_contacts(piece, own, margin, scratch.spot)
            if found:
                count = _add_contacts(ROBOT, k, found, count, poses, problem)
                scratch.state[k] = 1
    return count


@kernel
def advance_ice(poses: FloatArray, problem: IceProblem) -> float:
    """Move the hull by one small step, ``scratch.pose``, among objects (K, 3); the work [kg m]."""
    bodies = problem.bodies
    settings = problem.settings
    scratch = problem.scratch
    count = _meet_hull(poses, problem)
    if count == 0:
        return 0.0
    moves = scratch.moves
    moves[:] = 0.0
    for _ in range(settings.iterations):
        _relax(count, problem)
        for k in range(poses.shape[0]):
            if scratch.state[k] == 1:
                moved = abs(moves[k, 0]) + abs(moves[k, 1])
                if moved + abs(moves[k, 2]) * bodies.radii[k] > settings.still:
                    count = _meet_neighbours(k, count, poses, problem)
    work = 0.0
    for k in range(poses.shape[0]):
        if scratch.state[k] > 0:
            dx = moves[k, 0]
            dy = moves[k, 1]
            turn = moves[k, 2]
            if dx != 0.0 or dy != 0.0 or turn != 0.0:
                poses[k, 0] += dx
                poses[k, 1] += dy
                poses[k, 2] += turn
                work += bodies.masses[k] * np.sqrt(dx * dx + dy * dy)
                a = bodies.offsets[k]
                b = bodies.offsets[k + 1]
                transform_points(poses[k], bodies.vertices[a:b], scratch.corners[a:b])
    return work


@kernel
def drive_ice(
    robot_from: FloatArray,  # (3,)
    robot_to: FloatArray,  # (3,) where it goes, along a straight line
    poses: FloatArray,  # (K, 3) of the objects, changed in place
    problem: IceProblem,  # with the corners of these poses in its memory
    work: float,  # sum to which the result is added [kg m]
) -> tuple[float, int]:
    """Move the hull to a pose in small steps among the objects; the work and how many steps."""
    here = problem.scratch.pose[0]
    by = problem.scratch.pose[1]
    turn = wrap_angle(robot_to[2] - robot_from[2])
    dx = robot_to[0] - robot_from[0]
    dy = robot_to[1] - robot_from[1]
    motion = np.sqrt(dx * dx + dy * dy) + abs(turn) * problem.bodies.hull_radius
    steps = max(1, int(np.ceil(motion / problem.settings.step)))
    by[0] = dx / steps
    by[1] = dy / steps
    by[2] = turn / steps
    for step in range(steps):
        for i in range(3):
            here[i] = robot_from[i] + step * by[i]
        work += advance_ice(poses, problem)
    return work, steps


@kernel
def sweep_ice(path: FloatArray, poses: FloatArray, problem: IceProblem, out: FloatArray) -> float:
    """Sweep the hull along (N, 3) poses among objects (K, 3), into ``out`` (N, K, 3); the work."""
    bodies = problem.bodies
    work = 0.0
    transform_outlines(poses, bodies.vertices, bodies.offsets, problem.scratch.corners)
    copy_into(out[0], poses)
    for n in range(1, path.shape[0]):
        work, _ = drive_ice(path[n - 1], path[n], poses, problem, work)
        copy_into(out[n], poses)
    return work
