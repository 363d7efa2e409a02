"""The tracker against objects whose identity, shape, heading and velocity are known."""

import math
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pushplan.perception import ObjectTracker
from pushplan.perception.contour_alignment import align, resampled
from pushplan.world import InvalidInputError, Movables
from pushplan.world.outline import transform

Array = NDArray[np.float64]
BOX = np.array([(-0.04, -0.04), (0.04, -0.04), (0.04, 0.04), (-0.04, 0.04)])
_ANGLES = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
FLOE = np.column_stack([0.5 * np.cos(_ANGLES), 0.35 * np.sin(_ANGLES)])


def sighting(
    outline: Array, pose: Sequence[float], rng: np.random.Generator, noise: float
) -> Array:
    """An outline at a pose, from any corner on, either way round, with noise at each corner."""
    seen = transform(pose, outline) + noise * rng.normal(size=outline.shape)
    seen = np.roll(seen, int(rng.integers(len(seen))), axis=0)
    return seen if rng.random() < 0.5 else seen[::-1]


def overlap(movables: Movables, k: int, truth: Array) -> float:
    """Intersection over union of an object's outline and the true one, laid on each other."""
    shape, real_shape = (points @ np.array([1.0, 1.0j]) for points in (movables.outline(k), truth))
    same = len(shape) == len(real_shape)
    pair = (
        [shape[None], real_shape[None]]
        if same
        else [resampled(shape)[None], resampled(real_shape)[None]]
    )
    near = movables.poses[k : k + 1, 2]
    found = align(*pair, near, np.full(1, 1e-6), np.full(1, 0.5), sampled=not same)
    centre, heading = found.centres[0], float(near[0] + found.turns[0])
    laid = transform((centre.real, centre.imag, heading), movables.outline(k))
    seen, real = shapely.Polygon(laid), shapely.Polygon(truth)
    return float(seen.intersection(real).area / seen.union(real).area)


def test_a_box_that_turns_through_many_right_angles_has_turned() -> None:
    rng, tracker = np.random.default_rng(0), ObjectTracker()
    rate, headings = 1.0, []
    for stamp in np.arange(0.0, 8.0, 0.1):
        pose = (0.02 * stamp, 0.0, rate * stamp)
        found = tracker.update([sighting(BOX, pose, rng, 0.002)], stamp)
        headings.append(found.poses[0, 2] - rate * stamp)
    assert found.ids.tolist() == [0]
    # the frame starts along the world's axes, and what it was off then stays
    assert np.ptp(headings[20:]) < math.radians(5.0)
    assert found.twists[0] == pytest.approx([0.02, 0.0, rate], abs=0.1)


@pytest.mark.parametrize("outline", [BOX, FLOE], ids=["box", "floe"])
def test_noisy_outlines_are_taken_and_their_mean_is_nearer_to_the_truth(outline: Array) -> None:
    rng, tracker = np.random.default_rng(1), ObjectTracker()
    noise, pose = 0.06 * float(np.hypot(*outline[0])), (1.0, -2.0, 0.4)
    first = tracker.update([sighting(outline, pose, rng, noise)], 0.0)
    for stamp in range(1, 65):
        last = tracker.update([sighting(outline, pose, rng, noise)], 0.1 * stamp)
    truth = transform(pose, outline)
    assert len(last) == 1 and len(last.outline(0)) <= len(outline)
    assert overlap(last, 0, truth) > 0.97
    assert overlap(last, 0, truth) > overlap(first, 0, truth)


def test_contours_of_any_number_of_corners_give_heading_and_shape() -> None:
    rng, tracker = np.random.default_rng(2), ObjectTracker()
    plain = shapely.Polygon([(-0.1, -0.03), (0.1, -0.03), (0.1, 0.03), (-0.1, 0.03)]).exterior
    for step in range(60):
        at = np.linspace(0.0, 1.0, int(rng.integers(30, 90)), endpoint=False)
        dense = np.array([plain.interpolate(t, normalized=True).coords[0] for t in at])
        seen = sighting(dense, (0.0, 0.0, 0.02 * step), rng, 0.002)
        found = tracker.update([seen], 0.1 * step)
    assert found.poses[0, 2] == pytest.approx(0.02 * step, abs=math.radians(3.0))
    truth = transform((0.0, 0.0, 0.02 * step), np.array(plain.coords[:-1]))
    assert overlap(found, 0, truth) > 0.9


