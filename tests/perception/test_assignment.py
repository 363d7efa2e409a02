"""Assignment in groups against one assignment of everything."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from pushplan.perception.object_tracker import assign


@given(st.integers(0, 10**6), st.integers(1, 25), st.integers(1, 25), st.floats(0.02, 0.6))
def test_as_many_pairs_at_the_same_cost_as_one_assignment_of_all(
    seed: int, count: int, seen: int, gate: float
) -> None:
    rng = np.random.default_rng(seed)
    places, seen_places = rng.random((count, 2)), rng.random((seen, 2))
    sizes, seen_sizes = rng.uniform(0.1, 0.2, count), rng.uniform(0.1, 0.2, seen)
    first, second = assign(places, sizes, np.full(count, gate), seen_places, seen_sizes)
    away = np.linalg.norm(places[:, None] - seen_places, axis=2)
    ratio = np.log(seen_sizes / sizes[:, None]) / 0.2
    cost = np.where(away <= gate, 4.5 * (away / gate) ** 2 + np.minimum(0.5 * ratio**2, 2.0), 1e3)
    rows, columns = linear_sum_assignment(cost)
    open_ = cost[rows, columns] < 1e3
    assert len(set(first.tolist())) == len(first) == open_.sum()
    assert len(set(second.tolist())) == len(second)
    assert np.isclose(cost[first, second].sum(), cost[rows, columns][open_].sum())
