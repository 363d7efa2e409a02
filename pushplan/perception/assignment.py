"""Which sighting belongs to which track."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment

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
    away = np.linalg.norm(places[:, None] - seen_places[None], axis=2)  # (K, M)
    open_ = away <= gates[:, None]
    rows, columns = open_.sum(axis=1), open_.sum(axis=0)
    alone = open_ & (rows[:, None] == 1) & (columns == 1)
    first, second = np.nonzero(alone)
    hard = np.flatnonzero((rows > 0) & ~alone.any(axis=1))
    if len(hard):
        other = np.flatnonzero((columns > 0) & ~alone.any(axis=0))
        pairs = np.ix_(hard, other)
        ratio = np.log(seen_sizes[other] / sizes[hard, None]) / _SIZE_SPREAD
        cost = (away[pairs] / gates[hard, None]) ** 2 + np.minimum(ratio**2, 1.0)
        closed = 3.0 * (1 + min(cost.shape))  # dearer than all open pairs together
        chosen = linear_sum_assignment(np.where(open_[pairs], cost, closed))
        kept = open_[pairs][chosen]
        first = np.append(first, hard[chosen[0][kept]])
        second = np.append(second, other[chosen[1][kept]])
    return first, second
