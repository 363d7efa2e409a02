"""Fields of broken ice in files, and files that mean no good."""

import io
import itertools
import json
import os
import pickle
import time
import warnings
import zipfile

import numpy as np
import pytest
import shapely

from pushplan.scenarios import IceField, generate_ice, load_ice, save_ice
from pushplan.world import InvalidInputError, PushplanError, SchemaError, stream
from pushplan.world.outline_repair import OutlineWarning

BASIN = (0.0, 0.0, 12.0, 40.0)
SQUARE = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
ARROW = [[0.0, 0.0], [2.0, 0.0], [1.0, 0.2], [1.0, 2.0]]


def ice(concentration):
    return generate_ice(stream(0, "ice"), bounds=BASIN, concentration=concentration)


def test_files_give_the_field_back(tmp_path):
    for field in (ice(0.3), ice(0.0)):
        for name in ("field.json", "field.npz"):
            save_ice(field, tmp_path / name)
            assert load_ice(tmp_path / name) == field
    save_ice(ice(0.3), tmp_path / "again.npz")
    first = (tmp_path / "again.npz").read_bytes()
    save_ice(ice(0.3), tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == first
    with pytest.raises(InvalidInputError, match=r"written to a \.json or \.npz"):
        save_ice(ice(0.3), tmp_path / "field.pkl")
    with pytest.raises(InvalidInputError, match="cannot write"):
        save_ice(ice(0.3), tmp_path / "no" / "folder.json")


def test_plain_lists_and_arrays(tmp_path):
    path = tmp_path / "ice.json"
    clockwise_and_closed = [[5.0, 5.0], [5.0, 6.0], [6.0, 6.0], [5.0, 5.0]]
    path.write_text(json.dumps([SQUARE, clockwise_and_closed]))
    field = load_ice(path)
    assert len(field) == 2 and field.bounds.tolist() == [0.0, 0.0, 6.0, 6.0]
    assert field.areas.tolist() == [1.0, 0.5]
    path.write_text(json.dumps({"polygons": [SQUARE], "bounds": [0, 0, 2, 2]}))
    assert load_ice(path).concentration == 0.25
    squares = np.array([SQUARE, np.add(SQUARE, 3.0)])
    np.save(tmp_path / "ice.npy", squares)
    assert load_ice(tmp_path / "ice.npy") == IceField(tuple(squares), (0.0, 0.0, 4.0, 4.0))


def test_floes_of_any_shape_and_their_hulls(tmp_path):
    path = tmp_path / "ice.json"
    pair = [np.add(SQUARE, (8.0, 0.0)).tolist(), np.add(SQUARE, (10.0, 0.0)).tolist()]
    path.write_text(json.dumps([np.add(SQUARE, 5.0).tolist(), ARROW, pair]))
    field = load_ice(path)
    assert field.areas.tolist() == pytest.approx([1.0, 1.1, 2.0])
    assert [len(parts) for parts in field.floes] == [1, 2, 2]
    for name in ("again.json", "again.npz"):
        save_ice(field, tmp_path / name)
        assert load_ice(tmp_path / name) == field
    assert load_ice(path, hull=True).areas.tolist() == pytest.approx([1.0, 2.0, 3.0])


def nrc(floes, **properties):
    """The text of a field in the form of the National Research Council of Canada."""
    ice = {str(k): {"perimeter": corners, **more} for k, (corners, more) in enumerate(floes)}
    return json.dumps({"properties": properties, "ice": ice})


def overlaps(field):
    shapes = [shapely.union_all([shapely.Polygon(part) for part in floe]) for floe in field.floes]
    return [
        (i, j)
        for (i, a), (j, b) in itertools.combinations(enumerate(shapes), 2)
        if a.intersection(b).area > 1e-9
    ]


def test_fields_of_the_national_research_council(tmp_path):
    path = tmp_path / "field.json"
    near = [[0.0, 0.0], [1e-9, 1e-10], *SQUARE[1:]][::-1]
    path.write_text(nrc([(near, {"location": [3 * k, 5], "yaw": 90}) for k in range(3)]))
    field = load_ice(path)
    assert field.bounds.tolist() == pytest.approx([-1.0, 5.0, 6.0, 6.0])
    assert field.areas.tolist() == pytest.approx([1.0] * 3)
    long = [[-4.0, -1.0], [4.0, -1.0], [4.0, 1.0], [-4.0, 1.0]]
    turned = [(long, {"location": [4 * k, 0], "yaw": yaw}) for k, yaw in enumerate((90, -90, 450))]
    path.write_text(nrc([*turned, (long, {"location": [16.1, 0]})]))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        field = load_ice(path)  # and nothing is moved apart
    assert not overlaps(field) and field.areas.tolist() == pytest.approx([16.0] * 4)
    path.write_text(nrc([(long, {"location": [3, 3], "yaw": 30})]))
    ((corners,),) = load_ice(path).floes
    assert corners[0].tolist() == pytest.approx([3.0 - 2 * 3**0.5 + 0.5, 3.0 - 2.0 - 0.5 * 3**0.5])
    for broken, problem in (
        ({"location": [0, 0]}, "floe '1' lacks the required key 'perimeter'"),
        ({"location": [0], "perimeter": near}, "location of floe '1' must have shape"),
        (
            {"location": [0, 0], "perimeter": near, "yaw": "east"},
            "yaw of floe '1' must be a number",
        ),
        ({"location": [0, 0], "perimeter": near, "type": "disc"}, "type of floe '1'.*polygon"),
        (3, "floe '1' must be a mapping"),
    ):
        path.write_text(json.dumps({"ice": {"1": broken}}))
        with pytest.raises(InvalidInputError, match=problem):
            load_ice(path)
    path.write_text('{"ice": []}')
    with pytest.raises(InvalidInputError, match="ice must be a dict"):
        load_ice(path)


def test_floes_may_reach_across_the_edge_of_their_water(tmp_path):
    path = tmp_path / "field.json"
    floes = [(SQUARE, {"location": at}) for at in ([-0.5, 3], [9.5, 3], [9.4, 3.5], [20, 3])]
    path.write_text(nrc(floes, field_size=[10, 5]))
    apart = pytest.warns(OutlineWarning, match="in 1 places")
    with apart:
        field = load_ice(path)
    assert field.bounds.tolist() == [0, 0, 10, 5] and not overlaps(field)
    # those that need not be moved stay where they are
    assert field.floes[0][0].min() == -0.5 and field.floes[3][0].max() == 21.0
    for name in ("again.json", "again.npz"):
        save_ice(field, tmp_path / name)
        assert load_ice(tmp_path / name) == field
    path.write_text(
        json.dumps({"polygons": [SQUARE], "bounds": [0, 0, 1, 1], "water": [0, 0, 1, 1]})
    )
    with pytest.raises(InvalidInputError, match="its bounds or its water, got both"):
        load_ice(path)


def test_overlapping_floes_are_moved_apart_and_touching_ones_are_not(tmp_path):
    path = tmp_path / "ice.json"
    polygons = [SQUARE, np.add(SQUARE, (1.0, 0.0)).tolist(), np.add(SQUARE, (0.9, 0.5)).tolist()]
    path.write_text(json.dumps({"polygons": polygons, "bounds": [0, 0, 4, 4]}))
    with pytest.warns(OutlineWarning, match="in 2 places: 1 of 3 floes were moved"):
        field = load_ice(path)
    shapes = [shapely.Polygon(floe) for (floe,) in field.floes]
    assert not any(a.overlaps(b) for a, b in itertools.combinations(shapes, 2))
    assert field.areas.tolist() == pytest.approx([1.0] * 3)
    assert shapely.union_all(shapes).area == pytest.approx(3.0)
    kept = load_ice(path, overlaps=True)
    assert np.array_equal([floe for (floe,) in kept.floes], polygons)
    path.write_text(json.dumps({"polygons": polygons, "bounds": [0, 0, 2, 1.5]}))
    with pytest.raises(InvalidInputError, match=r"could not be moved apart.*--overlaps"):
        load_ice(path)
    path.write_text(json.dumps({"polygons": [SQUARE] * 3, "bounds": [0, 0, 1.5, 1.5]}))
    with pytest.raises(InvalidInputError, match=r"3 m² in all, in 2.25 m² of water.*--overlaps"):
        load_ice(path)
    path.write_text(json.dumps(polygons[:2]))
    assert np.array_equal([floe for (floe,) in load_ice(path).floes], polygons[:2])


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "cannot read"),
        ("{", "cannot read"),
        ("[" * 100_000, "cannot read"),
        ("3", "polygons must be a list"),
        ("{}", "lacks the required key 'polygons'"),
        ('{"polygons": [], "bound": [0, 0, 1, 1]}', "did you mean 'bounds'"),
        ('{"polygons": [], "schema": "pushplan-ice/9"}', "reads schema"),
        ("[]", "must state its bounds"),
        ('{"polygons": [], "bounds": [0, 0, 1]}', "bounds"),
        ('[[[0, 0], [1, 0], ["x", 1]]]', "polygon 0 must be an array"),
        ("[[[0, 0], [1, 0], [NaN, 1]]]", "polygon 0 must be finite"),
        ("[[[0, 0], [1, 0], [1e999, 1]]]", "polygon 0 must be finite"),
        ("[[[0, 0], [1, 0, 3], [1, 1]]]", "polygon 0 must be an array"),
        ("[[[0, 0], [1, 0]]]", "polygon 0 must have at least 3 corners"),
        ("[[]]", "polygon 0 must have at least 3 corners"),
        ("[[[0, 0], [1, 0], [2, 0]]]", "polygon 0 must have an area"),
        ("[[[0, 0], [2, 0], [0, 2], [2, 2]]]", "polygon 0 crosses itself"),
        (
            '{"polygons": [[[0, 0], [1, 0], [1, 1]]], "bounds": [0, 0, 0.5, 2]}',
            "polygon 0 must lie",
        ),
    ],
)
def test_hostile_json(tmp_path, text, problem):
    path = tmp_path / "ice.json"
    path.write_text(text)
    with pytest.raises(InvalidInputError, match=problem) as caught:
        load_ice(path)
    assert str(path) in str(caught.value) and len(str(caught.value)) < 400


