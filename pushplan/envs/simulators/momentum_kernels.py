"""Compiled drag on bodies that move by themselves."""

from __future__ import annotations

import math

import numpy as np

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray


@kernel(allocates=True)
def slow_down(
    velocities: FloatArray,  # (N, 3) vx, vy [m/s], omega [rad/s]
    keeps: FloatArray,  # (N,) 0 for a body that stops at once, else 1
    drag: FloatArray,  # (N, 4) b and c of translation, then of rotation, over the inertia
    h: float,  # [s]
) -> FloatArray:
    """Solve ``v' = -(b + c |v|) v`` over ``h`` [s] for each body, and for its rotation."""
    out = np.zeros((velocities.shape[0], 3))
    for i in range(velocities.shape[0]):
        if keeps[i] == 0.0:
            continue
        speed = math.hypot(velocities[i, 0], velocities[i, 1])
        fraction = _kept(speed, drag[i, 0], drag[i, 1], h)
        out[i, 0], out[i, 1] = fraction * velocities[i, 0], fraction * velocities[i, 1]
        out[i, 2] = velocities[i, 2] * _kept(abs(velocities[i, 2]), drag[i, 2], drag[i, 3], h)
    return out


@kernel(allocates=True)
def _kept(speed: float, b: float, c: float, h: float) -> float:
    """Fraction of the speed that is left after ``h``."""
    decay = math.exp(-b * h)
    # (1 - exp(-b h)) / b, which tends to h
    reach = -math.expm1(-b * h) / b if b * h > 1e-12 else h
    return decay / (1.0 + c * speed * reach)
