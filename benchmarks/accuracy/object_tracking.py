"""How well `ObjectTracker` follows objects whose outlines have noise at every corner.

    python -m benchmarks.accuracy.object_tracking [SECONDS] [--hidden FRACTION] [--seed N]

Boxes of 8 cm and convex outlines of up to 8 corners as large, 16 cm apart, go about their places
and turn (up to 0.1 m/s and 1 rad/s), seen at 10 Hz in random order, from any corner on. Errors are
root mean squares from the third second on; CPU time of one thread.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np
import shapely

from benchmarks.reporting import command_line
from pushplan.perception import ObjectTracker
from pushplan.perception.contour_alignment import align, resampled
from pushplan.world import InvalidInputError, Movables
from pushplan.world.checks import FloatArray
from pushplan.world.outline import centroid, transform

# [s]
PERIOD = 0.1
SETTLED = 3.0
# distance of neighbours, half the side of a box [m]
PITCH = 0.16
SIZE = 0.04
NOISES = (0.001, 0.002, 0.005, 0.01, 0.02)
COUNTS = (5, 20, 100)


class Scene:
    """Objects that move as the time says."""

    def __init__(self, count: int, rng: np.random.Generator) -> None:
        side = int(np.ceil(np.sqrt(count)))
        self.places = PITCH * np.array([divmod(k, side) for k in range(count)], dtype=float)
        square = SIZE * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
        self.outlines = [square if k % 2 else _outline(rng) for k in range(count)]
        self.rates = rng.uniform(-1.0, 1.0, count)  # [rad/s]
        self.speeds = rng.uniform(0.0, 0.1, count)  # [m/s]
        self.phases = rng.uniform(0.0, 2.0 * np.pi, count)

    def poses(self, stamp: float) -> FloatArray:
        """(K, 3) of all objects: on circles of 1 cm, all carried along with 5 cm/s."""
        angles = self.phases + self.speeds * stamp / 0.01
        away = 0.01 * np.column_stack([np.cos(angles), np.sin(angles)])
        return np.column_stack([self.places + away + [0.05 * stamp, 0.0], self.rates * stamp])


class Score(NamedTuple):
    """What came out of one run."""

    refused: float  # fraction of the snapshots that `Movables.from_polygons` refuses
    switches: float  # for a thousand sightings
    extra: int  # objects that do not exist
    place: float  # error [mm]
    raw_place: float  # of the centroid of what is seen [mm]
    heading: float  # error [deg]
    shape: float  # area between an outline and the true one, laid on each other [%]
    median: float  # of an update [ms]
    slowest: float  # [ms]


def _outline(rng: np.random.Generator) -> FloatArray:
    corners = np.sort(rng.uniform(0.0, 2.0 * np.pi, 8))
    points = 1.2 * SIZE * np.column_stack([np.cos(corners), np.sin(corners)])
    hull = shapely.MultiPoint(points).convex_hull
    ring = np.array(shapely.normalize(hull).exterior.reverse().coords[:-1])
    return ring - centroid(ring) if hull.area > SIZE**2 else _outline(rng)


def run(count: int, noise: float, seconds: float, hidden: float, seed: int) -> Score:
    """Track ``count`` objects with a standard deviation ``noise`` [m] of each corner."""
    rng = np.random.default_rng(seed)
    scene = Scene(count, rng)
    tracker = ObjectTracker()
    owner: dict[int, int] = {}
    offsets: list[list[float]] = [[] for _ in range(count)]
    places = []
    raw_places = []
    times = []
    switches = sightings = refused = 0
    stamps = np.arange(0.0, seconds, PERIOD)
    for stamp in stamps.tolist():
        poses = scene.poses(stamp)
        order = rng.permutation(count)
        if stamp > 0.0:
            order = order[rng.random(count) >= hidden]
        seen = []
        for k in order.tolist():
            exact = transform(poses[k], scene.outlines[k])
            corners = exact + noise * rng.normal(size=exact.shape)
            seen.append(np.roll(corners, int(rng.integers(len(corners))), axis=0))
            raw_places.append(centroid(corners) - poses[k, :2])
        refused += 1
        with suppress(InvalidInputError):
            Movables.from_polygons(seen)
            refused -= 1
        began = time.thread_time()
        found = tracker.update(seen, stamp)
        times.append(time.thread_time() - began)
        fresh = np.flatnonzero(tracker.unseen_s == 0.0)
        for j in fresh.tolist():
            k = int(np.argmin(np.hypot(*(poses[:, :2] - found.poses[j, :2]).T)))
            label = int(found.ids[j])
            switches += owner.setdefault(label, k) != k
            owner[label] = k
            sightings += 1
            if stamp >= SETTLED:
                places.append(found.poses[j, :2] - poses[k, :2])
                offsets[k].append(found.poses[j, 2] - poses[k, 2])
    headings = [np.array(some) - np.median(some) for some in offsets if some]
    shapes = []
    for j, label in enumerate(found.ids.tolist()):
        k = owner[label]
        if offsets[k]:
            shapes.append(_difference(found.outline(j), scene.outlines[k], np.median(offsets[k])))
    return Score(
        refused / len(stamps),
        1000.0 * switches / max(sightings, 1),
        len(found) - count,
        1e3 * _rms(places),
        1e3 * _rms(raw_places),
        float(np.degrees(_rms(headings))),
        100.0 * float(np.mean(shapes)),
        1e3 * float(np.median(times)),
        1e3 * float(np.max(times[1:])),
    )


def _difference(outline: FloatArray, truth: FloatArray, heading: float) -> float:
    """Area between an outline, laid on the true one, and that [areas of the true one]."""
    one, other = (resampled(points @ np.array([1.0, 1.0j])) for points in (outline, truth))
    fit = align(
        one[None],
        other[None],
        np.array([-heading]),
        np.full(1, 1e-6),
        np.full(1, 0.1),
        sampled=True,
    )
    centre = fit.centres[0]
    turn = -heading + float(fit.turns[0])
    laid = shapely.Polygon(transform((centre.real, centre.imag, turn), outline))
    real = shapely.Polygon(truth)
    return float(laid.symmetric_difference(real).area / real.area)


def _rms(values: Sequence[FloatArray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate([np.ravel(one) for one in values]) ** 2)))


def main() -> None:
    parser = command_line(__doc__, seed=1000)
    parser.add_argument("seconds", type=float, nargs="?", default=12.0)
    parser.add_argument("--hidden", type=float, default=0.0, help="fraction not seen each time")
    options = parser.parse_args()
    print(
        "| objects | noise [mm] | refused before | switches / 1000 | extra | place [mm] (raw) "
        "| heading [deg] | shape [%] | update [ms] (worst) |"
    )
    print("|--:|--:|--:|--:|--:|--:|--:|--:|--:|")
    for count in COUNTS:
        for noise in NOISES:
            s = run(count, noise, options.seconds, options.hidden, options.seed)
            print(
                f"| {count} | {1e3 * noise:g} | {s.refused:.0%} | {s.switches:.2f} | {s.extra} "
                f"| {s.place:.1f} ({s.raw_place:.1f}) | {s.heading:.1f} | {s.shape:.1f} "
                f"| {s.median:.1f} ({s.slowest:.1f}) |",
                flush=True,
            )


if __name__ == "__main__":
    main()
