"""Rotation and translation between two closed contours, their corners in any cyclic order."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pushplan.world.checks import FloatArray

Contour = NDArray[np.complex128]
"""(N,) corners x + iy [m], counter-clockwise."""
SAMPLES = 64
"""Points of equal arc length for contours whose numbers of corners differ."""


class Alignment(NamedTuple):
    """Where a shape lies in the world, by least squares.

    Args:
        centre: of the shape's frame, x + iy [m].
        turn: heading less the expected one, in [-pi, pi] [rad].
        corners: (N,) seen corners in the order of the shape's; None if they do not correspond.
        variance: mean square of the distances that are left, for one coordinate [m²].
        moment: sum of squared distances of the shape's points from their mean [m²].
        points: how many points were compared.
    """

    centre: complex
    turn: float
    corners: Contour | None
    variance: float
    moment: float
    points: int


def align(
    shape: Contour, seen: Contour, expected: float, variance: float, spread: float
) -> Alignment:
    """Find the pose of a shape in a seen contour.

    For every cyclic order of the corners the best rotation is the argument of a correlation
    (Umeyama 1991 in the plane, with complex numbers), and one Fourier transform gives them all.
    Of orders that fit, the one that turns least from the expected heading wins: the likelihood
    of the contour, for white noise at the corners, times a normal distribution of the heading.

    Args:
        shape: (N,) in the frame of the body.
        seen: (M,) in the world frame.
        expected: heading [rad].
        variance: of one coordinate of a seen corner [m²], positive.
        spread: standard deviation of the heading about the expected one [rad].
    """
    same = len(shape) == len(seen)
    body, world = (shape, seen) if same else (resampled(shape), resampled(seen))
    middle, place = body.mean(), world.mean()
    body, world = body - middle, world - place
    product = np.fft.fft(world) * np.conj(np.fft.fft(body))
    correlation = np.fft.ifft(product)
    turned = np.exp(-1j * expected)
    moment, other = _energy(body), _energy(world)
    left = moment + other - 2.0 * np.abs(correlation)
    turns = np.angle(correlation * turned)
    order = int(np.argmin(0.5 * left / variance + 0.5 * (turns / spread) ** 2))
    best = complex(correlation[order])
    if not same:
        best = _between_samples(product, np.abs(correlation), order)
    turn = float(np.angle(best * turned))
    rest = max(moment + other - 2.0 * abs(best), 0.0) / (2 * len(body))
    rotation = np.exp(1j * (expected + turn))
    centre = complex(place - rotation * middle)
    return Alignment(centre, turn, np.roll(seen, -order) if same else None, rest, moment, len(body))


def _energy(points: Contour) -> float:
    return float(np.vdot(points, points).real)


def _between_samples(product: Contour, sizes: FloatArray, order: int) -> complex:
    """The correlation at its peak, which lies up to half a sample from ``order``."""
    count = len(sizes)
    before, here, after = sizes[order - 1], sizes[order], sizes[(order + 1) % count]
    bend = before - 2.0 * here + after
    shift = order + (0.5 * (before - after) / bend if bend < 0.0 else 0.0)
    phases = np.exp(2j * math.pi * np.fft.fftfreq(count) * shift)
    return complex((product * phases).mean())


def resampled(contour: Contour) -> Contour:
    """`SAMPLES` points of equal arc length on a contour."""
    closed = np.append(contour, contour[0])
    lengths = np.append(0.0, np.cumsum(np.abs(np.diff(closed))))
    at = np.arange(SAMPLES) * (lengths[-1] / SAMPLES)
    points: Contour = np.interp(at, lengths, closed)
    return points
