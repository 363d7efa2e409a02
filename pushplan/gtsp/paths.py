"""Dynamic programming over the few paths that walks leave below the best tour."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pushplan.gtsp.walk_kernels import PathProblem, Paths, extend_paths
from pushplan.gtsp.walks import CHUNK_ARCS, Walks
from pushplan.world.checks import FloatArray, IntArray


def cheaper_tour(
    walks: Walks,  # filled; changed by `Walks.allow_memories`
    most: int,  # paths of one length at most
) -> tuple[bool, IntArray | None, int]:
    """The cheapest tour below the limit of the walks, by paths of more and more clusters.

    A path is known by its clusters and its last node. The walks bound what completes it.

    Returns:
        Whether the paths were few enough; the nodes of the tour, None if there is none; how many
        paths there were.
    """
    walks.allow_memories()
    paths, total = _first_paths(walks), 0
    trail = [(paths.ends, paths.parents)]
    slots = np.empty(1 << int(np.ceil(np.log2(2 * most))), dtype=np.int64)
    for k in range(walks.count - 2, -1, -1):
        slots[:] = -1
        longer = _longer(walks, paths, walks.walks[k], slots, most)
        if longer is None:
            return False, None, total
        paths = longer
        total += len(paths.ends)
        trail.append((paths.ends, paths.parents))
    costs = paths.values + walks.last.ravel()[paths.ends]
    if not len(costs) or not costs.min() < walks.limit:
        return True, None, total
    at, chosen = int(costs.argmin()), []
    for ends, parents in reversed(trail):
        chosen.append(walks.names.ravel()[ends[at]])
        at = int(parents[at])
    return True, np.array([walks.node, *chosen[::-1]], dtype=np.int64), total


def _room_for(size: int) -> Paths:
    """Memory for so many paths."""
    whole = np.empty((3, size), dtype=np.int64)
    real = np.empty((2, size))
    return Paths(whole[0], whole[1], real[0], real[1], whole[2])


def _only(paths: Paths, which: slice | NDArray[np.bool_]) -> Paths:
    """A copy of some of them."""
    sets, ends, values, rests, parents = paths
    return Paths(
        sets[which].copy(),
        ends[which].copy(),
        values[which].copy(),
        rests[which].copy(),
        parents[which].copy(),
    )


def _first_paths(walks: Walks) -> Paths:
    """From the root to one node."""
    ends = np.flatnonzero(walks.names.ravel() >= 0)
    cluster = ends // walks.width
    paths = _room_for(len(ends))
    paths.ends[:], paths.parents[:] = ends, 0
    paths.sets[:] = np.int64(1) << cluster
    paths.values[:] = walks.first.ravel()[ends]
    paths.rests[:] = walks.prices.sum() - walks.prices[cluster]
    hope = walks.walks[-1, :, -1].ravel()[ends]
    return _only(paths, paths.values + hope + paths.rests < walks.limit)


def _longer(
    walks: Walks, paths: Paths, within: FloatArray, slots: IntArray, most: int
) -> Paths | None:
    """All of them with one node more; None if they are too many."""
    problem = PathProblem(within, walks.costs, walks.known, walks.prices, walks.sizes, walks.limit)
    new, found = _room_for(most), 0
    step = max(1, CHUNK_ARCS // (4 * walks.count * walks.width))
    for low in range(0, len(paths.ends), step):
        high = min(low + step, len(paths.ends))
        found = extend_paths(problem, paths, low, high, slots, new, found)
        walks.look()
        if found < 0:
            return None
    return _only(new, slice(found))
