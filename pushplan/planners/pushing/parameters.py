"""Friction of a push and what it does to it, and the parameters of the pushing controller."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from pushplan.world import InvalidInputError
from pushplan.world.checked_fields import (
    CheckedFields,
    Limits,
    NonNegativeFloat,
    PositiveFloat,
    PositiveFraction,
    PositiveInt,
)
from pushplan.world.checks import choice, integer, number
from pushplan.world.outline import centroid, convex_outline

SUPPORTS = ("uniform", "inertia", "corners")
"""Supports by which a box may press on the ground, see `pressure_radius`."""
_RINGS = 64


@dataclass(frozen=True)
class PushParameters(CheckedFields):
    """Friction of a push.

    Args:
        friction: coefficient between bumper and box.
        spread: c, the greatest torque over the greatest force of the ground, as a multiple of
            that under uniform pressure, so that it suits boxes of any size. Pymunk's boxes have
            1.07 (`spread_of`), a box that stands on its corners 1.85.
    """

    friction: Annotated[float, Limits(0.0, 10.0)] = 0.0
    spread: Annotated[float, Limits(0.05, 20.0)] = 1.0


@dataclass(frozen=True)
class PushingConfig(CheckedFields):
    """Parameters of `PushingMpc`.

    L is the distance from the robot's axle to the centre of the box on its bumper, T = L / speed.
    The cost is the integral over time, in units of T, of the squares below, with the box's
    distance from its path in L and turn rates in 1 / T.

    Args:
        horizon: N, steps that are looked ahead.
        moves: commands that are chosen freely; each but the first holds for some steps. At most
            ``horizon``.
        reach: how far the steps reach at full speed [L]; they are equally long, but never shorter
            than the control period, and the first is the control period itself.
        heading: cost of a wrong direction of the push [1/rad²].
        offset: cost of the box's offset, per square of the fraction of half the bumper.
        rim: cost of an offset beyond 0.6 of half the bumper, the same.
        angle: cost of a box that does not lie on the bumper [1/rad²].
        grip: cost of a curvature beyond ``margin`` times the stable one.
        margin: fraction of the stable curvature that is used; light boxes in MuJoCo need 0.6
            to 0.7.
        turn: cost of turning otherwise than the path does.
        speed: cost of another speed than the path's, per square, as a fraction of ``max_speed``.
        smoothness: cost of changing speed and turn rate.
        terminal: factor on the cost of the last step.
        parameters: friction.
        delay: known time between a command and its effect [s].
        period: time for which the first command is held [s]; later ones are held for as long as
            the clock of the world shows.
        observer_gain: fraction by which a new pose corrects the predicted one; 1 where poses are
            exact, about 0.3 where they are off by some percent of the box.
        clearance: least distance of robot and box from static things [R, the robot's
            circumscribed radius]; what is nearer comes no nearer.
        iterations: quadratic programs solved in each call; 1 is the real-time iteration.
        first_iterations: those of the first call on a path.
        tolerance: of the solver, absolute and relative.
        solver_iterations: after which the solver gives up.
    """

    horizon: Annotated[int, Limits(2, 200)] = 20
    moves: Annotated[int, Limits(2)] = 10
    reach: PositiveFloat = 3.0
    heading: NonNegativeFloat = 0.2
    offset: NonNegativeFloat = 0.02
    rim: NonNegativeFloat = 4.0
    angle: NonNegativeFloat = 0.1
    grip: NonNegativeFloat = 0.03
    margin: PositiveFraction = 0.7
    turn: NonNegativeFloat = 0.02
    speed: PositiveFloat = 1.0
    smoothness: PositiveFloat = 0.01
    terminal: Annotated[float, Limits(1.0)] = 3.0
    parameters: PushParameters = field(default_factory=PushParameters)
    delay: NonNegativeFloat = 0.0
    period: PositiveFloat = 0.1
    observer_gain: PositiveFraction = 1.0
    clearance: NonNegativeFloat = 0.02
    iterations: PositiveInt = 1
    first_iterations: PositiveInt = 4
    tolerance: PositiveFloat = 1e-5
    solver_iterations: PositiveInt = 1000

    def __post_init__(self) -> None:
        super().__post_init__()
        integer("moves", self.moves, high=self.horizon)


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
    total = 0.0
    weight = 0.0
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
