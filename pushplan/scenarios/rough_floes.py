"""Floes with rough outlines and bays, as cameras and satellites see them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pushplan.world.checks import FloatArray
from pushplan.world.outline import ConvexParts, centroid
from pushplan.world.outline_repair import outline_parts

MOST_ROUGHNESS = 0.4
"""With more, floes would be stars."""
_EDGE_RADII = 0.06  # length of an edge, in mean radii of the field
_CORNERS = (24, 300)
_LEAST_EDGES = 8  # of a wave: small floes are smoother than large ones
_DECAY = 1.7  # of their amplitudes with the number of periods
_MOST_BAYS = 3
_BAY_DEPTHS = (3.0, 10.0)  # in standard deviations of the waves
_BAY_WIDTHS = (0.12, 0.4)  # [rad]
_DEEPEST = 0.7  # [distance from the middle to the convex outline]


def roughened(
    rng: np.random.Generator, floes: Sequence[FloatArray], roughness: float, mean_radius: float
) -> list[ConvexParts]:
    """Carve rough outlines out of convex floes; what is left of each lies inside of it.

    The distance of the outline from the middle of a floe falls short of that of the convex one by
    a random function of the angle: waves whose amplitudes fall with their frequency, and up to
    three bays.

    Args:
        rng: the only source of randomness.
        floes: convex outlines, each (N, 2) [m].
        roughness: fraction of the area of each floe that is carved away.
        mean_radius: of the floes of the field [m]; edges are a small part of it.

    Returns:
        The convex parts of each floe.
    """
    return [
        outline_parts("floe", _rough_outline(rng, floe, roughness, mean_radius), smooth=True).parts
        for floe in floes
    ]


def _rough_outline(
    rng: np.random.Generator, floe: FloatArray, roughness: float, mean_radius: float
) -> FloatArray:
    middle = centroid(floe)
    length = np.hypot(*(np.roll(floe, -1, axis=0) - floe).T).sum()
    count = int(np.clip(length / (_EDGE_RADII * mean_radius), *_CORNERS))
    angles = 2.0 * np.pi * (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / count
    reach = _distances(floe - middle, angles)
    depth = _depths(rng, angles)
    # least t for which the area of radii (1 - t depth) reach is 1 - roughness of what it was
    once = (reach**2 * depth).sum()
    twice = (reach**2 * depth**2).sum()
    lost = roughness * (reach**2).sum()
    root = np.sqrt(max(0.0, once**2 - twice * lost))
    share = np.minimum(_DEEPEST, (once - root) / twice * depth)
    radii = reach * (1.0 - share)
    outline: FloatArray = np.stack([np.cos(angles), np.sin(angles)], axis=1) * radii[:, None]
    return middle + outline


def _depths(rng: np.random.Generator, angles: FloatArray) -> FloatArray:
    """Depths (N,) of the outline at some angles, relative to each other; the least is 0."""
    periods = np.arange(2.0, max(3, len(angles) // _LEAST_EDGES))
    amplitudes = rng.standard_normal(len(periods)) * periods**-_DECAY
    phases = rng.uniform(0.0, 2.0 * np.pi, len(periods))
    waves = (amplitudes * np.cos(np.outer(angles, periods) + phases)).sum(axis=1)
    depth: FloatArray = (waves - waves.min()) / waves.std()
    for _ in range(int(rng.integers(_MOST_BAYS + 1))):
        turn = np.angle(np.exp(1j * (angles - rng.uniform(0.0, 2.0 * np.pi))))
        depth += rng.uniform(*_BAY_DEPTHS) * np.exp(-((turn / rng.uniform(*_BAY_WIDTHS)) ** 2))
    return depth


def _distances(outline: FloatArray, angles: FloatArray) -> FloatArray:
    """Distances (N,) from the origin to a convex outline around it, at some angles [m]."""
    edges = np.roll(outline, -1, axis=0) - outline
    normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1)
    offsets = (normals * outline).sum(axis=1)
    along = np.outer(np.cos(angles), normals[:, 0]) + np.outer(np.sin(angles), normals[:, 1])
    with np.errstate(divide="ignore"):
        reach: FloatArray = np.where(along > 0.0, offsets / along, np.inf)
    return np.asarray(reach.min(axis=1))
