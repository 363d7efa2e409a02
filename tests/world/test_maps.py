"""Maps from occupancy grids and from Nav2's files: exactly the occupied cells, and clear errors."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image

from pushplan.files.safe_files import UnusedInputWarning
from pushplan.world import (
    InvalidInputError,
    SchemaError,
    StaticMap,
    load_nav2_map,
    load_world,
    occupancy_grid,
)
from pushplan.world.occupancy_grid import rectangle_cover
from pushplan.world.stored.nav2_map import read_nav2_grid

SHAPES = st.tuples(st.integers(1, 12), st.integers(1, 12))
CORNER = {"image": "map.pgm", "resolution": 0.5, "origin": [1.0, -2.0, 0.0]}
META = {**CORNER, "negate": 0, "occupied_thresh": 0.65, "free_thresh": 0.196}


def cells_of(grid, side, origin):
    """The occupied cells as one Shapely geometry."""
    x, y, theta = origin
    c, s = np.cos(theta), np.sin(theta)
    squares = []
    for row, column in np.argwhere(grid):
        u = side * (column + np.array([0, 1, 1, 0]))
        v = side * (row + np.array([0, 0, 1, 1]))
        squares.append(shapely.Polygon(np.column_stack([x + c * u - s * v, y + s * u + c * v])))
    return shapely.union_all(squares)


@settings(max_examples=60)
@given(arrays(np.bool_, SHAPES))
def test_rectangles_cover_the_occupied_cells_and_no_other(grid):
    covered = np.zeros_like(grid)
    for r0, c0, r1, c1 in rectangle_cover(grid):
        assert r0 < r1 and c0 < c1
        assert grid[r0:r1, c0:c1].all()
        assert not covered[r0:r1, c0:c1].all()  # each one adds something
        covered[r0:r1, c0:c1] = True
    assert (covered == grid).all()


@settings(max_examples=60)
@given(
    arrays(np.bool_, SHAPES),
    st.floats(0.01, 5.0),
    st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-4, 4)),
)
def test_the_union_of_the_polygons_is_the_union_of_the_cells(grid, side, origin):
    static = StaticMap.from_occupancy(grid, side, origin, unknown="free")
    wanted = cells_of(grid, side, origin)
    found = shapely.union_all([shapely.Polygon(p) for p in static.polygons])
    assert found.symmetric_difference(wanted).area <= 1e-9 * (1.0 + wanted.area)
    outside = wanted.difference(shapely.box(*static.bounds))
    assert outside.area <= 1e-9 * (1.0 + wanted.area)


def test_a_wall_is_one_rectangle_and_a_cross_two():
    grid = np.zeros((20, 20), dtype=bool)
    grid[7, 2:18] = True
    assert len(StaticMap.from_occupancy(grid, 0.1).polygons) == 1
    grid[2:18, 9] = True
    assert len(StaticMap.from_occupancy(grid, 0.1).polygons) == 2


def test_values_thresholds_and_unknown_cells():
    grid = np.array([[-1, 0, 64], [65, 100, -1]], dtype=np.int8)
    for options, area in (
        ({}, 4.0),
        ({"unknown": "free"}, 2.0),
        ({"unknown": "free", "occupied": 64}, 3.0),
        ({"unknown": "free", "occupied": 100}, 1.0),
    ):
        static = StaticMap.from_occupancy(grid, 1.0, **options)
        assert shapely.union_all([shapely.Polygon(p) for p in static.polygons]).area == area


def test_unknown_space_beyond_a_rotated_grid_is_closed_too():
    grid = np.zeros((4, 6), dtype=np.int8)
    for theta in (0.0, 0.3, np.pi / 2, -2.0):
        static = StaticMap.from_occupancy(grid, 0.5, (1.0, 2.0, theta))
        box = shapely.box(*static.bounds)
        walls = shapely.union_all([shapely.Polygon(p) for p in static.polygons])
        assert box.area - walls.area == pytest.approx(4 * 6 * 0.25)
        assert not StaticMap.from_occupancy(grid, 0.5, (1, 2, theta), unknown="free").polygons


@pytest.mark.parametrize(
    ("grid", "options", "message"),
    [
        (np.zeros(4, bool), {}, "grid must be an array"),
        (np.zeros((0, 3), bool), {}, "grid must be an array"),
        (np.full((2, 2), np.nan), {}, "whole numbers"),
        (np.array([[0, 254]]), {}, "got 254"),
        (np.array([[0, -2]]), {}, "got -2"),
        (np.zeros((2, 2), bool), {"resolution": 0.0}, "resolution"),
        (np.zeros((2, 2), bool), {"origin": (np.nan, 0)}, "origin must be finite"),
        (np.zeros((2, 2), bool), {"origin": (1, 2, 3, 4)}, "x, y, theta"),
        (np.zeros((2, 2), bool), {"unknown": "wall"}, "valid: free, obstacle"),
        (np.zeros((2, 2), bool), {"occupied": 0}, "occupied"),
    ],
)
def test_bad_grids_get_one_clear_error(grid, options, message):
    with pytest.raises(InvalidInputError, match=message):
        StaticMap.from_occupancy(grid, **{"resolution": 1.0, **options})


def write(folder, pixels, name="map.pgm", **changes):
    """A map in a folder, its YAML file's path."""
    Image.fromarray(np.asarray(pixels, dtype=np.uint8)).save(folder / name)
    (folder / "map.yaml").write_text(yaml.safe_dump({**META, "image": name, **changes}))
    return folder / "map.yaml"


