"""Valid outlines are kept as they are: repair and smoothing never run on them."""

from __future__ import annotations

import json
import warnings

import numpy as np
import pytest
import shapely

from pushplan.scenarios import load_ice
from pushplan.world import Movables, RobotModel, StaticMap, load_world, save_world
from pushplan.world.outline_repair import OutlineWarning, outline_parts
from tests.conftest import make_u_maze


def star(rng: np.random.Generator) -> np.ndarray:
    """A valid outline (N, 2) [m] with its centroid at the origin, often nearly convex."""
    count = int(rng.integers(4, 60))
    angles = 2 * np.pi * (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / count
    radii = 1.0 - rng.choice([0.003, 0.02, 0.7]) * rng.uniform(0.0, 1.0, count)
    corners = radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    corners *= rng.uniform(0.05, 3.0)
    polygon = shapely.Polygon(corners)
    assert polygon.is_valid
    return corners - polygon.centroid.coords[0]


def check_random_worlds(folder, seeds):
    path = folder / "world.json"
    for seed in seeds:
        rng = np.random.default_rng(seed)
        shapes = [star(rng) for _ in range(3)]
        save_world(make_u_maze(), path)
        data = json.loads(path.read_text())
        apart = [shapes[2].tolist(), (shapes[2] @ [[0.5, 0], [0, 0.5]] + [9, 0]).tolist()]
        data["movables"] = [
            {"outline": shapes[0].tolist(), "pose": [4, 9, 0.3]},
            {"polygon": (shapes[1] + 7.0).tolist()},
            {"parts": apart, "pose": [5, 5, 0], "gyration_radius": 1.0},
        ]
        data["static"]["polygons"] = [(shapes[1] + 2.0).tolist()]
        path.write_text(json.dumps(data))
        world = load_world(path)
        whole = shapely.union_all([shapely.Polygon(part) for part in apart])
        given = [shapely.Polygon(shapes[0]), shapely.Polygon(shapes[1]), whole]
        np.testing.assert_allclose(world.movables.areas, [one.area for one in given], rtol=1e-9)
        walls = sum(shapely.Polygon(part).area for part in world.static.polygons)
        assert walls == pytest.approx(given[1].area, rel=1e-9)
        for k, shape in enumerate(given):
            corners = np.concatenate(world.movables.drawn_parts(k))
            centre = shape.centroid.coords[0] if k == 1 else 0.0
            wanted = shapely.get_coordinates(shape) - centre
            assert shapely.MultiPoint(wanted).hausdorff_distance(shapely.MultiPoint(corners)) < 1e-9


def test_random_worlds_keep_areas_and_corners(tmp_path):
    check_random_worlds(tmp_path, range(20))


@pytest.mark.slow
def test_300_random_worlds_keep_areas_and_corners(tmp_path):
    check_random_worlds(tmp_path, range(300))


HALF = np.array([[1.0, 0.0], [0.248, 0.429], [-0.5, 0.866], [-0.495, 0.0]])
DENTED = np.vstack([HALF, HALF[2:0:-1] * [1.0, -1.0]])


def test_dents_between_thousands_of_short_edges_are_kept():
    angles = np.arange(9000) * 2 * np.pi / 9000
    radii = 3.0 + 0.06 * np.cos(12 * angles)
    wavy = radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    (area,) = Movables.from_polygons([wavy], density=1.0).areas
    assert area == pytest.approx(shapely.Polygon(wavy).area, rel=1e-9)


def test_every_door_keeps_a_shallow_dent():
    area = shapely.Polygon(DENTED).area
    limits = {"mass": 1, "drive": "differential", "max_speed": 1, "max_turn_rate": 1}
    doors = [
        Movables.from_polygons([DENTED]).drawn_parts(0),
        Movables.from_polygons([shapely.Polygon(DENTED)]).drawn_parts(0),
        StaticMap.build([DENTED]).polygons,
        RobotModel.from_outline(DENTED, **limits).parts,
    ]
    for parts in doors:
        assert sum(shapely.Polygon(part).area for part in parts) == pytest.approx(area, rel=1e-12)


def test_outlines_from_images_are_smoothed_because_they_ask_for_it(tmp_path):
    angles = np.linspace(0, 2 * np.pi, 3_000, endpoint=False)
    floe = (
        np.column_stack([np.cos(angles), np.sin(angles)])
        * (1 + 2e-4 * np.cos(700 * angles))[:, None]
    )
    path = tmp_path / "ice.json"
    path.write_text(json.dumps([floe.tolist()]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OutlineWarning)
        (parts,) = load_ice(path).floes
    exact = outline_parts("floe", floe)
    assert exact.change < 1e-9 and not exact.repaired
    assert 10 * len(parts) < len(exact.parts)