def test_neighbours_keep_their_identity_while_they_move_together() -> None:
    rng, tracker = np.random.default_rng(3), ObjectTracker()
    grid = np.array([(0.1 * i, 0.1 * j, 0.0) for i in range(5) for j in range(4)])
    for step in range(40):
        poses = grid + np.array([0.02 * step, 0.0, 0.01 * step])
        order = rng.permutation(len(poses))
        seen = [sighting(BOX, poses[k], rng, 0.004) for k in order]
        found = tracker.update(seen, 0.1 * step)
        if step == 0:
            owner = dict(zip(found.ids.tolist(), order.tolist(), strict=True))
    assert set(found.ids.tolist()) == set(owner)
    for label, place in zip(found.ids.tolist(), found.poses, strict=True):
        assert np.hypot(*(place[:2] - poses[owner[label], :2])) < 0.02


def test_an_object_out_of_sight_stays_for_a_while_and_comes_to_rest() -> None:
    tracker = ObjectTracker(keep=1.0)
    for step in range(20):
        tracker.update([transform((0.01 * step, 0.0, 0.0), BOX)], 0.1 * step)
    speed = tracker.movables.twists[0, 0]
    assert speed == pytest.approx(0.1, rel=0.1)
    hidden = [tracker.update([], 1.9 + 0.1 * step) for step in range(1, 13)]
    assert [len(one) for one in hidden] == [1] * 10 + [0, 0]
    assert 0.19 < hidden[9].poses[0, 0] < 0.26
    assert abs(hidden[9].twists[0, 0]) < 0.1 * speed


def test_a_single_sighting_elsewhere_is_doubted_and_a_second_one_is_believed() -> None:
    tracker = ObjectTracker()
    at, far = transform((0.0, 0.0, 0.0), BOX), transform((1.0, 0.0, 0.0), BOX)
    tracker.update([at], 0.0)
    assert tracker.update([far], 0.1).poses[0] == pytest.approx([0.0, 0.0, 0.0])
    assert tracker.unseen_s.tolist() == pytest.approx([0.1])
    assert tracker.update([at], 0.2).ids.tolist() == [0]
    tracker.update([far], 0.3)
    moved = tracker.update([far], 0.4)
    assert moved.ids.tolist() == [0]
    assert moved.poses[0, :2] == pytest.approx([1.0, 0.0], abs=1e-3)
    tracker.update([far, at], 0.5)
    assert tracker.update([far, at], 0.6).ids.tolist() == [0, 1]  # both are there: a new one


def test_several_objects_may_appear_at_once() -> None:
    tracker = ObjectTracker()
    places = [transform((0.3 * k, 0.0, 0.0), BOX) for k in range(4)]
    tracker.update(places[:1], 0.0)
    assert len(tracker.update(places, 0.1)) == 1
    found = tracker.update(places[::-1], 0.2)
    assert sorted(found.poses[:, 0].tolist()) == pytest.approx([0.0, 0.3, 0.6, 0.9])


def test_labels_of_perception_are_kept() -> None:
    tracker = ObjectTracker()
    at, far = transform((0.0, 0.0, 0.0), BOX), transform((1.0, 0.0, 0.0), BOX)
    assert tracker.update([at, far], 0.0, ids=[7, 3]).ids.tolist() == [7, 3]
    assert tracker.update([far, at], 0.1, ids=[3, 7]).poses[:, 0].tolist() == pytest.approx([0, 1])
    for stamp in (0.2, 0.3):
        swapped = tracker.update([at, far], stamp, ids=[3, 7])
    assert swapped.ids.tolist() == [7, 3]
    assert swapped.poses[:, 0] == pytest.approx([1.0, 0.0], abs=1e-3)


def test_equal_and_earlier_stamps_change_nothing() -> None:
    tracker = ObjectTracker()
    first = tracker.update([BOX], 1.0)
    assert tracker.update([BOX + 0.01], 1.0) is first
    assert tracker.update([BOX + 0.01], 0.5) is first
    assert tracker.ignored == 2
    tracker.reset()
    assert tracker.update([BOX], 0.5).ids.tolist() == [0]


def test_shapes_stay_the_same_arrays_between_their_improvements() -> None:
    tracker = ObjectTracker()
    shapes = {id(tracker.update([BOX], 0.1 * step).vertices) for step in range(60)}
    assert len(shapes) <= 7


def test_outlines_without_area_count_as_unseen() -> None:
    tracker = ObjectTracker()
    tracker.update([BOX], 0.0)
    found = tracker.update([[(0.0, 0.0), (0.1, 0.1), (0.2, 0.2)], [(0.0, 0.0)], [], BOX], 0.1)
    assert len(found) == 1 and tracker.flat == 3
    assert tracker.unseen_s.tolist() == [0.0]
    tracker.update([[]], 0.2)
    assert tracker.flat == 4
    assert ObjectTracker().update([[], BOX], 0.0, ids=[5, 7]).ids.tolist() == [7]


