"""Turning towards the goal first, for a ship that heads elsewhere."""

from __future__ import annotations

import math

import numpy as np

from pushplan.planners.ship_predictive.beam import SPACING
from pushplan.planners.ship_predictive.cost_to_go import STEEPEST
from pushplan.planners.ship_predictive.ice_scene import Scene
from pushplan.world.checks import FloatArray


def tight_turn(scene: Scene) -> FloatArray | None:
    """The tightest arc to the way straight ahead, or to the goal line if that comes first.

    Returns:
        (N, 4) poses and curvatures, the first being the ship's; to the nearer side if there is
        room, else to the other one; None where there is none.
    """
    off = scene.start[2] - 0.5 * math.pi
    step = SPACING * scene.length
    near = -math.copysign(1.0, off)
    for side in (near, -near):
        turn = abs(off) if side == near else 2.0 * math.pi - abs(off)
        count = max(1, math.ceil(turn * scene.radius / step))
        along = np.linspace(0.0, turn * scene.radius, count + 1)
        bend = side / scene.radius
        middle = scene.start[2] + 0.5 * bend * along
        chord = along * np.sinc(0.5 * bend * along / np.pi)
        x, y = chord * np.cos(middle), chord * np.sin(middle)
        # headings near those that the guide knows
        heading = scene.start[2] + bend * along + (side != near) * near * 2.0 * math.pi
        way = np.column_stack([x, y, heading, np.full(count + 1, bend)])
        arrived = np.flatnonzero(y >= scene.goal)
        if len(arrived):
            way = way[: arrived[0] + 1]
        if scene.inside(way):
            return way
    return None


def knows(theta: float) -> bool:
    """Whether the guide's costs hold for a heading [rad], with room to both sides."""
    return abs(theta - 0.5 * math.pi) <= STEEPEST - 0.1


def turned_start(way: FloatArray) -> FloatArray:
    """The first part of a tight turn, up to a heading that the guide knows well."""
    known = np.flatnonzero(np.abs(way[:, 2] - 0.5 * math.pi) <= STEEPEST - 0.3)
    return way[: known[0] + 1] if len(known) else way
