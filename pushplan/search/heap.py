"""A binary heap of nodes that knows where each node is, so that keys can be lowered. Compiled.

Equal keys are taken in the order of the nodes' numbers: the same search on every machine.
"""

from __future__ import annotations

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray, IntArray


@kernel(inline=True)
def _before(key_a: float, node_a: int, key_b: float, node_b: int) -> bool:
    """Return True if the first key comes first; equal keys go by the number of the node."""
    return key_a < key_b or (key_a == key_b and node_a < node_b)


@kernel
def push_or_lift(
    keys: FloatArray, heap: IntArray, places: IntArray, size: IntArray, node: int, key: float
) -> None:
    """Put a node into the heap, or change its key if it is there."""
    at = places[node]
    if at < 0:
        at = size[0]
        size[0] += 1
    elif key > keys[at]:
        _sink(keys, heap, places, size[0], at, node, key)
        return
    while at > 0:
        above = (at - 1) >> 1
        if not _before(key, node, keys[above], heap[above]):
            break
        keys[at] = keys[above]
        heap[at] = heap[above]
        places[heap[at]] = at
        at = above
    keys[at] = key
    heap[at] = node
    places[node] = at


@kernel
def _sink(
    keys: FloatArray, heap: IntArray, places: IntArray, size: int, at: int, node: int, key: float
) -> None:
    """Put a node at its place at or below ``at``."""
    while True:
        below = 2 * at + 1
        if below >= size:
            break
        right = below + 1
        if right < size and _before(keys[right], heap[right], keys[below], heap[below]):
            below = right
        if not _before(keys[below], heap[below], key, node):
            break
        keys[at] = keys[below]
        heap[at] = heap[below]
        places[heap[at]] = at
        at = below
    keys[at] = key
    heap[at] = node
    places[node] = at


@kernel
def pop_least(keys: FloatArray, heap: IntArray, places: IntArray, size: IntArray) -> int:
    """Take out the node of the least key; the heap must not be empty. Arguments as above."""
    least: int = heap[0]
    places[least] = -1
    size[0] -= 1
    last = size[0]
    if last > 0:
        _sink(keys, heap, places, last, 0, heap[last], keys[last])
    return least