def test_a_trinary_map_as_nav2_reads_it(tmp_path):
    # occupancy 1, 0.804 and 0.004; 205 is what the map saver writes for unknown: 0.196
    path = write(tmp_path, [[0, 50, 254], [205, 254, 254]])
    grid, side, origin = read_nav2_grid(path)
    assert grid.tolist() == [[-1, 0, 0], [100, 100, 0]]
    assert side == 0.5 and origin.tolist() == [1.0, -2.0, 0.0]
    static = load_nav2_map(path, unknown="free")
    (wall,) = static.polygons
    assert shapely.Polygon(wall).equals(shapely.box(1.0, -1.5, 2.0, -1.0))
    assert static.bounds.tolist() == [1.0, -2.0, 2.5, -1.0]
    assert read_nav2_grid(write(tmp_path, [[0, 254]], negate=1))[0].tolist() == [[0, 100]]
    assert read_nav2_grid(write(tmp_path, [[205]], free_thresh=0.25))[0].tolist() == [[0]]


def test_scale_and_raw_maps(tmp_path):
    path = write(tmp_path, [[0, 128, 254, 100]], mode="scale")
    half = round(((1 - 128 / 255) - 0.196) / (0.65 - 0.196) * 100)
    more = round(((1 - 100 / 255) - 0.196) / (0.65 - 0.196) * 100)
    assert read_nav2_grid(path)[0].tolist() == [[100, half, 0, more]]
    path = write(tmp_path, [[0, 128, 254, 100]], mode="raw")
    assert read_nav2_grid(path)[0].tolist() == [[0, -1, -1, 100]]


@pytest.mark.parametrize(("mode", "ends"), [("trinary", (100, 0)), ("scale", (100, 0))])
def test_what_is_not_opaque_is_unknown(tmp_path, mode, ends):
    pixels = np.array([[[0, 0, 0, 255], [0, 0, 0, 254], [255, 255, 255, 255], [255, 255, 255, 0]]])
    path = write(tmp_path, pixels, name="map.png", mode=mode)
    assert read_nav2_grid(path)[0].tolist() == [[ends[0], -1, ends[1], -1]]
    Image.fromarray(pixels[..., 2:].astype(np.uint8)).save(tmp_path / "map.png")  # grey, opacity
    assert read_nav2_grid(path)[0].tolist() == [[ends[0], -1, ends[1], -1]]
    palette = Image.fromarray(pixels[..., 0].astype(np.uint8)).quantize(4)
    dark, light = palette.getpixel((0, 0)), palette.getpixel((2, 0))
    palette.save(tmp_path / "map.png", transparency=dark)
    assert read_nav2_grid(path)[0].tolist() == [[-1, -1, 0, 0]]
    palette.save(tmp_path / "map.png", transparency=light)
    assert read_nav2_grid(path)[0].tolist() == [[100, 100, -1, -1]]
    write(tmp_path, pixels, name="map.png", mode="raw")  # which knows no opacity
    assert read_nav2_grid(path)[0].tolist() == [[0, 0, -1, -1]]


