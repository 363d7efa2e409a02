"""Turning towards the goal first, for a ship that heads elsewhere."""

from __future__ import annotations

import math

import numpy as np

from pushplan.core import motion as core
from pushplan.motion.dubins_warm_start import ARCS
from pushplan.motion.state_lattice.lattice_path import sample_arcs
from pushplan.planners.ship_predictive.beam_search import SPACING
from pushplan.planners.ship_predictive.channel_view import STEEPEST, ChannelView
from pushplan.world.checks import FloatArray

_PLACES = 9  # on the goal line to which curves may lead
_HEADINGS = 5  # at each of them


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


def way_round(view: ChannelView) -> FloatArray | None:
    """The shortest curve of Dubins that leads to some place of the goal line and fits.

    Returns:
        (N, 4) poses and curvatures, the first being the ship's; None where none of them fits.
    """
    goal = view.channel.goal
    curves = []
    for x in np.linspace(view.channel.low[0], view.channel.high[0], _PLACES):
        for heading in np.linspace(0.5 * math.pi - STEEPEST, 0.5 * math.pi + STEEPEST, _HEADINGS):
            arcs = np.empty((ARCS, 2))
            end = np.array([x, goal, heading])
            length = core.shortest_curve(view.start, end, view.radius, False, arcs)
            curves.append((length, arcs))
    for _, arcs in sorted(curves, key=lambda curve: curve[0]):
        poses, curvatures = sample_arcs(view.start, arcs, SPACING * view.length)
        count = int(np.argmax(np.append(poses[:, 1], goal) >= goal)) + 1
        if view.inside(poses[:count]):
            return np.column_stack([poses, curvatures])[:count]
    return None


def in_table(theta: float) -> bool:
    """Return True if the costs to go hold for a heading [rad], with some to both sides."""
    return abs(theta - 0.5 * math.pi) <= STEEPEST - 0.1


def turned_start(arc: FloatArray) -> FloatArray:
    """The first part of a tight turn, up to a heading for which the costs to go hold."""
    known = np.flatnonzero(np.abs(arc[:, 2] - 0.5 * math.pi) <= STEEPEST - 0.3)
    return arc[: known[0] + 1] if len(known) else arc
