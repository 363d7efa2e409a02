"""`Track`: one object over time."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely

from pushplan.perception.contour_alignment import Contour, align, resampled
from pushplan.world.checks import FloatArray
from pushplan.world.outline import flatten, next_corner

_FLAT = 1e-6  # least area of an outline [squared sides of the box around it]
_MOST_SIGHTINGS = 100  # over so many a shape is averaged
_LEAST_NOISE = 1e-4  # standard deviation of a corner [radii]
_FIRST_NOISE = 0.03  # the same before a second sighting [radii]
_SPREAD = 0.15  # of a heading, besides what the filter says [rad]
_LASTING = 0.02  # how long an acceleration lasts [s]
_SPEEDING = 0.2  # for how long an object may have accelerated before its first sighting [s]
_GOES_ON = 0.5  # time for which an unseen object moves on as before [s]
_COASTING = 0.2  # time constant with which it comes to rest then [s]


class Sighting(NamedTuple):
    """An outline in one snapshot: contour (N,), centre x + iy [m] and area [m²] of its hull."""

    contour: Contour
    centre: complex
    area: float
    label: int | None


def sightings_of(points: Sequence[FloatArray], labels: FloatArray | None) -> list[Sighting]:
    """Measure the outlines of a snapshot.

    Args:
        points: M outlines, each (N, 2) corners [m].
        labels: (M,) which object each one is of; None if that is not known.

    Returns:
        Those that have an area, in the same order.
    """
    closed = [i for i, corners in enumerate(points) if len(corners) >= 3]
    if not closed:
        return []
    vertices, offsets = flatten([points[i] for i in closed])
    counts = np.diff(offsets)
    starts = offsets[:-1]
    clouds = np.full(len(closed), shapely.MultiPoint())
    owners = np.repeat(np.arange(len(closed)), counts)
    shapely.multipoints(shapely.points(vertices), indices=owners, out=clouds)
    hulls = shapely.convex_hull(clouds)
    areas = shapely.area(hulls)
    centres = shapely.get_coordinates(shapely.centroid(hulls))
    shifted = vertices - np.repeat(vertices[starts], counts, axis=0)
    after = shifted[next_corner(offsets)]
    cross = shifted[:, 0] * after[:, 1] - shifted[:, 1] * after[:, 0]
    turns = np.add.reduceat(cross, starts)  # positive where corners run counter-clockwise
    boxes = np.maximum.reduceat(vertices, starts) - np.minimum.reduceat(vertices, starts)
    found = []
    for i in np.flatnonzero(areas > _FLAT * boxes.max(axis=1) ** 2).tolist():
        corners = points[closed[i]]
        if (corners[0] == corners[-1]).all():
            corners = corners[:-1]
        contour = corners[:, 0] + 1j * corners[:, 1]
        found.append(
            Sighting(
                contour if turns[i] >= 0.0 else contour[::-1],
                complex(*centres[i]),
                float(areas[i]),
                None if labels is None else int(labels[closed[i]]),
            )
        )
    return found


class Axis:
    """Kalman filter of a quantity and its rate, driven by white accelerations.

    The state is that of the last observation. Predictions depend on the time since then alone.

    Args:
        value: first observation of the quantity.
        variance: of the first observation.
        acceleration: standard deviation of the acceleration [units/s²].
        highest: standard deviation of the rate at the first observation [units/s].
    """

    def __init__(
        self, value: complex, variance: float, acceleration: float, highest: float = 0.0
    ) -> None:
        self._highest = highest
        self._noise = acceleration**2 * _LASTING
        self.restart(value, variance)

    def restart(self, value: complex, variance: float) -> None:
        """Know a value, and of the rate only its standard deviation."""
        self.value = value
        self.rate = 0j
        self._variance = variance
        self._shared = 0.0
        self._of_rate = self._highest**2

    def expected(self, seconds: float) -> tuple[complex, complex, float]:
        """Value, rate and variance of the value after a time without observations [s]."""
        steady = min(seconds, _GOES_ON)
        slowing = seconds - steady
        stays = math.exp(-slowing / _COASTING)
        reach = _COASTING * (1.0 - stays)
        noise = steady * (steady**2 / 3.0 + reach * (steady + reach))
        noise += _COASTING**2 * (slowing - 2.0 * reach) + 0.5 * _COASTING**3 * (1.0 - stays**2)
        reach += steady
        variance = self._variance + reach * (2.0 * self._shared + reach * self._of_rate)
        return self.value + reach * self.rate, stays * self.rate, variance + self._noise * noise

    def correct(self, value: complex, variance: float, seconds: float) -> None:
        """Take an observation with its variance, a time after the last one [s].

        An object that was unseen may have moved on all the time, so its rate is not taken to decay.
        """
        q = self._noise
        expected = self.value + seconds * self.rate
        ahead = self._shared + seconds * self._of_rate
        before = self._variance + seconds * (self._shared + ahead) + q * seconds**3 / 3.0
        shared = ahead + q * seconds**2 / 2.0
        of_rate = self._of_rate + q * seconds
        total = before + variance
        gain = before / total
        # The mean rate since the last observation bounds the correction. A higher gain, which is
        # best for white accelerations, overshoots where an object stops at once.
        rate_gain = shared / total
        if seconds * shared > before:
            rate_gain = gain / seconds
        self._variance = (1.0 - gain) * before
        self._shared = (1.0 - gain) * shared
        self._of_rate = of_rate - rate_gain * (2.0 * shared - rate_gain * total)
        self.value = expected + gain * (value - expected)
        self.rate += rate_gain * (value - expected)


class Track:
    """Shape, pose and velocity of an object that is seen again and again.

    Args:
        label: of the object.
        first: its first sighting.
        time: of that [s].
        accelerations: standard deviations [m/s²] and [rad/s²].
    """

    def __init__(
        self, label: int, first: Sighting, time: float, accelerations: tuple[float, float]
    ) -> None:
        self.label = label
        self.area = first.area
        self.middle = 0j  # centroid of the shape's hull, in the frame of the body
        self.shape = first.contour - first.centre
        self.radius = float(np.abs(self.shape).max())
        self.variance = (_FIRST_NOISE * self.radius) ** 2
        self.sightings = 1
        self.votes = 1
        self.seen_at = time
        away = self.shape - self.shape.mean()
        of_heading = self.variance / float(np.vdot(away, away).real)
        fast = _SPEEDING * accelerations[0]
        self._place = Axis(first.centre, self.variance / len(self.shape), accelerations[0], fast)
        # A high turn rate would let a square spin by a quarter of a turn between two snapshots.
        self._direction = Axis(0.0, of_heading, accelerations[1])
        self.predict(time)

    def predict(self, time: float) -> None:
        """Expect the object where it is at a time [s]; if not seen lately, it comes to rest."""
        self.time = time
        unseen = time - self.seen_at
        self.centre, self.velocity, self.place_variance = self._place.expected(unseen)
        heading, turn_rate, self.heading_variance = self._direction.expected(unseen)
        self.heading = heading.real
        self.turn_rate = turn_rate.real

    def see(
        self,
        seen: Contour,
        centre: complex,
        turn: float,
        order: int,
        variance: float,
        moment: float,
    ) -> None:
        """Take in a contour (M,) of this object, seen now, by its fields of `Alignments`."""
        points = min(len(self.shape), len(seen))
        self._average(seen, centre, self.heading + turn, order)
        self.sightings += 1
        if len(self.shape) == len(seen):
            least = (_LEAST_NOISE * self.radius) ** 2
            part = 1.0 / min(max(self.sightings - 1, 1), 20)
            self.variance += part * (max(variance, least) - self.variance)
        noise = max(self.variance, variance)
        seconds = self.time - self.seen_at
        self._place.correct(centre, noise / points, seconds)
        self._direction.correct(self.heading + turn, noise / moment, seconds)
        self.seen_at = self.time
        self.predict(self.time)

    def jump(self, centre: complex) -> None:
        """Expect the object elsewhere, where it lies in any direction."""
        self._place.restart(centre, self.radius**2)
        self._direction.restart(self.heading, math.pi**2)
        self.seen_at = self.time
        self.predict(self.time)

    def _average(self, seen: Contour, centre: complex, heading: float, order: int) -> None:
        """Bring the shape nearer to what is seen; the number of corners is a majority vote."""
        into_body = cmath.exp(-1j * heading)
        if len(self.shape) == len(seen):
            self.votes = min(self.votes + 1, _MOST_SIGHTINGS)
            part = 1.0 / min(self.sightings + 1, _MOST_SIGHTINGS)
            corners = np.concatenate([seen[order:], seen[:order]])
            self.shape = self.shape + part * ((corners - centre) * into_body - self.shape)
            return
        self.votes -= 1
        if self.votes < 0:
            self.shape = (seen - centre) * into_body
            self.votes = 1
            self.sightings = 0


def see_all(tracks: Sequence[Track], contours: Sequence[Contour]) -> None:
    """Take in a contour of each of some tracks; all with equal numbers of corners at once."""
    groups: dict[int, list[int]] = {}
    for k, (track, seen) in enumerate(zip(tracks, contours, strict=True)):
        same = len(track.shape) == len(seen)
        groups.setdefault(len(seen) if same else 0, []).append(k)
    for corners, members in groups.items():
        some = [tracks[k] for k in members]
        shapes = [one.shape for one in some]
        seen_there = [contours[k] for k in members]
        if not corners:
            shapes = [resampled(shape) for shape in shapes]
            seen_there = [resampled(seen) for seen in seen_there]
        found = align(
            np.array(shapes),
            np.array(seen_there),
            np.array([one.heading for one in some]),
            np.array([one.variance for one in some]),
            np.array([math.sqrt(_SPREAD**2 + one.heading_variance) for one in some]),
            sampled=not corners,
        )
        for k, *fit in zip(members, *(values.tolist() for values in found), strict=True):
            tracks[k].see(contours[k], *fit)
