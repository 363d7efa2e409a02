"""Shadows of convex polygons, and distances over the bends around them."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from test_shortest_path import random_map

from pushplan.geometry import VisibilityGraph, shadows
from pushplan.geometry.shadows import bend_distances
from pushplan.world import StaticMap


@pytest.mark.parametrize("seed", range(12))
def test_ways_over_the_bends_in_sight_are_the_shortest(seed: int) -> None:
    rng = np.random.default_rng(seed)
    static = random_map(rng)
    distances = bend_distances(static, 0.25)
    walls = shapely.union_all([shapely.Polygon(part) for part in static.convex_parts])
    graph = VisibilityGraph(static)
    for eye in rng.uniform(0.1, 9.9, (4, 2)):
        if walls.distance(shapely.Point(eye)) < 0.02:
            continue
        bends, lengths = distances.in_sight(*eye)
        for i, j in rng.integers(0, 40, (40, 2)):
            cell = np.array([distances.grid.x[j], distances.grid.y[i]])
            room = walls.distance(shapely.Point(cell))
            sight = walls.intersects(shapely.LineString([eye, cell]))
            if room < 0.02 or not sight:
                continue
            over = (lengths + distances.table[i, j, bends]).min(initial=np.inf)
            expected = graph.shortest_path(eye, cell).length
            assert over == pytest.approx(expected, rel=1e-4, abs=1e-4)


def test_large_maps_get_coarser_cells(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shadows, "MAX_VALUES", 10_000)
    columns = [np.array([[x, 4], [x + 1, 4], [x + 1, 5], [x, 5]]) for x in (1, 4, 7)]
    static = StaticMap.build(columns, bounds=[0, 0, 11, 10])
    distances = bend_distances(static, 0.01)
    assert distances.table.size <= 10_500
    assert distances.table.shape[2] == 12


def test_a_map_without_obstacles_has_no_bends() -> None:
    distances = bend_distances(StaticMap.build(bounds=[0, 0, 3, 2]), 0.5)
    assert distances.table.shape == (4, 6, 0)
    assert len(distances.in_sight(1.0, 1.0)[0]) == 0
