"""`Track`: one object over time."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence

import numpy as np

from pushplan.perception.contour_alignment import Contour, align, resampled
from pushplan.perception.sighting import Sighting

_MOST_SIGHTINGS = 100  # over so many a shape is averaged
_LEAST_NOISE = 1e-4  # standard deviation of a corner [radii]
_FIRST_NOISE = 0.03  # the same before a second sighting [radii]
_SPREAD = 0.15  # of a heading, besides what the filter says [rad]
_COASTING = 0.3  # time constant with which an unseen object comes to rest [s]


class Axis:
    """Kalman filter of a quantity and its rate, driven by white accelerations.

    Args:
        acceleration: standard deviation of the acceleration [units/s²].
        variance: of the first observation.
    """

    def __init__(self, acceleration: float, variance: float) -> None:
        self.acceleration = acceleration
        self.restart(variance)

    def restart(self, variance: float) -> None:
        """Know a place and that the object rests, or nearly."""
        self.variance = variance
        self.shared = 0.0
        self.of_rate = 0.0

    def predict(self, step: float) -> None:
        """Pass some time [s]."""
        q = self.acceleration**2
        self.variance += step * (2.0 * self.shared + step * (self.of_rate + q * step * step / 4.0))
        self.shared += step * (self.of_rate + q * step * step / 2.0)
        self.of_rate += q * step * step

    def slow(self, stays: float) -> None:
        """Come nearer to rest: only a part of the rate stays."""
        self.shared *= stays
        self.of_rate *= stays * stays

    def correct(self, variance: float) -> tuple[float, float]:
        """Gains for the quantity and for its rate [1/s], given the variance of an observation."""
        total = self.variance + variance
        gain = self.variance / total
        rate_gain = self.shared / total
        self.of_rate -= rate_gain * self.shared
        self.shared -= gain * self.shared
        self.variance -= gain * self.variance
        return gain, rate_gain


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
        self.centre = first.centre
        self.heading = 0.0
        self.middle = 0j  # centroid of the shape's hull, in the frame of the body
        self.velocity = 0j
        self.turn_rate = 0.0
        self.shape = first.contour - first.centre
        self.radius = float(np.abs(self.shape).max())
        self.variance = (_FIRST_NOISE * self.radius) ** 2
        self.sightings = 1
        self.votes = 1
        self.seen_at = self.time = time
        self.place = Axis(accelerations[0], self.variance / len(self.shape))
        away = self.shape - self.shape.mean()
        self.direction = Axis(accelerations[1], self.variance / float(np.vdot(away, away).real))

    def predict(self, time: float) -> None:
        """Move on as before; an object that was not seen lately comes to rest."""
        step = time - self.time
        if self.time > self.seen_at:
            stays = math.exp(-step / _COASTING)
            self.velocity *= stays
            self.turn_rate *= stays
            self.place.slow(stays)
            self.direction.slow(stays)
        self.centre += step * self.velocity
        self.heading += step * self.turn_rate
        self.place.predict(step)
        self.direction.predict(step)
        self.time = time

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
        gain, rate_gain = self.place.correct(noise / points)
        away = centre - self.centre
        self.centre += gain * away
        self.velocity += rate_gain * away
        gain, rate_gain = self.direction.correct(noise / moment)
        self.heading += gain * turn
        self.turn_rate += rate_gain * turn
        self.seen_at = self.time

    def jump(self, centre: complex) -> None:
        """Expect the object elsewhere, where it lies in any direction."""
        self.velocity = 0j
        self.turn_rate = 0.0
        self.centre = centre
        self.place.restart(self.radius**2)
        self.direction.restart(math.pi**2)

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
            np.array([math.sqrt(_SPREAD**2 + one.direction.variance) for one in some]),
            sampled=not corners,
        )
        for k, *fit in zip(members, *(values.tolist() for values in found), strict=True):
            tracks[k].see(contours[k], *fit)
