"""Turning towards the goal first, for a ship that heads elsewhere."""

from __future__ import annotations

import math

import numpy as np

from pushplan.planners.predictive.config import PredictiveConfig
from pushplan.planners.predictive.guide import STEEPEST
from pushplan.planners.predictive.scene import Scene
from pushplan.world.checks import FloatArray


def turned_start(
    scene: Scene, config: PredictiveConfig, spacing: float = 0.05
) -> FloatArray | None:
    """The tightest arc to a heading that the guide knows, to the side where there is room.

    Args:
        scene: what is searched.
        config: parameters.
        spacing: between poses, in hull lengths.

    Returns:
        (N, 4) poses and curvatures, the first being the ship's; None where neither side has room.
    """
    off = math.remainder(float(scene.start[2]) - 0.5 * math.pi, 2.0 * math.pi)
    step = spacing * scene.length
    near = -math.copysign(1.0, off)
    for side in (near, -near):
        turn = abs(off) if side == near else 2.0 * math.pi - abs(off)
        turn -= STEEPEST - 0.3
        count = max(1, math.ceil(turn * scene.radius / step))
        along = np.linspace(0.0, turn * scene.radius, count + 1)
        bend = side / scene.radius
        middle = scene.start[2] + 0.5 * bend * along
        chord = along * np.sinc(0.5 * bend * along / np.pi)
        x, y = chord * np.cos(middle), chord * np.sin(middle)
        heading = scene.start[2] + bend * along
        way = np.column_stack([x, y, heading, np.full(count + 1, bend)])
        if scene.inside(way[1:]):
            # the same heading in the range of the guide
            way[:, 2] -= 2.0 * math.pi * np.round((way[-1, 2] - 0.5 * math.pi) / (2.0 * math.pi))
            return way
    return None
