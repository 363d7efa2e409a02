"""Turning towards the goal first, for a ship that heads elsewhere."""

from __future__ import annotations

import math

import numpy as np

from pushplan.planners.ship_predictive.beam_search import SPACING
from pushplan.planners.ship_predictive.channel_view import STEEPEST, ChannelView
from pushplan.world.checks import FloatArray


def tight_turn(view: ChannelView) -> FloatArray | None:
    """The tightest arc to the direction straight ahead, or to the goal line if that comes first.

    Returns:
        (N, 4) poses and curvatures, the first being the ship's; to the nearer side if it fits
        else to the other one; None where there is none.
    """
    off = view.start[2] - 0.5 * math.pi
    step = SPACING * view.length
    near = -math.copysign(1.0, off)
    for side in (near, -near):
        turn = abs(off) if side == near else 2.0 * math.pi - abs(off)
        count = max(1, math.ceil(turn * view.radius / step))
        along = np.linspace(0.0, turn * view.radius, count + 1)
        curvature = side / view.radius
        middle = view.start[2] + 0.5 * curvature * along
        chord = along * np.sinc(0.5 * curvature * along / np.pi)
        x = chord * np.cos(middle)
        y = chord * np.sin(middle)
        # headings near those of the table of costs to go
        heading = view.start[2] + curvature * along + (side != near) * near * 2.0 * math.pi
        arc = np.column_stack([x, y, heading, np.full(count + 1, curvature)])
        arrived = np.flatnonzero(y >= view.channel.goal)
        if len(arrived):
            arc = arc[: arrived[0] + 1]
        if view.inside(arc):
            return arc
    return None


def in_table(theta: float) -> bool:
    """Return True if the costs to go hold for a heading [rad], with some to both sides."""
    return abs(theta - 0.5 * math.pi) <= STEEPEST - 0.1


def turned_start(arc: FloatArray) -> FloatArray:
    """The first part of a tight turn, up to a heading for which the costs to go hold."""
    known = np.flatnonzero(np.abs(arc[:, 2] - 0.5 * math.pi) <= STEEPEST - 0.3)
    return arc[: known[0] + 1] if len(known) else arc
