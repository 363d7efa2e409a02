"""Or-3opt: two neighbouring segments change places, neither is reversed."""

from __future__ import annotations

import numpy as np

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray, IntArray


@kernel
def _rotate(values: IntArray, scratch: IntArray, low: int, middle: int, high: int) -> None:
    """``values[low:middle]`` and ``values[middle:high]`` change places."""
    first = middle - low
    for i in range(first):
        scratch[i] = values[low + i]
    second = high - middle
    for i in range(second):
        values[low + i] = values[middle + i]
    for i in range(first):
        values[low + second + i] = scratch[i]


@kernel(allocates=True)
def improve_by_swaps(
    costs: FloatArray,  # (N, N)
    near: IntArray,  # (m, k) clusters by distance
    order: IntArray,  # (m,) closed tour of clusters; changed
    nodes: IntArray,  # (m,) their nodes; changed
    symmetric: bool,  # True if a reversed segment costs the same
    tolerance: float,  # least gain that counts
) -> float:
    """Swap neighbouring segments, and reverse one where costs are symmetric; returns the gain."""
    # a move takes out the arcs after positions i, j and k and links a = order[i] to one of its
    # neighbours, which must be cheaper than the arc that is taken out
    count = len(order)
    reach = near.shape[1]
    place = np.empty(count, np.int64)
    scratch = np.empty(count, np.int64)
    for p in range(count):
        place[order[p]] = p
    total = 0.0
    tries = 0
    i = 0
    while tries < count:
        gain = _first_swap(costs, near, order, nodes, place, scratch, i, reach, tolerance)
        if gain == 0.0 and symmetric:
            gain = _first_reversal(costs, near, order, nodes, place, i, reach, tolerance)
        if gain > 0.0:
            total += gain
            tries = 0
        else:
            tries += 1
            i = i + 1 if i + 1 < count else 0
    return total


@kernel
def _first_swap(
    costs: FloatArray,
    near: IntArray,
    order: IntArray,
    nodes: IntArray,
    place: IntArray,
    scratch: IntArray,
    i: int,
    reach: int,
    tolerance: float,
) -> float:
    """Make the first swap after position i that pays; returns its gain, 0 if there is none."""
    count = len(order)
    i1 = i + 1 if i + 1 < count else 0
    a = nodes[i]
    a1 = nodes[i1]
    for first in range(reach):
        j1 = place[near[order[i], first]]
        if j1 == i1:
            continue
        gain1 = costs[a, a1] - costs[a, nodes[j1]]
        if gain1 <= tolerance:
            continue
        j = j1 - 1 if j1 > 0 else count - 1
        b = nodes[j]
        b1 = nodes[j1]
        gain1 += costs[b, b1]
        for second in range(reach):
            k1 = place[near[order[j], second]]
            # k lies from j1 on, before i comes round again
            k = k1 - 1 if k1 > 0 else count - 1
            ahead_k = k - j1 if k >= j1 else k - j1 + count
            ahead_i = i - j1 if i >= j1 else i - j1 + count
            if k1 == j1 or ahead_k > ahead_i:
                continue
            c = nodes[k]
            c1 = nodes[k1]
            if k == i:
                continue
            gain = gain1 + costs[c, c1] - costs[b, c1] - costs[c, a1]
            if gain > tolerance:
                _swap(order, nodes, place, scratch, i, j, k)
                return float(gain)
    return 0.0


@kernel
def _swap(
    order: IntArray, nodes: IntArray, place: IntArray, scratch: IntArray, i: int, j: int, k: int
) -> None:
    """Exchange the segments (i, j] and (j, k] of a closed tour."""
    count = len(order)
    # sort the three cuts: exchanging two of three segments of a circle is the same for all
    low = min(i, j, k)
    high = max(i, j, k)
    middle = i + j + k - low - high
    _rotate(order, scratch, low + 1, middle + 1, high + 1)
    _rotate(nodes, scratch, low + 1, middle + 1, high + 1)
    for p in range(low + 1, min(high + 1, count)):
        place[order[p]] = p


@kernel
def _first_reversal(
    costs: FloatArray,
    near: IntArray,
    order: IntArray,
    nodes: IntArray,
    place: IntArray,
    i: int,
    reach: int,
    tolerance: float,
) -> float:
    """2-opt (Croes 1958): new arcs from position i to j and from i + 1 to j + 1, or one before."""
    count = len(order)
    for side in range(2):
        i1 = i + 1 if i + 1 < count else 0
        i0 = i - 1 if i > 0 else count - 1
        other = i1 if side == 0 else i0
        a = nodes[i]
        a1 = nodes[other]
        for first in range(reach):
            j = place[near[order[i], first]]
            gain = costs[a, a1] - costs[a, nodes[j]]
            if gain <= tolerance or j == other:
                continue
            if side == 0:
                partner = j + 1 if j + 1 < count else 0
            else:
                partner = j - 1 if j > 0 else count - 1
            if partner == i:
                continue
            gain += costs[nodes[j], nodes[partner]] - costs[a1, nodes[partner]]
            if gain > tolerance:
                if side == 0:
                    low = min(i, j) + 1
                    high = max(i, j)
                else:
                    low = min(i, j)
                    high = max(i, j) - 1
                while low < high:
                    order[low], order[high] = order[high], order[low]
                    nodes[low], nodes[high] = nodes[high], nodes[low]
                    place[order[low]] = low
                    place[order[high]] = high
                    low = low + 1
                    high = high - 1
                if low == high:
                    place[order[low]] = low
                return float(gain)
    return 0.0
