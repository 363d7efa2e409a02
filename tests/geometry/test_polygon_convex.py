from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from pushplan.geometry import (
    convex_distance,
    convex_overlap,
    convex_penetration,
    polygon_area,
    polygon_centroid,
    polygon_inertia,
    transform_points,
)
from pushplan.world.outline import transform

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


@st.composite
def convex_polygons(draw: st.DrawFn, reach: float = 3.0) -> np.ndarray:
    """Corners on a random ellipse, rotated and shifted: always convex, slivers included."""
    n = draw(st.integers(3, 12))
    seed = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, n))
    assume(np.diff(angles, append=angles[0] + 2.0 * np.pi).min() > 1e-3)
    axes = 10.0 ** rng.uniform(-2.0, 0.3, 2)
    pose = np.array([*rng.uniform(-reach, reach, 2), rng.uniform(-np.pi, np.pi)])
    points = np.stack([axes[0] * np.cos(angles), axes[1] * np.sin(angles)], axis=1)
    return np.ascontiguousarray(transform(pose, points))


@given(convex_polygons())
@settings(max_examples=200)
def test_area_and_centroid_equal_shapely(v: np.ndarray) -> None:
    shape = shapely.Polygon(v)
    assert polygon_area(v) == pytest.approx(shape.area, rel=1e-9, abs=1e-12)
    assert polygon_area(v[::-1].copy()) == pytest.approx(-shape.area, rel=1e-9, abs=1e-12)
    if shape.area > 1e-6:
        centre = shape.centroid
        assert polygon_centroid(v) == pytest.approx((centre.x, centre.y), abs=1e-6)


def test_inertia_of_known_shapes() -> None:
    assert polygon_inertia(SQUARE) == pytest.approx(1.0 / 6.0)
    assert polygon_inertia(SQUARE[::-1].copy() + 1e3) == pytest.approx(1.0 / 6.0)
    angles = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    disc = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    assert polygon_inertia(disc) == pytest.approx(0.5, rel=1e-3)
    assert polygon_inertia(np.zeros((3, 2))) == 0.0


@given(convex_polygons())
@settings(max_examples=20)
def test_inertia_equals_sum_over_triangles(v: np.ndarray) -> None:
    cx, cy = polygon_centroid(v)
    assume(polygon_area(v) > 1e-4)
    total = 0.0
    for a, b in zip(v - [cx, cy], np.roll(v, -1, axis=0) - [cx, cy], strict=True):
        area = 0.5 * (a[0] * b[1] - a[1] * b[0])
        middles = [a / 2, b / 2, (a + b) / 2]  # exact for quadratics
        total += area * sum(m @ m for m in middles) / 3.0
    assert polygon_inertia(v) == pytest.approx(total / polygon_area(v), rel=1e-6)


def test_transform_points_may_work_in_place() -> None:
    pose, points = np.array([1.0, -2.0, 0.7]), SQUARE.copy()
    expected = transform(pose, points)
    transform_points(pose, points, points)
    np.testing.assert_allclose(points, expected, atol=1e-15)


@given(convex_polygons(reach=1.0), convex_polygons(reach=1.0))
@settings(max_examples=150)
def test_overlap_distance_and_penetration_equal_shapely(a: np.ndarray, b: np.ndarray) -> None:
    pa, pb = shapely.Polygon(a), shapely.Polygon(b)
    depth, nx, ny = convex_penetration(a, b)
    assert math.hypot(nx, ny) == pytest.approx(1.0)
    assert convex_distance(a, b) == pytest.approx(pa.distance(pb), abs=1e-9)
    if abs(depth) > 1e-9:  # shapely counts touching as intersecting
        assert convex_overlap(a, b) == (depth > 0.0) == pa.intersects(pb)
    assert -depth <= pa.distance(pb) + 1e-9


@given(convex_polygons(reach=0.2), convex_polygons(reach=0.2))
@settings(max_examples=100, suppress_health_check=[HealthCheck.filter_too_much])
def test_moving_by_the_penetration_separates_and_less_does_not(
    a: np.ndarray, b: np.ndarray
) -> None:
    depth, nx, ny = convex_penetration(a, b)
    assume(depth > 1e-6)
    n = np.array([nx, ny])
    assert not convex_overlap(a, b + (depth + 1e-9) * n)
    rng = np.random.default_rng(0)
    for angle in rng.uniform(0.0, 2.0 * np.pi, 16):  # no shorter way out in any direction
        u = np.array([math.cos(angle), math.sin(angle)])
        assert convex_overlap(a, b + 0.999 * depth * u)
    assert convex_overlap(a, b + 0.999 * depth * n)


def test_touching_squares_do_not_overlap() -> None:
    beside = SQUARE + np.array([1.0, 0.0])
    assert not convex_overlap(SQUARE, beside)
    assert convex_distance(SQUARE, beside) == 0.0
    assert convex_penetration(SQUARE, beside)[0] == 0.0
    assert convex_penetration(SQUARE, SQUARE + np.array([0.75, 0.1])) == pytest.approx(
        (0.25, 1.0, 0.0)
    )
