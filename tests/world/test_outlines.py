"""One rule for outlines, whoever drew them: closed rings, repeated corners, either way, float32."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from pushplan.geometry.regions import as_target
from pushplan.perception import ObjectTracker
from pushplan.scenarios import IceField, load_ice
from pushplan.world import (
    ClearanceArea,
    InvalidInputError,
    Movables,
    Receptacle,
    StaticMap,
)
from pushplan.world.outline import convex_outline, signed_area, well_formed
from pushplan.world.stored.world_files import movables_from_list, robot_from_dict

HEXAGON = np.array([[2.0, 0.0], [1.0, 1.7], [-1.0, 1.7], [-2.0, 0.0], [-1.0, -1.7], [1.0, -1.7]])
LIMITS = {"mass": 1, "drive": "differential", "max_speed": 1, "max_turn_rate": 1}


def drawn_by_others(outline: np.ndarray) -> dict[str, np.ndarray]:
    """The same shape as other programs write it."""
    middle = 0.5 * (outline + np.roll(outline, -1, axis=0))
    size = np.ptp(outline)
    return {
        "closed": np.concatenate([outline, outline[:1]]),
        "closed clockwise": np.concatenate([outline, outline[:1]])[::-1],
        "closed nearly": np.concatenate([outline, outline[:1] + 1e-9 * size]),
        "clockwise": outline[::-1],
        "repeated": np.repeat(outline, 3, axis=0),
        "repeated nearly": np.repeat(outline, 2, axis=0) + 1e-9 * size * np.eye(2)[:1],
        "collinear": np.stack([outline, middle], axis=1).reshape(-1, 2),
        "collinear in float32": np.stack([outline, middle], axis=1)
        .reshape(-1, 2)
        .astype(np.float32),
    }


def on_a_robot(corners: object) -> np.ndarray:
    return ANY_SHAPE["robot"](corners)[0]


def in_a_field(corners: object, folder: Path) -> np.ndarray:
    path = folder / "field.json"
    path.write_text(json.dumps([corners]))
    return load_ice(path).floes[0][0]


def seen(corners: object) -> np.ndarray:
    return ObjectTracker().update([corners], 0.0).outline_world(0)


DOORS = {
    "world file, polygon": lambda c: movables_from_list([{"polygon": c}]).outline_world(0),
    "world file, outline": lambda c: movables_from_list(
        [{"outline": c, "pose": [0, 0, 0]}]
    ).outline_world(0),
    "movables": lambda c: Movables.from_outlines([c], [[0, 0, 0]]).outline_world(0),
    "flattened movables": lambda c: Movables(
        [3], np.zeros((1, 3)), np.zeros((1, 3)), [1.0], [False], c, [0, len(c)], [0.0]
    ).outline_world(0),
    "static": lambda c: StaticMap.build([c]).polygons[0],
    "robot": on_a_robot,
    "receptacle": lambda c: Receptacle(c).polygon,
    "target": lambda c: as_target([c]).parts[0],
    "ice": lambda c: IceField((c,), [-9, -9, 9, 9]).floes[0][0],
    "tracker": seen,
}  # fmt: skip


@pytest.mark.parametrize("door", [*DOORS, "ice file"])
def test_every_door_takes_outlines_as_other_programs_draw_them(door, tmp_path):
    read = DOORS.get(door, lambda corners: in_a_field(corners, tmp_path))
    expected = shapely.Polygon(HEXAGON)
    for how, corners in drawn_by_others(HEXAGON).items():
        found = read(corners.tolist())
        assert signed_area(found) > 0.0, how
        assert well_formed(found, np.array([0, len(found)])).all(), how
        assert shapely.hausdorff_distance(shapely.Polygon(found), expected) < 1e-5, how


ANY_SHAPE = {
    "world file, polygon": lambda c: movables_from_list([{"polygon": c}]).parts_world(0),
    "movables": lambda c: Movables.from_polygons([c]).parts_world(0),
    "static": lambda c: StaticMap.build([c]).polygons,
    "ice": lambda c: IceField((c,), [-9, -9, 9, 9]).floes[0],
    "robot": lambda c: robot_from_dict({**LIMITS, "pose": [0, 0, 0], "parts": [c]})[0].parts,
}
DENTED = np.insert(HEXAGON, 3, [-1.4, 0.8], axis=0)


@pytest.mark.parametrize("door", ANY_SHAPE)
def test_doors_of_what_is_pushed_or_stands_take_a_dent(door):
    parts = ANY_SHAPE[door](DENTED.tolist())
    assert len(parts) > 1
    union = shapely.union_all([shapely.Polygon(part) for part in parts])
    assert union.symmetric_difference(shapely.Polygon(DENTED)).area < 1e-9


@pytest.mark.parametrize("door", ["receptacle", "target", "flattened movables"])
def test_the_other_doors_refuse_a_dent_in_the_same_words(door):
    with pytest.raises(InvalidInputError, match="must be convex: split it into convex parts"):
        DOORS[door](DENTED.tolist())


def test_the_tracker_takes_the_hull_of_what_a_camera_sees():
    assert signed_area(seen(DENTED)) == pytest.approx(signed_area(HEXAGON))


def test_good_outlines_stay_as_they_are():
    edge = np.insert(HEXAGON, 1, 0.5 * (HEXAGON[0] + HEXAGON[1]), axis=0)
    for outline in (HEXAGON, edge):
        assert convex_outline("outline", outline).tobytes() == outline.tobytes()
        closed = np.concatenate([outline, outline[:1]])
        assert convex_outline("outline", closed).tobytes() == outline.tobytes()


sides = st.integers(3, 200)
sizes = st.floats(0.01, 100.0)
places = st.floats(-200.0, 200.0)


@settings(max_examples=80)
@given(sides, sizes, places, places, st.floats(0.0, 7.0))
def test_convex_polygons_stay_convex_in_float32(count, size, x, y, turn):
    angles = turn + 2.0 * np.pi * np.arange(count) / count
    corners = size * np.column_stack([np.cos(angles), 0.4 * np.sin(angles)]) + [x, y]
    single = corners.astype(np.float32)
    found = convex_outline("outline", np.concatenate([single, single[:1]]))
    lost = signed_area(corners) - signed_area(found)
    assert abs(lost) <= (1e-3 * size) * (6.0 * size)


def test_a_dent_that_is_no_rounding_is_refused_at_every_size():
    for size in (1e-3, 1.0, 1e3):
        dent = [0.5, 1e-4]
        square = size * np.array([[0, 0], dent, [1, 0], [1, 1], [0, 1]])
        with pytest.raises(InvalidInputError, match="convex"):
            convex_outline("outline", square)
        dent[1] = 1e-7
        square = size * np.array([[0, 0], dent, [1, 0], [1, 1], [0, 1]])
        assert len(convex_outline("outline", square)) == 4


@pytest.mark.parametrize(
    "corners",
    [
        [[0, 0], [2, 0], [0, 2], [2, 2]],  # a bow tie
        [[0, 0], [2, 0], [2, 2], [0, 2]] * 2,  # twice around
        [[2, 0], [-1.6, 1.2], [0.6, -1.9], [0.6, 1.9], [-1.6, -1.2]],  # a star
        [[0, 0], [1, 0], [2, 0], [1, 2], [1, 0]],  # a spike
    ],
)
def test_rings_that_cross_themselves_are_refused(corners):
    with pytest.raises(InvalidInputError, match="must be convex"):
        convex_outline("outline", corners)


def test_edges_of_a_clearance_area_keep_their_flags():
    flags = [True, False, False, True, False, False]

    def opened(area: ClearanceArea) -> set[tuple[float, ...]]:
        ends = np.hstack([area.polygon, np.roll(area.polygon, -1, axis=0)])
        return {tuple(edge) for edge in ends[area.open_edges].tolist()}

    plain = ClearanceArea(HEXAGON, flags)
    assert plain.polygon.tobytes() == HEXAGON.tobytes()
    closed = np.concatenate([HEXAGON, HEXAGON[:1]])
    assert ClearanceArea(closed, flags) == plain
    turned = [*flags[4::-1], flags[5]]  # the edge from corner i runs the other way
    assert opened(ClearanceArea(HEXAGON[::-1], turned)) == opened(plain)
    doubled = ClearanceArea(
        np.repeat(HEXAGON, 2, axis=0), [f for flag in flags for f in (1 > 2, flag)]
    )
    assert doubled == plain


@pytest.mark.parametrize(
    "name", ["ids", "masses", "wheeled", "twists", "poses", "fixed", "contact_radii"]
)
@pytest.mark.parametrize("value", [[True], [[True], False], "x", 3, None, [None, None], [1, [2]]])
def test_one_value_for_each_object_or_one_clear_error(name, value):
    fields = {"poses": np.zeros((2, 3)), name: value}
    try:
        found = Movables.from_outlines([HEXAGON] * 2, **fields)
    except InvalidInputError as error:
        assert f"movables.{name}" in str(error)
    else:
        assert len(getattr(found, name)) == 2
