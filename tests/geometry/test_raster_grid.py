from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from pushplan.geometry import Grid, clearance_field, fill_convex, occupancy
from pushplan.geometry.grid import nearest_marked
from pushplan.world import InvalidInputError, StaticMap


def random_convex(rng: np.random.Generator, centre: float, spread: float) -> np.ndarray:
    points = centre + spread * rng.standard_normal((rng.integers(3, 9), 2))
    hull = shapely.MultiPoint(points).convex_hull
    return np.ascontiguousarray(np.array(hull.exterior.coords)[:-1])


@given(st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=150)
def test_fill_sets_the_pixels_whose_centre_is_inside(seed: int, clockwise: bool) -> None:
    rng = np.random.default_rng(seed)
    v = random_convex(rng, rng.uniform(-10, 40), 10.0 ** rng.uniform(-1.0, 1.7))
    image = np.zeros((24, 31), dtype=np.uint8)
    fill_convex(image, v[::-1].copy() if clockwise else v, 7)
    shape = shapely.Polygon(v)
    cols, rows = np.meshgrid(np.arange(31) + 0.5, np.arange(24) + 0.5)
    inside = shapely.contains_xy(shape, cols, rows)
    edge = shapely.distance(shape.exterior, shapely.points(cols, rows)) < 1e-9
    np.testing.assert_array_equal((image == 7)[~edge], inside[~edge])


def test_fill_is_clipped_and_ignores_what_is_outside_or_broken() -> None:
    image = np.zeros((4, 4), dtype=np.uint8)
    for shift in ([9.0, 0.0], [-9.0, 0.0], [0.0, 9.0], [0.0, -9.0], [np.nan, np.nan], [1e300, 0.0]):
        fill_convex(image, np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0]]) + shift, 1)
    assert not image.any()
    fill_convex(image, np.array([[-1e9, -1e9], [1e9, -1e9], [1e9, 1e9], [-1e9, 1e9]]), 1)
    assert image.all()


def test_grid_geometry() -> None:
    grid = Grid.cover([1.0, -2.0, 4.0, -0.95], 0.1)
    assert grid.shape == (11, 30)
    assert grid.x[0] == pytest.approx(1.05)
    assert grid.y[-1] == pytest.approx(-2.0 + 10.5 * 0.1)
    assert grid.cell(1.25, -1.95) == (0, 2)
    assert grid == Grid(np.array([1.0, -2.0]), 0.1, (11, 30))


@pytest.mark.parametrize(
    ("bounds", "resolution"),
    [([0, 0, 1, 0], 0.1), ([0, 0, 1, 1], 0.0), ([0, 0, np.inf, 1], 0.1), ([0, 0, 1e6, 1e6], 0.01)],
)
def test_grid_refuses_nonsense(bounds: list[float], resolution: float) -> None:
    with pytest.raises(InvalidInputError):
        Grid.cover(bounds, resolution)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=40)
def test_clearance_equals_shapely(seed: int) -> None:
    rng = np.random.default_rng(seed)
    polygons = [random_convex(rng, 5.0, 2.0) for _ in range(rng.integers(0, 4))]
    lines, radii = rng.uniform(0, 10, (3, 4)), rng.uniform(0, 0.8, 3)
    lines[0, 2:] = lines[0, :2]  # a segment without length is a disc
    static = StaticMap.build(polygons, lines, radii, bounds=[0, 0, 10, 10])
    grid = Grid.cover(static.bounds, 0.5)
    field = clearance_field(static, grid)
    points = shapely.points(*np.meshgrid(grid.x, grid.y))
    expected = np.full(grid.shape, np.inf)
    for polygon in polygons:
        expected = np.minimum(expected, shapely.distance(shapely.Polygon(polygon), points))
    for line, radius in zip(lines, radii, strict=True):
        core = shapely.LineString(line.reshape(2, 2))
        expected = np.minimum(expected, shapely.distance(core, points) - radius)
    np.testing.assert_allclose(np.maximum(field, 0), np.maximum(expected, 0), atol=1e-9)
    for polygon in polygons:
        inside = shapely.contains(shapely.Polygon(polygon), points)
        assert (field[inside] < 0.0).all()
    assert np.array_equal(occupancy(static, grid, 0.3), field <= 0.3)


def test_empty_map_is_free_everywhere() -> None:
    static = StaticMap.build(bounds=[0, 0, 2, 1])
    grid = Grid.cover(static.bounds, 0.5)
    assert np.isinf(clearance_field(static, grid)).all()
    assert not occupancy(static, grid).any()


@pytest.mark.parametrize("seed", range(60))
def test_the_nearest_marked_cells_are_those_of_scipy(seed):
    rng = np.random.default_rng(seed)
    marked = rng.random(rng.integers(1, 40, 2)) < rng.choice([0.01, 0.1, 0.5, 0.9])
    marked.ravel()[rng.integers(marked.size)] = True
    away, (rows, cols) = ndimage.distance_transform_edt(~marked, return_indices=True)
    for found, wanted in zip(nearest_marked(marked), (away, rows, cols), strict=True):
        np.testing.assert_array_equal(found, wanted)


def test_no_cell_is_nearest_where_none_is_marked():
    _, rows, cols = nearest_marked(np.zeros((3, 4), dtype=bool))
    assert (rows == -1).all() and (cols == -1).all()