def test_thresholds_belong_to_the_values_they_bound(tmp_path):
    shades = [[0, 255, 205, 102, 153]]  # occupancy 1, 0, 0.196, 0.6, 0.4
    for occupied, free, cells in (
        (1.0, 0.0, [100, 0, -1, -1, -1]),
        (0.6, 0.4, [100, 0, 0, 100, 0]),
        (0.5, 0.5, [100, 0, 0, 100, 0]),
    ):
        path = write(tmp_path, shades, occupied_thresh=occupied, free_thresh=free)
        assert read_nav2_grid(path)[0].tolist() == [cells]
        path = write(
            tmp_path,
            [[255 - s for s in shades[0]]],
            negate=True,
            mode="SCALE",
            occupied_thresh=occupied,
            free_thresh=free,
        )
        found = read_nav2_grid(path)[0].tolist()[0]
        between = [round(100 * c) for c in (0.196, 0.6, 0.4)] if free == 0.0 else cells[2:]
        assert found == [*cells[:2], *between]


def test_pictures_of_every_kind_have_the_grey_values_of_graphicsmagick(tmp_path):
    def read(picture, name="map.png"):
        if isinstance(picture, bytes):
            (tmp_path / name).write_bytes(picture)
        else:
            picture.save(tmp_path / name)
        data = {**META, "image": name, "mode": "Raw"}
        (tmp_path / "map.yaml").write_text(yaml.safe_dump(data))
        return read_nav2_grid(tmp_path / "map.yaml")[0].tolist()

    pure = np.array([[[255, 0, 0], [0, 90, 0], [0, 0, 255], [7, 7, 7]]], dtype=np.uint8)
    assert read(Image.fromarray(pure)) == [[76, 52, 29, 7]]
    assert read(Image.fromarray(pure), "map.bmp") == [[76, 52, 29, 7]]
    deep = np.array([[0, 0x00FF, 0x0101, 0x63FF]], dtype=np.uint16)
    assert read(Image.fromarray(deep)) == [[0, 0, 1, 99]]
    assert read(Image.fromarray(np.array([[False, True]]))) == [[0, -1]]
    plain = b"P2 # by hand\n# and more\n3 1\n# of\n100\n0 20 1\n"
    assert read(plain, "map.pgm") == [[0, 50, 2]]
    assert read(b"P5\n# CREATOR: map_saver\n3 1\n100\n\0\x14\1", "map.pgm") == [[0, 50, 2]]
    assert read(b"P5 3 1 1000\n\0\0\0\xff\0\1", "map.pgm") == [[0, 65, 0]]
    assert read(b"P1 3 1\n0 1 1\n", "map.pgm") == [[-1, 0, 0]]


def test_keys_that_nav2_does_not_know_are_allowed_and_named(tmp_path):
    path = write(tmp_path, [[0, 254]], map_type="occupancy", note="hall 3")
    with pytest.warns(UnusedInputWarning, match=r"not used: map_type, note$"):
        assert read_nav2_grid(path)[0].tolist() == [[100, 0]]


def test_a_map_of_single_cells_is_refused_in_one_line(monkeypatch):
    board = np.indices((60, 60)).sum(axis=0) % 2 == 1
    monkeypatch.setattr(occupancy_grid, "MOST_RECTANGLES", 1800)
    assert len(StaticMap.from_occupancy(board, 0.05).polygons) == 1800
    board[0, 0] = True  # still one rectangle with its neighbours
    monkeypatch.setattr(occupancy_grid, "MOST_RECTANGLES", 1700)
    with pytest.raises(InvalidInputError, match="more than 1,700 rectangles"):
        StaticMap.from_occupancy(board, 0.05)


