"""Which sighting belongs to which track."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from pushplan.world.checks import FloatArray, IntArray

_SIZE_SPREAD = 0.2  # relative difference of two sizes that counts as much as the whole gate


def assign(
    places: FloatArray,
    sizes: FloatArray,
    gates: FloatArray,
    seen_places: FloatArray,
    seen_sizes: FloatArray,
) -> tuple[IntArray, IntArray]:
    """Pair tracks with sightings: as many as the gates allow, at the least sum of costs.

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
    first, second = ks[alone], js[alone]
    ks, js = ks[~alone], js[~alone]
    away = np.hypot(*(places[ks] - seen_places[js]).T)
    ratio = np.log(seen_sizes[js] / sizes[ks]) / _SIZE_SPREAD
    costs = (away / gates[ks]) ** 2 + np.minimum(ratio**2, 1.0)
    # tracks and sightings that no chain of pairs within gates connects do not compete
    count = len(places) + len(seen_places)
    edges = csr_array((np.ones(len(ks)), (ks, len(places) + js)), shape=(count, count))
    _, labels = connected_components(edges, directed=False)
    for group in np.unique(labels[ks]).tolist():
        mine = labels[ks] == group
        tracks, k = np.unique(ks[mine], return_inverse=True)
        seen, j = np.unique(js[mine], return_inverse=True)
        table = np.full((len(tracks), len(seen)), 3.0 * (1 + min(len(tracks), len(seen))))
        table[k, j] = costs[mine]  # the others are dearer than all open pairs together
        chosen = linear_sum_assignment(table)
        kept = table[chosen] <= 2.0  # an open pair costs no more
        first = np.append(first, tracks[chosen[0][kept]])
        second = np.append(second, seen[chosen[1][kept]])
    return first, second
