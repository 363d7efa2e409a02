"""The tracker depends on seconds alone, not on how many snapshots come in them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pushplan.perception import ObjectTracker
from pushplan.world import Movables
from pushplan.world.outline import transform

Array = NDArray[np.float64]
BOX = np.array([(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)])
SPEED = 0.2  # [m/s]
DAY = 86400.0  # [s]


def places(time: float, count: int) -> Array:
    """(K, 3) of objects of which the first drives and turns, and the others stand."""
    k = np.arange(count)
    poses = np.column_stack([0.9 * k, 1.5 * (k % 2), np.zeros(count)])
    poses[0] += [SPEED * time, 0.0, 0.5 * time]
    return poses


def seen_for(
    tracker: ObjectTracker, rate: float, count: int, rng: np.random.Generator, noise: float
) -> float:
    """Let the tracker see the objects for two seconds, or four times; the time of the last."""
    times = np.arange(max(2.0 * rate, 4.0)) / rate
    for time in times.tolist():
        tracker.update(outlines(places(time, count), rng, noise), time)
    return float(times[-1])


def outlines(poses: Array, rng: np.random.Generator, noise: float) -> list[Array]:
    return [transform(pose, BOX) + noise * rng.normal(size=BOX.shape) for pose in poses]


@pytest.mark.parametrize("keep", [0.5, 5.0, math.inf])
@pytest.mark.parametrize("pause", [0.1, 1.0, 4.9, 5.1, 30.0, DAY])
@pytest.mark.parametrize("count", [2, 10])
def test_no_objects_swap_their_ids_in_a_pause(count: int, pause: float, keep: float) -> None:
    for rate, noise in ((1.0, 0.0), (10.0, 0.002), (100.0, 0.0)):
        rng, tracker = np.random.default_rng(0), ObjectTracker(keep=keep)
        last = seen_for(tracker, rate, count, rng, noise)
        owners = dict(enumerate(tracker.movables.ids.tolist()))
        poses = places(last, count)
        order = rng.permutation(count)
        found = tracker.update(outlines(poses[order], rng, noise), last + pause)
        assert len(found) == count
        for label, place in zip(found.ids.tolist(), found.poses, strict=True):
            k = int(np.argmin(np.hypot(*(poses[:, :2] - place[:2]).T)))
            assert label == owners[k] or label not in owners.values()


@settings(max_examples=30)
@given(
    pause=st.sampled_from([0.1, 0.7, 2.0, 4.0, 30.0, DAY]),
    parts=st.lists(st.floats(0.01, 0.99), max_size=8, unique=True),
    keep=st.sampled_from([0.0, 0.5, 5.0, math.inf]),
)
def test_empty_snapshots_and_none_are_alike(pause: float, parts: list[float], keep: float) -> None:
    results: list[Movables] = []
    for stamps in ([], sorted(parts)):
        rng, tracker = np.random.default_rng(1), ObjectTracker(keep=keep)
        last = seen_for(tracker, 10.0, 3, rng, 0.0)
        for part in stamps:
            tracker.update([], last + part * pause)
        results.append(tracker.update(outlines(places(last, 3), rng, 0.0), last + pause))
    once, often = results
    assert once.ids.tolist() == often.ids.tolist()
    np.testing.assert_array_equal(once.poses, often.poses)
    np.testing.assert_array_equal(once.twists, often.twists)


def test_an_unseen_object_comes_to_rest_in_one_step_or_in_many() -> None:
    ends = []
    for steps in (1, 7, 300):
        rng, tracker = np.random.default_rng(2), ObjectTracker(keep=math.inf)
        last = seen_for(tracker, 10.0, 1, rng, 0.0)
        for time in np.linspace(last, last + DAY, steps + 1)[1:].tolist():
            found = tracker.update([], time)
        ends.append(np.concatenate([found.poses[0], found.twists[0]]))
    np.testing.assert_allclose(ends[1:], [ends[0]] * 2, atol=1e-9)
    np.testing.assert_allclose(ends[0][3:], 0.0, atol=1e-9)
    rolled_on = ends[0][:3] - places(last, 1)[0]
    assert 0.0 < rolled_on[0] < SPEED and 0.0 < rolled_on[2] < 0.5


@pytest.mark.parametrize("rate", [1.0, 3.0, 10.0, 30.0, 100.0])
@pytest.mark.parametrize("jitter", [0.0, 0.4])
@pytest.mark.parametrize(("noise", "most"), [(0.0, 0.02), (0.002, 0.04)])
def test_speeds_are_right_at_any_rate_and_fall_to_zero_where_an_object_stops(
    rate: float, jitter: float, noise: float, most: float
) -> None:
    rng, tracker = np.random.default_rng(3), ObjectTracker()
    stop = 3.0
    time, before = 0.0, 0.0
    while time < stop + 3.0:
        pose = (SPEED * min(time, stop), 0.0, 0.5 * min(time, stop))
        found = tracker.update([transform(pose, BOX) + noise * rng.normal(size=BOX.shape)], time)
        speed, _, turn_rate = found.twists[0].tolist()
        if 0.5 <= before and time <= stop:
            assert speed == pytest.approx(SPEED, abs=most)
            assert turn_rate == pytest.approx(0.5, abs=0.05 if noise == 0.0 else 0.5)
        if time > stop:
            assert speed > -most
        if before >= stop + 0.5:
            assert abs(speed) < most
        before = time
        time += (1.0 + jitter * rng.uniform(-1.0, 1.0)) / rate


def test_an_object_that_speeds_up_lags_little() -> None:
    tracker = ObjectTracker()
    for time in (0.1 * np.arange(20)).tolist():
        found = tracker.update([transform((0.25 * time**2, 0.0, 0.0), BOX)], time)
    assert found.twists[0, 0] == pytest.approx(0.5 * time, abs=0.03)


def test_objects_that_come_back_have_their_own_places() -> None:
    tracker = ObjectTracker(keep=0.0)
    boxes = [transform((float(k), 0.0, 0.0), BOX) for k in range(4)]
    for step, hidden in enumerate([(), (1,), (0, 2), (3,), (), (1, 2), ()]):
        seen = [box for k, box in enumerate(boxes) if k not in hidden]
        found = tracker.update(seen, 0.1 * step)
        assert sorted(found.ids.tolist()) == [k for k in range(4) if k not in hidden]
        assert found.poses[:, 0] == pytest.approx(found.ids, abs=1e-9)
        assert tracker.unseen_s.tolist() == [0.0] * len(found)


def test_after_nothing_was_seen_for_long_all_is_believed_at_once() -> None:
    tracker = ObjectTracker(confirm=3, keep=2.0)
    far = transform((1.0, 0.0, 0.0), BOX)
    tracker.update([BOX], 0.0)
    assert len(tracker.update([far, BOX], 1.0)) == 1
    assert tracker.update([far, BOX], 10.0).ids.tolist() == [1, 2]