def test_a_world_file_may_name_a_map(tmp_path):
    write(tmp_path, [[0, 254, 254, 205]])
    (tmp_path / "room.yaml").write_text(
        """
schema: pushplan-world/1
robot: {drive: differential, mass: 1, max_speed: 0.2, max_turn_rate: 1, pose: [2, -1.8, 0],
        parts: [[[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]]]}
static: {map: map.yaml, polygons: [[[1.6, -2], [1.7, -2], [1.7, -1.9]]]}
goal: {kind: disc, center: [2.2, -1.8], radius: 0.1}
"""
    )
    static = load_world(tmp_path / "room.yaml").static
    assert len(static.polygons) == 3
    assert static.bounds.tolist() == [1.0, -2.0, 3.0, -1.5]
    text = (tmp_path / "room.yaml").read_text()
    (tmp_path / "room.yaml").write_text(text.replace("map.yaml", "map.yaml, unknown: free"))
    assert len(load_world(tmp_path / "room.yaml").static.polygons) == 2
    (tmp_path / "room.yaml").write_text(text.replace("map.yaml", "no.yaml"))
    with pytest.raises(SchemaError, match=r"cannot read map file .*no\.yaml"):
        load_world(tmp_path / "room.yaml")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"image": "no.pgm"}, r"cannot read the picture of the map, .*no\.pgm"),
        ({"mode": "trinry"}, "did you mean 'trinary'"),
        ({"free_thresh": 0.7}, "free_thresh must not be above occupied_thresh"),
        ({"occupied_thresh": 65}, r"occupied_thresh must lie in \[0, 1\]"),
        ({"negate": "no"}, "negate must be 0 or 1"),
        ({"origin": [0, 0]}, r"origin must have shape \(3,\)"),
        ({"resolution": -0.05}, "resolution must lie in"),
        ({"mode": 3}, "mode must be a text"),
    ],
)
def test_bad_map_files_get_one_clear_error(tmp_path, changes, message):
    write(tmp_path, [[0, 254]])
    (tmp_path / "map.yaml").write_text(yaml.safe_dump({**META, **changes}))
    with pytest.raises(InvalidInputError, match=message):
        load_nav2_map(tmp_path / "map.yaml")


def test_a_file_that_is_no_picture_is_refused(tmp_path):
    (tmp_path / "map.pgm").write_bytes(b"P5 nonsense")
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(META))
    with pytest.raises(SchemaError, match="cannot read the picture"):
        load_nav2_map(tmp_path / "map.yaml")


@pytest.mark.parametrize("ending", ["jpg", "jpeg", "JPG"])
def test_a_jpeg_is_read_and_other_formats_are_told_which_are(tmp_path, ending):
    shades = np.full((16, 24), 254, dtype=np.uint8)
    shades[:8, 8:16] = 0  # whole blocks of 8 pixels, which the format keeps
    for name in (f"map.{ending}", "map.png"):
        picture = Image.fromarray(shades).convert("RGB" if ending == "jpeg" else "L")
        picture.save(tmp_path / name, **({} if name == "map.png" else {"quality": 95}))
        (tmp_path / f"{name}.yaml").write_text(yaml.safe_dump({**META, "image": name}))
    exact = read_nav2_grid(tmp_path / "map.png.yaml")[0]
    assert (read_nav2_grid(tmp_path / f"map.{ending}.yaml")[0] == exact).all()
    for name in ("map.gif", "map.tiff", "map.webp"):
        Image.fromarray(shades).save(tmp_path / name)
        (tmp_path / "map.yaml").write_text(yaml.safe_dump({**META, "image": name}))
        with pytest.raises(SchemaError, match="no whole picture in PGM, PNG, BMP or JPEG") as told:
            load_nav2_map(tmp_path / "map.yaml")
        assert "object at" not in str(told.value)
