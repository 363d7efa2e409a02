"""What friction does to a push: the bumper's grip, and how the ground resists turning."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pushplan.world import InvalidInputError
from pushplan.world.checks import choice, number
from pushplan.world.outline import centroid, convex_outline

SUPPORTS = ("uniform", "inertia", "corners")
"""PathsFromStart in which a box may press on the ground, see `pressure_radius`."""
_RINGS = 64


@dataclass(frozen=True)
class PushParameters:
    """Friction of a push.

    Args:
        friction: coefficient between bumper and box.
        spread: c, the greatest torque over the greatest force of the ground, as a multiple of
            that under uniform pressure, so that it suits boxes of any size. Pymunk's boxes have
            1.07 (`spread_of`), a box that stands on its corners 1.85.
    """

    friction: float = 0.0
    spread: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "friction", number("friction", self.friction, low=0.0, high=10.0))
        spread = number("spread", self.spread, low=0.05, high=20.0)
        object.__setattr__(self, "spread", spread)


def pressure_radius(outline: ArrayLike, support: str = "uniform") -> float:
    """C = greatest torque / greatest force of the ground on a sliding box [m].

    Args:
        outline: (N, 2) convex corners [m].
        support: ``"uniform"`` pressure: mean distance from the centroid, 0.383 s of a square of
            side s and 2/3 R of a disc; ``"inertia"``: the root of inertia over mass, 0.408 s,
            which is how a planar engine that takes away a fraction of every velocity behaves;
            ``"corners"``: all weight on the corners, 0.707 s.

    Raises:
        InvalidInputError: if there is no such support or the outline is not convex.
    """
    choice("support", support, SUPPORTS)
    corners = convex_outline("outline", outline)
    corners = corners - centroid(corners)
    if support == "corners":
        return float(np.hypot(corners[:, 0], corners[:, 1]).mean())
    # triangles from the centroid: |r| is linear along rays, so only the angle needs quadrature
    total, weight = 0.0, 0.0
    nodes, weights = np.polynomial.legendre.leggauss(_RINGS)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        cross = float(a[0] * b[1] - a[1] * b[0])
        edge = a + 0.5 * (nodes[:, None] + 1.0) * (b - a)  # (64, 2)
        far = np.hypot(edge[:, 0], edge[:, 1])
        power = far if support == "uniform" else far**2
        fraction = 1.0 / 3.0 if support == "uniform" else 0.25
        total += fraction * cross * 0.5 * float(weights @ power)
        weight += 0.5 * cross
    mean = total / weight
    return mean if support == "uniform" else math.sqrt(mean)


def spread_of(support: str, outline: ArrayLike) -> float:
    """`PushParameters.spread` of an outline that presses on the ground like that."""
    return pressure_radius(outline, support) / pressure_radius(outline)


def stable_curvature(
    friction: float, *, reach: float, depth: float, half: float, c: float
) -> float:
    """Greatest |turn rate| / speed at which a box keeps still on a straight bumper [1/m].

    min(μ / (a + d), b / (c² + a (a + d))): beyond the first the box slides along the bumper,
    beyond the second it loses the line of contact (Lynch and Mason, IJRR 15(6), 1996; LaValle,
    Planning Algorithms, section 13.1.3; Tang et al., arXiv 2309.14295).

    Args:
        friction: μ between bumper and box.
        reach: d, from the axle to the bumper [m].
        depth: a, from the pushed face to the box's centre [m].
        half: b, half the contact's width less the box's offset from its middle [m].
        c: of the ground, see `pressure_radius` [m].

    Raises:
        InvalidInputError: if a length is not positive, or the friction negative.
    """
    number("friction", friction, low=0.0)
    for name, value in (("reach", reach), ("depth", depth), ("c", c)):
        number(name, value, low=0.0, open_low=True)
    if not math.isfinite(half):
        raise InvalidInputError(f"half must be finite, got {half!r}")
    if half <= 0.0:
        return 0.0
    return min(friction / (depth + reach), half / (c * c + depth * (depth + reach)))
