"""Shortest paths of bounded curvature, under the names of the package ``dubins``.

The original's ship planner imports that package, whose only release compiles on Python 3.8 and
older. `drivers.lattice` puts this module in its place.

Source: Shkel and Lumelsky, Classification of the Dubins set, 2001.
"""

from __future__ import annotations

import math
from math import acos, atan2, cos, pi, sin, sqrt

TURNS = {"L": 1.0, "S": 0.0, "R": -1.0}


class DubinsPath:
    """Three pieces of a path.

    Args:
        start: x, y [m], heading [rad].
        radius: of the turns [m].
        word: the pieces, of L, S and R.
        lengths: of the pieces, in radii.
    """

    def __init__(self, start: tuple, radius: float, word: str, lengths: tuple) -> None:
        self._start = start
        self._radius = radius
        self._word = word
        self._lengths = lengths

    def path_length(self) -> float:
        """[m]."""
        return sum(self._lengths) * self._radius

    def sample_many(self, step: float) -> tuple[list, list]:
        """Poses from the start on, a step [m] apart, without the end; and their distances."""
        distances = [k * step for k in range(math.ceil(self.path_length() / step))]
        return [self.sample(distance) for distance in distances], distances

    def sample(self, distance: float) -> tuple[float, float, float]:
        """The pose after a distance [m]."""
        x, y, heading = self._start
        left = distance / self._radius
        for kind, length in zip(self._word, self._lengths, strict=True):
            piece = min(left, length)
            turn = TURNS[kind]
            left -= piece
            if turn:
                x += self._radius * turn * (sin(heading + turn * piece) - sin(heading))
                y -= self._radius * turn * (cos(heading + turn * piece) - cos(heading))
                heading += turn * piece
            else:
                x += self._radius * piece * cos(heading)
                y += self._radius * piece * sin(heading)
        return x, y, heading % (2.0 * pi)


def shortest_path(start: tuple, end: tuple, radius: float) -> DubinsPath:
    """The shortest of the six kinds."""
    dx = end[0] - start[0]
    dy = end[1] - start[1]
    along = atan2(dy, dx)
    d = math.hypot(dx, dy) / radius
    found = words(wrapped(start[2] - along), wrapped(end[2] - along), d)
    word = min(found, key=lambda one: sum(found[one]))
    return DubinsPath(tuple(start), radius, word, found[word])


def words(a: float, b: float, d: float) -> dict[str, tuple[float, float, float]]:
    """Lengths of the pieces of every word that exists, from heading a to b over a distance d."""
    found = {}
    ca = cos(a)
    cb = cos(b)
    sa = sin(a)
    sb = sin(b)
    near = cos(a - b)
    if (square := 2.0 + d * d - 2.0 * near + 2.0 * d * (sa - sb)) >= 0.0:
        tangent = atan2(cb - ca, d + sa - sb)
        found["LSL"] = (wrapped(tangent - a), sqrt(square), wrapped(b - tangent))
    if (square := 2.0 + d * d - 2.0 * near + 2.0 * d * (sb - sa)) >= 0.0:
        tangent = atan2(ca - cb, d - sa + sb)
        found["RSR"] = (wrapped(a - tangent), sqrt(square), wrapped(tangent - b))
    if (square := -2.0 + d * d + 2.0 * near + 2.0 * d * (sa + sb)) >= 0.0:
        tangent = atan2(-ca - cb, d + sa + sb) - atan2(-2.0, sqrt(square))
        found["LSR"] = (wrapped(tangent - a), sqrt(square), wrapped(tangent - b))
    if (square := -2.0 + d * d + 2.0 * near - 2.0 * d * (sa + sb)) >= 0.0:
        tangent = atan2(ca + cb, d - sa - sb) - atan2(2.0, sqrt(square))
        found["RSL"] = (wrapped(a - tangent), sqrt(square), wrapped(b - tangent))
    if abs(cosine := (6.0 - d * d + 2.0 * near + 2.0 * d * (sa - sb)) / 8.0) <= 1.0:
        middle = wrapped(2.0 * pi - acos(cosine))
        first = wrapped(a - atan2(ca - cb, d - sa + sb) + middle / 2.0)
        found["RLR"] = (first, middle, wrapped(a - b - first + middle))
    if abs(cosine := (6.0 - d * d + 2.0 * near + 2.0 * d * (sb - sa)) / 8.0) <= 1.0:
        middle = wrapped(2.0 * pi - acos(cosine))
        first = wrapped(-a - atan2(ca - cb, d + sa - sb) + middle / 2.0)
        found["LRL"] = (first, middle, wrapped(b - a - first + middle))
    return found


def wrapped(angle: float) -> float:
    """In [0, 2 pi); 0 for what is a full turn but for rounding."""
    found = angle % (2.0 * pi)
    return 0.0 if found > 2.0 * pi - 1e-9 else found
