"""At which price the robot can drive where, on the lattice of `floor`.

What is static forbids poses; an object that the footprint overlaps costs as far as it is carried
along, until the overlap gets less again.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pushplan.compiled import kernel
from pushplan.geometry import convex_penetration
from pushplan.geometry.transforms import transform_points
from pushplan.motion.collision import Footprint
from pushplan.planners.rearrangement.pose_grid import Floor
from pushplan.world.checks import BoolArray, FloatArray, IntArray

Layers = NDArray[np.float32]
"""(K, 16, rows, columns) depth of the footprint in each object [m]."""
ARM = 0.8
"""How far a turn by one radian carries an object along [circumscribed radii]."""


_BUCKETS = 1024
"""How many buckets of poses a search has in one round."""
_WIDTH = 0.1
"""Costs that one bucket spans [cells]."""


@kernel(allocates=True)
def contact_depths(
    floor: Floor,
    headings: FloatArray,
    shape: Footprint,
    poses: FloatArray,
    vertices: FloatArray,
    offsets: IntArray,
    radii: FloatArray,
    chosen: BoolArray,
) -> Layers:
    """(K, 16, rows, columns) how deep the footprint is in each of the chosen objects [m]."""
    count, rows, cols = floor.blocked.shape
    out = np.zeros((poses.shape[0], count, rows, cols), dtype=np.float32)
    outline, pose = np.empty_like(vertices), np.empty(3)
    body = np.empty_like(shape.vertices)
    for k in range(poses.shape[0]):
        if not chosen[k]:
            continue
        a, b = offsets[k], offsets[k + 1]
        transform_points(poses[k], vertices[a:b], outline[a:b])
        reach = shape.radius + radii[k]
        i0 = max(0, int(np.ceil((poses[k, 1] - reach - floor.y) / floor.step)))
        i1 = min(rows - 1, int(np.floor((poses[k, 1] + reach - floor.y) / floor.step)))
        j0 = max(0, int(np.ceil((poses[k, 0] - reach - floor.x) / floor.step)))
        j1 = min(cols - 1, int(np.floor((poses[k, 0] + reach - floor.x) / floor.step)))
        for t in range(headings.shape[0]):
            pose[:] = 0.0
            pose[2] = headings[t]
            transform_points(pose, shape.vertices, body)
            for i in range(i0, i1 + 1):
                y = floor.y + i * floor.step
                for j in range(j0, j1 + 1):
                    x = floor.x + j * floor.step
                    dx, dy = poses[k, 0] - x, poses[k, 1] - y
                    if dx * dx + dy * dy >= reach * reach or floor.blocked[t, i, j]:
                        continue
                    deepest = 0.0
                    moved = outline[a:b] - np.array([x, y])
                    for p in range(shape.offsets.shape[0] - 1):
                        part = body[shape.offsets[p] : shape.offsets[p + 1]]
                        deepest = max(deepest, convex_penetration(part, moved)[0])
                    out[k, t, i, j] = deepest
    return out


@kernel(allocates=True)
def add_up(layers: Layers, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Depth in all objects together at each pose [m], and the weights of those it is in.

    Args:
        layers: (K, 16, rows, columns) from `contact_depths`.
        weights: (K,) 0 for objects that do not count.
    """
    count, turns, rows, cols = layers.shape
    flat = layers.reshape((count, turns * rows * cols))
    depths, touch = np.zeros(flat.shape[1]), np.zeros(flat.shape[1])
    for k in range(count):
        if weights[k] == 0.0:
            continue
        for n in range(flat.shape[1]):
            if flat[k, n] > 0.0:
                depths[n] += flat[k, n]
                touch[n] += weights[k]
    return depths.reshape((turns, rows, cols)), touch.reshape((turns, rows, cols))


@kernel(allocates=True, inline=True)
def _unlink(node: int, heads: IntArray, after: IntArray, ahead: IntArray) -> None:
    """Take a node out of its bucket."""
    if ahead[node] >= 0:
        after[ahead[node]] = after[node]
    else:
        heads[-2 - ahead[node]] = after[node]
    if after[node] >= 0:
        ahead[after[node]] = ahead[node]
    ahead[node] = -1


@kernel(allocates=True, inline=True)
def _link(node: int, bucket: int, heads: IntArray, after: IntArray, ahead: IntArray) -> None:
    """Put a node that is in no bucket into one."""
    after[node], ahead[node] = heads[bucket], -2 - bucket
    if heads[bucket] >= 0:
        ahead[heads[bucket]] = node
    heads[bucket] = node


@kernel(allocates=True)
def _deal(
    best: FloatArray, width: float, heads: IntArray, after: IntArray, ahead: IntArray
) -> float:
    """Put the poses that wait in the last bucket where they belong; returns the least cost."""
    base, node = np.inf, heads[_BUCKETS]
    while node >= 0:
        base = min(base, best[node])
        node = after[node]
    node, heads[_BUCKETS] = heads[_BUCKETS], -1
    while node >= 0:
        following = after[node]
        _link(node, int(min((best[node] - base) / width, _BUCKETS)), heads, after, ahead)
        node = following
    return base


