"""Searches that are driven from Python; `core/tests/search_test.cpp` has the others."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from pushplan.core import search as core
from pushplan.search.grid_dijkstra import grid_dijkstra


def test_a_search_can_be_driven_from_outside() -> None:
    tree = core.SearchTree(5)
    tree.offer(3, 1.0, 0.0, -1, -1)
    tree.offer(4, 0.5, 0.0, 3, 9)
    assert [tree.take() for _ in range(3)] == [4, 3, -1]
    assert tree.path(4).tolist() == [[3, -1], [4, 9]]


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), rows=st.integers(1, 12), columns=st.integers(1, 12))
def test_costs_on_a_grid_are_those_of_scipy(seed: int, rows: int, columns: int) -> None:
    rng = np.random.default_rng(seed)
    weights = rng.uniform(1.0, 3.0, (rows, columns))
    weights[rng.random(weights.shape) < 0.2] = np.inf
    start = int(rng.integers(weights.size))
    tails, heads, lengths = [], [], []
    for tail in np.ndindex(weights.shape):
        for head in np.ndindex(weights.shape):
            step = np.subtract(head, tail)
            if np.abs(step).max() == 1 and np.isfinite(weights[head]):
                tails.append(np.ravel_multi_index(tail, weights.shape))
                heads.append(np.ravel_multi_index(head, weights.shape))
                lengths.append(0.5 * np.hypot(*step) * weights[head])
    graph = csr_matrix((lengths, (tails, heads)), shape=(weights.size, weights.size))
    expected = dijkstra(graph, indices=start)
    goals = np.zeros(weights.shape, dtype=bool)
    costs, parents, order = grid_dijkstra(weights, np.array([start]), goals, 0.5)
    assert costs.ravel() == pytest.approx(expected)
    assert (np.diff(costs.ravel()[order]) >= 0.0).all()
    assert sorted(order) == np.flatnonzero(np.isfinite(expected)).tolist()
    for cell in order[1:]:
        assert costs.ravel()[parents[cell]] < costs.ravel()[cell]
    goals.ravel()[order[-1]] = True
    assert grid_dijkstra(weights, np.array([start]), goals, 0.5)[2][-1] == order[-1]
