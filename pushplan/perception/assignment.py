"""Assignment of sightings to tracks."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from pushplan.world.checks import FloatArray, IntArray

_SIZE_SPREAD = 0.2  # standard deviation of the relative difference of two sizes


def assign(
    places: FloatArray,
    sizes: FloatArray,
    gates: FloatArray,
    seen_places: FloatArray,
    seen_sizes: FloatArray,
) -> tuple[IntArray, IntArray]:
    """Pair tracks with sightings: as many as the gates allow, most likely.

    Args:
        places: (K, 2) where the objects are expected [m].
        sizes: (K,) square roots of their areas [m].
        gates: (K,) greatest distance to a sighting [m].
        seen_places: (M, 2) of the sightings [m].
        seen_sizes: (M,) square roots of their areas [m].

    Returns:
        (P,) indices of tracks and (P,) of sightings.
    """
    near = cKDTree(seen_places).query_ball_point(places, gates)
    ks = np.repeat(np.arange(len(places)), [len(some) for some in near])
    js = np.concatenate([np.array(some, dtype=np.int64) for some in near])
    alone = (np.bincount(ks, minlength=len(places))[ks] == 1) & (np.bincount(js)[js] == 1)
    first = ks[alone]
    second = js[alone]
    ks = ks[~alone]
    js = js[~alone]
    away = np.hypot(*(places[ks] - seen_places[js]).T)
    ratio = np.log(seen_sizes[js] / sizes[ks]) / _SIZE_SPREAD
    # of a normal distribution with a third of the gate: a wide gate must not win by its width
    unlikely = 4.5 * (away / gates[ks]) ** 2 + 2.0 * np.log(gates[ks] / gates.min())
    costs = unlikely + np.minimum(0.5 * ratio**2, 2.0)
    # tracks and sightings that no chain of pairs within gates connects do not compete
    count = len(places) + len(seen_places)
    edges = csr_array((np.ones(len(ks)), (ks, len(places) + js)), shape=(count, count))
    _, labels = connected_components(edges, directed=False)
    for group in np.unique(labels[ks]).tolist():
        mine = labels[ks] == group
        tracks, k = np.unique(ks[mine], return_inverse=True)
        seen, j = np.unique(js[mine], return_inverse=True)
        top = costs[mine].max()
        table = np.full((len(tracks), len(seen)), (top + 1.0) * (1 + min(len(tracks), len(seen))))
        table[k, j] = costs[mine]  # the others are dearer than all open pairs together
        chosen = linear_sum_assignment(table)
        kept = table[chosen] <= top
        first = np.append(first, tracks[chosen[0][kept]])
        second = np.append(second, seen[chosen[1][kept]])
    return first, second