@kernel(allocates=True)
def _beside(
    t: int, i: int, j: int, move: int, shape: tuple[int, int, int], moves: IntArray
) -> tuple[int, int]:
    """The pose that a move leads to, -1 if none; and the heading that says how far it is.

    Args:
        t, i, j: heading, row and column of a pose.
        move: 0 ahead, 1 back, 2 to the next heading, 3 to the one before.
        shape: how many headings, rows and columns there are.
        moves: (16, 2) `MOVES`.
    """
    count, rows, cols = shape
    if move < 2:
        sign = 1 - 2 * move
        i, j = i + sign * moves[t, 1], j + sign * moves[t, 0]
        if i < 0 or j < 0 or i >= rows or j >= cols:
            return -1, t
        return (t * rows + i) * cols + j, t
    to = t + 1 if move == 2 else t - 1
    to = to - count if to == count else (count - 1 if to < 0 else to)
    return (to * rows + i) * cols + j, t if move == 2 else to


@kernel(allocates=True)
def search_poses(
    starts: IntArray,
    costs: FloatArray,
    floor: Floor,
    depths: FloatArray,
    touch: FloatArray,
    moves: IntArray,
    lengths: FloatArray,
    turns: FloatArray,
    turn_price: float,
    arm: float,
    targets: IntArray,
) -> tuple[FloatArray, IntArray]:
    """Cheapest ways from a set of poses to every pose of the lattice.

    Poses are expanded bucket by bucket of about equal costs, and again where they get cheaper
    (Dial 1969; Meyer and Sanders 2003). What lies beyond the last bucket waits for another round.

    Args:
        starts: (S,) flat indices of poses.
        costs: (S,) what it costs to be there [m].
        floor: the lattice.
        depths, touch: (16, rows, columns) from `contact_depths`.
        moves: (16, 2) `MOVES`.
        lengths: (16,) of the moves, in cells.
        turns: (16,) angle from each heading to the next [rad].
        turn_price: price of a turn [m/rad].
        arm: how far a turn carries an object along [m/rad].
        targets: flat indices of poses after which to stop; none to go on to the end.

    Returns:
        (16 * rows * columns,) costs [m] and the pose before each, -1 for none. Where the search
        has stopped before the end, costs above that of the last target are not the least ones.
    """
    total, (_, rows, cols) = depths.size, depths.shape
    best = np.full(total, np.inf)
    before = np.full(total, -1, dtype=np.int64)
    flat, shut, near = depths.ravel(), floor.blocked.ravel(), touch.ravel()
    ahead_shut, turn_shut = floor.barred[0].ravel(), floor.barred[1].ravel()
    # doubly linked lists; the first of bucket b has -2 - b ahead of it, -1 is in no bucket
    after, ahead = np.empty(total, dtype=np.int64), np.full(total, -1, dtype=np.int64)
    heads = np.full(_BUCKETS + 1, -1, dtype=np.int64)
    width, met = _WIDTH * floor.step, 0
    for s in range(starts.shape[0]):
        node = starts[s]
        if costs[s] < best[node]:
            if ahead[node] == -1:
                _link(node, _BUCKETS, heads, after, ahead)
            best[node] = costs[s]
    while heads[_BUCKETS] >= 0:
        base = _deal(best, width, heads, after, ahead)
        for at in range(_BUCKETS):
            while met < targets.shape[0] and best[targets[met]] < base + at * width:
                met += 1
            if 0 < targets.shape[0] == met:
                return best, before
            while heads[at] >= 0:
                node = heads[at]
                _unlink(node, heads, after, ahead)
                row = node // cols
                t = row // rows
                i, j = row - t * rows, node - row * cols
                for move in range(4):
                    other, way = _beside(t, i, j, move, depths.shape, moves)
                    if other < 0 or shut[other]:
                        continue
                    first = other if move % 2 else node
                    if (ahead_shut if move < 2 else turn_shut)[first]:
                        continue
                    if move < 2:
                        price = motion = lengths[way] * floor.step
                    else:
                        price, motion = turns[way] * turn_price, turns[way] * arm
                    if near[other] > 0.0 and flat[other] >= flat[node]:
                        price += motion * near[other]
                    cost = best[node] + price
                    if cost < best[other]:
                        if ahead[other] != -1:
                            _unlink(other, heads, after, ahead)
                        best[other] = cost
                        before[other] = node
                        bucket = int(min((cost - base) / width, _BUCKETS))
                        _link(other, bucket, heads, after, ahead)
    return best, before


class Arrivals(NamedTuple):
    """Poses of the lattice from which some places are reached, one place after the other."""

    nodes: IntArray
    extra: FloatArray
    """What the rest of the way costs [m]."""
    ends: IntArray
    """(N,) where the poses of each place end."""


@kernel(allocates=True)
def least_costs(costs: FloatArray, arrivals: Arrivals) -> FloatArray:
    """(N,) cost of getting to each of some places [m], from what `search_poses` returns."""
    out = np.full(arrivals.ends.shape[0], np.inf)
    at = 0
    for n in range(arrivals.ends.shape[0]):
        while at < arrivals.ends[n]:
            out[n] = min(out[n], costs[arrivals.nodes[at]] + arrivals.extra[at])
            at += 1
    return out
