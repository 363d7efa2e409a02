"""Distances to the open edges of a clearance area."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from test_shortest_path import ReferenceGraph, free_space, random_map

from pushplan.geometry import VisibilityGraph, geodesic_field, goal_distances
from pushplan.world import ClearanceArea, Receptacle, StaticMap

HEXAGON = np.array([[3.0, 1.5], [7, 1.5], [9, 5], [7, 8.5], [3, 8.5], [1, 5]])


def by_hand(area: ClearanceArea, static: StaticMap, starts: np.ndarray) -> np.ndarray:
    """Least distance over the open edges, each a target of the plain visibility graph."""
    reference = ReferenceGraph(static, 0.0)
    best = np.full(len(starts), np.inf)
    ends = np.roll(area.polygon, -1, axis=0)
    for a, b, is_open in zip(area.polygon, ends, area.open_edges, strict=True):
        if is_open:
            edge = shapely.LineString([a, b]).buffer(1e-6)
            best = np.minimum(best, reference.distances(edge, starts))
    best[~shapely.contains_xy(shapely.Polygon(area.polygon), *starts.T)] = 0.0
    return best


@pytest.mark.parametrize("seed", range(2))
def test_lengths_equal_the_plain_visibility_graph(seed: int) -> None:
    rng = np.random.default_rng(seed)
    static = random_map(rng)
    area = ClearanceArea(HEXAGON, rng.random(6) < 0.5)
    free = free_space(static, 0.0).buffer(-0.01)
    starts = rng.uniform(0, 10, (30, 2))
    starts = starts[shapely.contains_xy(free, *starts.T)][:15]
    expected = by_hand(area, static, starts)
    graph = VisibilityGraph(static)
    paths = [graph.to_goal(start, area) for start in starts]
    lengths = np.array([path.length for path in paths])
    np.testing.assert_array_equal(np.isinf(lengths), np.isinf(expected))
    reached = np.isfinite(expected)
    np.testing.assert_allclose(lengths[reached], expected[reached], rtol=1e-3, atol=1e-3)
    for path in (p for p in paths if 0.0 < p.length < math.inf):
        edges = np.stack([HEXAGON, np.roll(HEXAGON, -1, axis=0)], axis=1)[area.open_edges]
        assert shapely.MultiLineString(list(edges)).distance(shapely.Point(path.points[-1])) < 1e-3
        steps = np.diff(path.points, axis=0)
        assert np.hypot(*steps.T).sum() == pytest.approx(path.length, abs=1e-5)


@cache
def open_floor() -> StaticMap:
    return StaticMap.build(bounds=[0, 0, 10, 10])


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=60)
def test_without_obstacles_it_is_the_straight_distance(seed: int) -> None:
    rng = np.random.default_rng(seed)
    area = ClearanceArea(HEXAGON, rng.random(6) < 0.5)
    point = rng.uniform(0, 10, 2)
    edges = np.stack([HEXAGON, np.roll(HEXAGON, -1, axis=0)], axis=1)[area.open_edges]
    expected = shapely.MultiLineString(list(edges)).distance(shapely.Point(point))
    if not len(edges):
        expected = math.inf
    if not shapely.Polygon(HEXAGON).contains(shapely.Point(point)):
        expected = 0.0
    path = VisibilityGraph(open_floor()).to_goal(point, area)
    assert path.length == pytest.approx(expected, abs=1e-9)


def test_closed_edges_and_walls_leave_no_way() -> None:
    shut = ClearanceArea(HEXAGON, np.zeros(6, dtype=bool))
    graph = VisibilityGraph(open_floor())
    assert math.isinf(graph.to_goal((5.0, 5.0), shut).length)
    assert graph.to_goal((0.5, 0.5), shut).length == 0.0
    ring = [[2, 3, 8, 3], [8, 3, 8, 7], [8, 7, 2, 7], [2, 7, 2, 3]]
    walled = StaticMap.build([], ring, 0.1, bounds=[0, 0, 10, 10])
    area = ClearanceArea(HEXAGON, np.ones(6, dtype=bool))
    assert math.isinf(VisibilityGraph(walled).to_goal((5.0, 5.0), area).length)
    assert math.isfinite(VisibilityGraph(walled).to_goal((5.0, 2.0), area).length)


def test_the_field_agrees_with_the_paths() -> None:
    rng = np.random.default_rng(3)
    static = StaticMap.build([[[4, 2], [5, 2], [5, 6], [4, 6]]], bounds=[0, 0, 10, 10])
    area = ClearanceArea(HEXAGON, np.array([True, False, False, True, False, False]))
    field = geodesic_field(static, area, resolution=0.1)
    distances = goal_distances(static, area)
    for i, j in rng.integers(0, 100, (200, 2)):
        value = field.values[i, j]
        point = np.array([field.grid.x[j], field.grid.y[i]])
        inside = shapely.Polygon(HEXAGON).contains(shapely.Point(point))
        if not inside:
            assert value == 0.0
        assert value == pytest.approx(distances.path_from(point).length, rel=1e-6)


def test_a_receptacle_counts_by_its_nearest_point() -> None:
    wall = StaticMap.build([[[4, 0], [5, 0], [5, 6], [4, 6]]], bounds=[0, 0, 10, 10])
    corner = Receptacle(np.array([[8.0, 0], [10, 0], [10, 2], [8, 2]]))
    graph = VisibilityGraph(wall)
    by_hand = math.hypot(3, 5) + 1.0 + math.hypot(3, 4)
    assert graph.to_goal((1.0, 1.0), corner).length == pytest.approx(by_hand, rel=1e-5)
    assert graph.to_goal((9.0, 1.0), corner).length == 0.0