class Trap:
    """Leaves a mark when somebody unpickles it."""

    def __init__(self, mark):
        self.mark = mark

    def __reduce__(self):
        return os.mkdir, (str(self.mark),)


def test_pickles_are_never_run(tmp_path):
    mark = tmp_path / "mark"
    trap = Trap(mark)
    hostile = pickle.dumps(trap)
    objects = np.empty(1, dtype=object)
    objects[0] = trap
    packed = io.BytesIO()
    np.savez(packed, vertices=objects, offsets=np.array([0, 1]))
    single = io.BytesIO()
    np.save(single, objects, allow_pickle=True)
    for name, content in (
        *((f"ice.{ending}", hostile) for ending in ("json", "npz", "npy", "pkl", "pk", "pickle")),
        ("objects.npz", packed.getvalue()),
        ("objects.npy", single.getvalue()),
        ("swapped.npz", single.getvalue()),
        ("swapped.npy", packed.getvalue()),
    ):
        path = tmp_path / name
        path.write_bytes(content)
        with pytest.raises(PushplanError):
            load_ice(path)
        assert not mark.exists()
    pickle.loads(hostile)
    assert mark.exists()  # the trap works


def test_hostile_archives(tmp_path):
    path = tmp_path / "ice.npz"
    good = {"vertices": np.array(SQUARE), "offsets": np.array([0, 4])}

    def refused(error=SchemaError, **changes):
        np.savez(path, **{**good, **changes})
        with pytest.raises(error):
            load_ice(path)

    refused(offsets=np.array([0, 5]))
    refused(offsets=np.array([1, 4]))
    refused(offsets=np.array([0, 3, 1, 4]))
    refused(offsets=np.array([], dtype=int))
    refused(offsets=np.array([0.0, 4.0]))
    refused(InvalidInputError, offsets=np.array([0, 0, 4]))
    refused(vertices=np.array(SQUARE)[:, :1])
    refused(vertices=np.full((4, 2), np.nan))
    refused(vertices=np.array(SQUARE).astype(str))
    refused(InvalidInputError, bounds=np.array([0.0, 0.0, 0.5, 1.0]))
    refused(stowaway=np.zeros(3))
    np.savez(path, vertices=np.array(SQUARE))
    with pytest.raises(SchemaError, match="lacks the required key 'offsets'"):
        load_ice(path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("vertices.npy", b"\x93NUMPY\x01\x00not a header")
        archive.writestr("offsets.npy", b"")
    with pytest.raises(SchemaError):
        load_ice(path)
    path.write_bytes(path.read_bytes()[:40])
    with pytest.raises(SchemaError, match="cannot read"):
        load_ice(path)
    with pytest.raises(SchemaError, match="cannot read"):
        load_ice(tmp_path / "missing.npz")
    for nothing in (None, 3, b"ice.json"):
        with pytest.raises(InvalidInputError, match="must be a text"):
            load_ice(nothing)
    with pytest.raises(InvalidInputError, match="must be a list of outlines"):
        IceField(3, BASIN)
    with pytest.raises(SchemaError, match="cannot read"):
        (tmp_path / "folder.json").mkdir()
        load_ice(tmp_path / "folder.json")
    np.save(tmp_path / "flat.npy", np.zeros(7))
    with pytest.raises(SchemaError, match=r"flat\.npy: the array of polygons must have shape"):
        load_ice(tmp_path / "flat.npy")


def test_archives_that_unpack_to_a_flood_are_refused(tmp_path):
    path = tmp_path / "flood.npz"
    np.savez_compressed(path, vertices=np.zeros((7_000_000, 2)), offsets=[0, 7_000_000])
    assert path.stat().st_size < 10**6
    with pytest.raises(SchemaError, match=r"needs 112,000,000 bytes, 100,000,000 are left"):
        load_ice(path)


def test_floes_that_no_time_moves_apart_are_refused_in_a_moment(tmp_path):
    path = tmp_path / "ice.json"
    rng = np.random.default_rng(0)
    heap = [np.add(SQUARE, at).tolist() for at in rng.uniform(0.0, 8.0, (80, 2))]
    path.write_text(json.dumps({"polygons": heap, "bounds": [0, 0, 9.1, 9.1]}))
    began = time.process_time()
    with pytest.raises(InvalidInputError, match="could not be moved apart: of"):
        load_ice(path)
    assert time.process_time() - began < 30.0  # rounds without progress end it
