"""Compiled parts of the proof: relaxed walks, and paths that only they allow.

Everything is numbered without the root: cluster d, node i of it; arrays are padded to K nodes. A
memory M is a bit mask over the clusters that ``lists[d]`` names.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray, IntArray


@kernel
def extend_walks(
    walks: FloatArray,  # (n, 2^b, K) cost of the cheapest walk of k arcs from a node to the root
    longer: FloatArray,  # (n, 2^b, K) filled with that of k + 1 arcs
    blocks: FloatArray,  # (n, K, n, K) ``blocks[e, j, d, i]``: cost from node i of d to node j of e
    moves: IntArray,  # (n, n, 2^b)
    prices: FloatArray,  # (n,) what a visit of each cluster earns
    sizes: IntArray,  # (n,) nodes of each cluster
    low: int,
    high: int,
) -> None:
    """Put a node of clusters ``low`` to ``high - 1`` in front of every walk to the root."""
    count, memories, width = walks.shape
    for d in range(low, high):
        longer[d] = np.inf
        for e in range(count):
            for memory in range(memories):
                new = moves[d, e, memory]
                if new < 0:
                    continue
                out = longer[d, new]
                for j in range(sizes[e]):
                    value = walks[e, memory, j] - prices[e]
                    if value < np.inf:
                        row = blocks[e, j, d]
                        for i in range(width):
                            out[i] = min(out[i], value + row[i])


@kernel
def read_visits(
    walks: FloatArray,  # (n, n, 2^b, K) by number of arcs less 1
    first: FloatArray,  # (n, K) cost from the root to each node
    blocks: FloatArray,  # (n, K, n, K)
    moves: IntArray,  # (n, n, 2^b)
    prices: FloatArray,  # (n,)
    sizes: IntArray,  # (n,)
    visits: IntArray,  # (n,) filled with how often it comes to each cluster
) -> float:
    """Cost less prices of the cheapest walk from the root through n nodes and back; its visits."""
    count = walks.shape[1]
    memories = walks.shape[2]
    visits[:] = 0
    best = np.inf
    d = -1
    at = 0
    i = 0
    next_d = 0
    next_at = 0
    next_i = 0
    for e in range(count):
        for memory in range(memories):
            for j in range(sizes[e]):
                x = walks[count - 1, e, memory, j] - prices[e] + first[e, j]
                if x < best:
                    best = x
                    d = e
                    at = memory
                    i = j
    if d < 0:
        return best
    visits[d] = 1
    for k in range(count - 1, 0, -1):
        value = walks[k, d, at, i]
        found = False
        for e in range(count):
            for memory in range(memories):
                if found or moves[d, e, memory] != at:
                    continue
                for j in range(sizes[e]):
                    if not found and (
                        walks[k - 1, e, memory, j] - prices[e] + blocks[e, j, d, i] == value
                    ):
                        found = True
                        next_d = e
                        next_at = memory
                        next_i = j
            if found:
                break
        if not found:
            break
        d = next_d
        at = next_at
        i = next_i
        visits[d] += 1
    return best


class WalkProblem(NamedTuple):
    """Input of the bounds on paths of one length."""

    within: FloatArray  # (n, 2^b, K) walks to the root from the new node, by `Walks.allow_memories`
    costs: FloatArray  # (n, K, n, K) from a node (first two) to a node
    lists: IntArray  # (n, b) the clusters that each cluster remembers
    prices: FloatArray  # (n,) what a visit of each cluster earns
    sizes: IntArray  # (n,) nodes of each cluster
    limit: float  # Paths that cannot stay below this are dropped


class Paths(NamedTuple):
    """Paths of one length."""

    sets: IntArray  # (P,) clusters of each path as a bit mask
    ends: IntArray  # (P,) its last node, ``d * K + i``
    values: FloatArray  # (P,) its cost
    rests: FloatArray  # (P,) sum of the prices of the clusters that it lacks
    parents: IntArray  # (P,) the path that it comes from


@kernel
def extend_paths(
    problem: WalkProblem,
    paths: Paths,
    low: int,
    high: int,
    slots: IntArray,  # hash table, a power of two in size, -1 where empty
    longer: Paths,  # filled, one for a set and an end
    found: int,  # number of them
) -> int:
    """One more node for the paths ``low`` to ``high - 1``; how many there are then, -1 if many."""
    within, costs, lists, prices, sizes, limit = problem
    sets, ends, values, rests, _ = paths
    new_sets, new_ends, new_values, new_rests, parents = longer
    count, memories, width = within.shape
    mask = len(slots) - 1
    for p in range(low, high):
        c = ends[p] // width
        v = ends[p] % width
        for d in range(count):
            if (sets[p] >> d) & 1:
                continue
            free = memories - 1
            for j in range(lists.shape[1]):
                if (sets[p] >> lists[d, j]) & 1:
                    free &= ~(1 << j)
            row = costs[c, v, d]
            hope = within[d, free]
            rest = rests[p] - prices[d]
            joined = sets[p] | (1 << d)
            for i in range(sizes[d]):
                value = values[p] + row[i]
                if not value + hope[i] + rest < limit:
                    continue
                key = joined * 1000003 + d * width + i
                key ^= key >> 29
                key *= 668265263
                slot = (key ^ (key >> 17)) & mask
                while slots[slot] >= 0 and not (
                    new_sets[slots[slot]] == joined and new_ends[slots[slot]] == d * width + i
                ):
                    slot = (slot + 1) & mask
                at = slots[slot]
                if at < 0:
                    if found >= len(new_sets):
                        return -1
                    at = found
                    found += 1
                    slots[slot] = at
                    new_sets[at] = joined
                    new_ends[at] = d * width + i
                    new_values[at] = value
                    new_rests[at] = rest
                    parents[at] = p
                elif value < new_values[at]:
                    new_values[at] = value
                    parents[at] = p
    return found