def test_what_is_collected_is_what_the_planners_take() -> None:
    rng, tracker = np.random.default_rng(4), ObjectTracker()
    for step in range(30):
        seen = [
            sighting(FLOE, (2.0 * k, 0.0, 0.1 * step), rng, 0.02)
            for k in range(6)
            if rng.random() < 0.8
        ]
        found = tracker.update(seen, 0.1 * step)
        assert Movables(**{name: getattr(found, name) for name in found.__dataclass_fields__})
    assert len(found) == 6


@pytest.mark.parametrize(
    ("polygons", "stamp", "ids", "message"),
    [
        ([BOX], math.nan, None, "stamp must be finite"),
        ([BOX * math.nan], 1.0, None, r"polygons\[0\] must be finite"),
        ([BOX, "box"], 1.0, None, r"polygons\[1\] must be an array"),
        (None, 1.0, None, "polygons must be a list"),
        ([BOX], 1.0, [1, 2], "ids must have shape"),
        ([BOX, BOX], 1.0, [1, 1], "ids must be distinct"),
    ],
)
def test_bad_input_is_refused_and_forgotten(
    polygons: Any, stamp: float, ids: Any, message: str
) -> None:
    tracker = ObjectTracker()
    before = tracker.update([BOX], 0.0)
    with pytest.raises(InvalidInputError, match=message):
        tracker.update(polygons, stamp, ids)
    assert tracker.movables is before and tracker.time == 0.0


@pytest.mark.parametrize("bad", [{"gate": 0.0}, {"keep": -1.0}, {"confirm": 0}, {"wheeled": 1}])
def test_bad_settings_are_refused(bad: dict[str, Any]) -> None:
    with pytest.raises(InvalidInputError, match=next(iter(bad))):
        ObjectTracker(**bad)


@settings(max_examples=20)
@given(st.integers(0, 10**6))
@example(3341)  # an outline whose parts overlap in a triangle without area
def test_whatever_is_seen_gives_valid_objects(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tracker = ObjectTracker(confirm=int(rng.integers(1, 4)), keep=float(rng.uniform(0.0, 1.0)))
    size, origin = 10.0 ** rng.uniform(-3.0, 3.0), rng.uniform(-1.0, 1.0, 2) * 1e5
    labelled, stamp = bool(rng.random() < 0.5), 0.0
    for _ in range(8):
        stamp += float(rng.choice([0.0, 1e-6, 0.1, 3.0]))
        seen = []
        for _ in range(int(rng.integers(0, 6))):
            corners = rng.normal(size=(int(rng.integers(0, 9)), 2))
            if rng.random() < 0.2:
                corners = corners.round()  # repeated corners, corners on one line
            seen.append(origin + size * (corners + rng.integers(0, 4, 2) * (rng.random() < 0.8)))
        ids = rng.permutation(8)[: len(seen)] if labelled else None
        found = tracker.update(seen, stamp, ids)
        names = [field.name for field in fields(Movables)]
        assert Movables(**{name: getattr(found, name) for name in names}) == found
        assert len(tracker.unseen_s) == len(found)


def test_a_concave_object_keeps_its_shape() -> None:
    corner = np.array([[0.0, 0.0], [0.6, 0.0], [0.6, 0.2], [0.2, 0.2], [0.2, 0.6], [0.0, 0.6]])
    square = np.array([[0.0, 0.0], [0.4, 0.0], [0.4, 0.4], [0.0, 0.4]])
    rng = np.random.default_rng(0)
    tracker = ObjectTracker()
    for step in range(30):
        angle, place = 0.03 * step, np.array([0.02 * step, 1.0])
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        true = corner @ turn + place
        seen = [outline + rng.normal(0.0, 0.005, outline.shape) for outline in (true, square + 3.0)]
        found = tracker.update(seen, 0.1 * step)
    union = shapely.union_all([shapely.Polygon(part) for part in found.parts_world(0)])
    whole = shapely.Polygon(true)
    assert union.intersection(whole).area > 0.93 * union.union(whole).area
    assert len(found.parts(0)) > 1 and len(found.parts(1)) == 1
    np.testing.assert_allclose(
        found.poses[0, :2], shapely.get_coordinates(whole.centroid)[0], atol=0.01
    )
