"""Compiled search of the cheapest paths over a `PoseGrid`.

What is static forbids poses; an object that the footprint overlaps costs as far as it is carried
along, until the overlap gets less again.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.planners.rearrangement.pose_grid_kernels import LENGTHS, MOVES, TURNS, PoseGrid
from pushplan.world.checks import FloatArray, IntArray

_BUCKETS = 1024  # buckets of poses of a search in one round
_WIDTH = 0.1  # costs that one bucket spans [cells]


class PoseSearchProblem(NamedTuple):
    """Input of `search_poses`."""

    starts: IntArray  # (S,) flat indices of poses
    costs: FloatArray  # (S,) what it costs to be there [m]
    grid: PoseGrid
    depths: FloatArray  # (16, rows, columns) depth in the objects, from `add_layers` [m]
    touch: FloatArray  # (16, rows, columns) weights of the objects, likewise
    turn_cost: float  # Cost of a turn [m/rad]
    arm: float  # Distance by which a turn carries an object along [m/rad]
    targets: IntArray  # Flat indices of poses after which to stop; none to go on to the end


@kernel(inline=True)
def _unlink(node: int, heads: IntArray, after: IntArray, ahead: IntArray) -> None:
    """Take a node out of its bucket."""
    if ahead[node] >= 0:
        after[ahead[node]] = after[node]
    else:
        heads[-2 - ahead[node]] = after[node]
    if after[node] >= 0:
        ahead[after[node]] = ahead[node]
    ahead[node] = -1


@kernel(inline=True)
def _link(node: int, bucket: int, heads: IntArray, after: IntArray, ahead: IntArray) -> None:
    """Put a node that is in no bucket into one."""
    after[node] = heads[bucket]
    ahead[node] = -2 - bucket
    if heads[bucket] >= 0:
        ahead[heads[bucket]] = node
    heads[bucket] = node


@kernel
def _deal(
    best: FloatArray, width: float, heads: IntArray, after: IntArray, ahead: IntArray
) -> float:
    """Put the poses that wait in the last bucket where they belong; returns the least cost."""
    base = np.inf
    node = heads[_BUCKETS]
    while node >= 0:
        base = min(base, best[node])
        node = after[node]
    node = heads[_BUCKETS]
    heads[_BUCKETS] = -1
    while node >= 0:
        following = after[node]
        _link(node, int(min((best[node] - base) / width, _BUCKETS)), heads, after, ahead)
        node = following
    return base


@kernel
def _beside(
    t: int,
    i: int,
    j: int,
    move: int,  # 0 ahead, 1 back, 2 to the next heading, 3 to the one before
    shape: tuple[int, int, int],
) -> tuple[int, int]:
    """The pose that a move leads to, -1 if none; and the heading that says how far it is."""
    count, rows, cols = shape
    if move < 2:
        sign = 1 - 2 * move
        i = i + sign * MOVES[t, 1]
        j = j + sign * MOVES[t, 0]
        if i < 0 or j < 0 or i >= rows or j >= cols:
            return -1, t
        return (t * rows + i) * cols + j, t
    to = t + 1 if move == 2 else t - 1
    to = to - count if to == count else (count - 1 if to < 0 else to)
    return (to * rows + i) * cols + j, t if move == 2 else to


@kernel(allocates=True)
def search_poses(problem: PoseSearchProblem) -> tuple[FloatArray, IntArray]:
    """Cost of each pose [m] and the pose before it, by buckets (Dial 1969, Meyer, Sanders 2003)."""
    # poses are expanded bucket by bucket of about equal costs, and again where they get cheaper;
    # what lies beyond the last bucket waits for another round
    grid = problem.grid
    depths = problem.depths
    targets = problem.targets
    total = depths.size
    (_, rows, cols) = depths.shape
    best = np.empty(total)
    before = np.empty(total, dtype=np.int64)
    best[:] = np.inf
    before[:] = -1
    flat = depths.ravel()
    shut = grid.blocked.ravel()
    near = problem.touch.ravel()
    ahead_shut = grid.blocked_moves[0].ravel()
    turn_shut = grid.blocked_moves[1].ravel()
    # doubly linked lists; the first of bucket b has -2 - b ahead of it, -1 is in no bucket
    after = np.empty(total, dtype=np.int64)
    ahead = np.empty(total, dtype=np.int64)
    heads = np.empty(_BUCKETS + 1, dtype=np.int64)
    ahead[:] = -1
    heads[:] = -1
    width = _WIDTH * grid.step
    met = 0
    for s in range(problem.starts.shape[0]):
        node = problem.starts[s]
        if problem.costs[s] < best[node]:
            if ahead[node] == -1:
                _link(node, _BUCKETS, heads, after, ahead)
            best[node] = problem.costs[s]
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
                i = row - t * rows
                j = node - row * cols
                for move in range(4):
                    other, heading = _beside(t, i, j, move, depths.shape)
                    if other < 0 or shut[other]:
                        continue
                    first = other if move % 2 else node
                    if (ahead_shut if move < 2 else turn_shut)[first]:
                        continue
                    if move < 2:
                        step = motion = LENGTHS[heading] * grid.step
                    else:
                        step = TURNS[heading] * problem.turn_cost
                        motion = TURNS[heading] * problem.arm
                    if near[other] > 0.0 and flat[other] >= flat[node]:
                        step += motion * near[other]
                    cost = best[node] + step
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
    extra: FloatArray  # Cost of the rest of the path [m]
    ends: IntArray  # (N,) where the poses of each place end


@kernel(allocates=True)
def least_costs(costs: FloatArray, arrivals: Arrivals) -> FloatArray:
    """(N,) cost of getting to each of some places [m], from what `search_poses` returns."""
    out = np.empty(arrivals.ends.shape[0])
    at = 0
    out[:] = np.inf
    for n in range(arrivals.ends.shape[0]):
        while at < arrivals.ends[n]:
            out[n] = min(out[n], costs[arrivals.nodes[at]] + arrivals.extra[at])
            at += 1
    return out
