"""Rotation and translation between closed contours, their corners in any cyclic order."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pushplan.world.checks import FloatArray, IntArray

Contour = NDArray[np.complex128]
"""(..., N) corners x + iy [m], counter-clockwise."""
SAMPLES = 64
"""Points of equal arc length for contours whose numbers of corners differ."""


class Alignments(NamedTuple):
    """Placements of G shapes in the world, by least squares."""

    centres: Contour  # (G,) of the shapes' frames, x + iy [m]
    turns: FloatArray  # (G,) heading less the expected one, in [-pi, pi] [rad]
    orders: IntArray  # (G,) the seen corner that is the first one of the shape
    variances: FloatArray  # (G,) mean square of what is left, for one coordinate [m²]
    moments: FloatArray  # (G,) sum of squared distances of the points from their mean [m²]


def align(
    shapes: Contour,
    seen: Contour,
    expected: FloatArray,
    variances: FloatArray,
    spreads: FloatArray,
    *,
    sampled: bool = False,
) -> Alignments:
    """Find the poses of shapes in seen contours.

    For every cyclic order of the corners the best rotation is the argument of a correlation
    (Umeyama 1991 in the plane, with complex numbers), and one Fourier transform gives them all.
    Of orders that fit, the one that turns least from the expected heading wins: the likelihood
    of the contour, for white noise at the corners, times a normal distribution of the heading.

    Args:
        shapes: (G, N) in the frames of the bodies.
        seen: (G, N) in the world frame.
        expected: (G,) headings [rad].
        variances: (G,) of one coordinate of a seen corner [m²], positive.
        spreads: (G,) standard deviations of the headings about the expected ones [rad].
        sampled: the points are samples, which correspond only nearly.
    """
    count = shapes.shape[1]
    each = np.arange(len(shapes))
    middles = shapes.mean(axis=1)
    places = seen.mean(axis=1)
    body = shapes - middles[:, None]
    world = seen - places[:, None]
    product = np.fft.fft(world) * np.conj(np.fft.fft(body))
    correlation = np.fft.ifft(product)  # (G, N), one for each order
    moments = (np.abs(body) ** 2).sum(axis=1)
    others = (np.abs(world) ** 2).sum(axis=1)
    sizes = np.abs(correlation)
    ahead = np.exp(-1j * expected)
    left = (moments + others)[:, None] - 2.0 * sizes
    turns = np.angle(correlation * ahead[:, None])
    cost = left / variances[:, None] + (turns / spreads[:, None]) ** 2
    orders = np.argmin(cost, axis=1)
    best = correlation[each, orders]
    if sampled:  # the peak lies up to half a sample away
        before = sizes[each, orders - 1]
        here = sizes[each, orders]
        after = sizes[each, (orders + 1) % count]
        bend = np.minimum(before - 2.0 * here + after, -1e-300)
        shift = orders + np.clip(0.5 * (before - after) / bend, -0.5, 0.5)
        phases = np.exp(2j * np.pi * np.fft.fftfreq(count) * shift[:, None])
        best = (product * phases).mean(axis=1)
    turn = np.angle(best * ahead)
    rest = np.maximum(moments + others - 2.0 * np.abs(best), 0.0) / (2 * count)
    centres = places - np.exp(1j * (expected + turn)) * middles
    return Alignments(centres, turn, orders, rest, moments)


def resampled(contour: Contour) -> Contour:
    """`SAMPLES` points of equal arc length on a contour (N,)."""
    closed = np.append(contour, contour[0])
    lengths = np.append(0.0, np.cumsum(np.abs(np.diff(closed))))
    at = np.arange(SAMPLES) * (lengths[-1] / SAMPLES)
    points: Contour = np.interp(at, lengths, closed)
    return points
