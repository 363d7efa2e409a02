"""Shadows of convex polygons, and distances over the bends around them."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from test_shortest_path import random_map

from pushplan.core import geometry as core
from pushplan.geometry import VisibilityGraph, shadows
from pushplan.geometry.shadows import bend_distances
from pushplan.world import StaticMap

SHAPE = (40, 50)


def hidden_by_hand(eye: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which pixel centres a polygon hides, and which are too close to the edge to tell."""
    polygon = shapely.Polygon(corners)
    rows, cols = np.indices(SHAPE)
    centres = np.stack([cols + 0.5, rows + 0.5], axis=-1).reshape(-1, 2)
    sights = shapely.linestrings(np.stack([np.broadcast_to(eye, centres.shape), centres], axis=1))
    surely = shapely.intersects(sights, polygon.buffer(-1e-3))
    maybe = shapely.intersects(sights, polygon.buffer(1e-3))
    return surely.reshape(SHAPE), (surely != maybe).reshape(SHAPE)


def hull(rng: np.random.Generator) -> np.ndarray:
    points = rng.uniform([5, 5], [45, 35]) + rng.uniform(2, 10) * rng.standard_normal((7, 2))
    corners = np.array(shapely.MultiPoint(points).convex_hull.exterior.coords)[:-1]
    return corners if rng.random() < 0.5 else corners[::-1].copy()


@given(st.integers(0, 2**32 - 1), st.sampled_from(["free", "corner", "side"]))
@settings(max_examples=150)
@pytest.mark.slow
def test_a_shadow_is_what_cannot_be_seen(seed: int, where: str) -> None:
    rng = np.random.default_rng(seed)
    corners = hull(rng)
    eye = rng.uniform([-20, -20], [70, 60])
    if where == "corner":
        eye = corners[0].copy()
    elif where == "side":
        share = rng.uniform(0.05, 0.95)
        eye = corners[0] + share * (corners[1] - corners[0])
    mask = np.zeros(SHAPE, np.uint8)
    core.fill_shadows(mask, eye[0], eye[1], corners, np.array([0, len(corners)]), 1)
    inside = shapely.Polygon(corners).buffer(-1e-9).contains(shapely.Point(eye))
    if inside and where == "free":
        assert not mask.any()
        return
    hidden, unsure = hidden_by_hand(eye, corners)
    np.testing.assert_array_equal(mask[~unsure] > 0, hidden[~unsure])


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
