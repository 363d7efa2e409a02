"""Compiled arcs of the predictive search: (N, 4) poses and the curvature that leads to each."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.planners.ship_predictive.ice_cost_to_go import IceCostToGo, cost_to_go, mass_ahead
from pushplan.world.checks import FloatArray


class Channel(NamedTuple):
    """Places where the ship's origin may be."""

    goal: float  # y of the line to which the search goes [m]
    low: FloatArray  # (2,) least x, y [m]
    high: FloatArray  # (2,) greatest x, y [m]


@kernel
def steer_on(
    costs: IceCostToGo,
    pose: FloatArray,  # (3,) where to begin
    curvatures: FloatArray,  # (B,) to choose from [1/m]
    step: float,  # length of the arcs [m]
    out: FloatArray,  # (N, 4)
) -> int:
    """Drive on in small arcs of least cost to go; the number of poses, 0 where they do not fit."""
    goal = costs.low + (costs.table.shape[0] - 1) * costs.row
    x = pose[0]
    y = pose[1]
    theta = pose[2]
    for n in range(out.shape[0]):
        if y >= goal:
            return n
        best = np.inf
        chosen = 0
        for b in range(curvatures.shape[0]):
            middle = theta + 0.5 * curvatures[b] * step
            nx = x + step * math.cos(middle)
            ny = y + step * math.sin(middle)
            heading = theta + curvatures[b] * step
            cost = step * (costs.mass + costs.weight * mass_ahead(costs, nx, ny, heading))
            cost += cost_to_go(costs, nx, ny, heading)
            cost += 1e-7 * costs.mass * step * abs(curvatures[b]) * costs.radius  # a tie-break
            if cost < best:
                best = cost
                chosen = b
        middle = theta + 0.5 * curvatures[chosen] * step
        x += step * math.cos(middle)
        y += step * math.sin(middle)
        theta += curvatures[chosen] * step
        out[n, 0] = x
        out[n, 1] = y
        out[n, 2] = theta
        out[n, 3] = curvatures[chosen]
    return out.shape[0] if y >= goal else 0


@kernel(allocates=True)
def arc_ahead(
    channel: Channel,
    pose: FloatArray,  # (3,) where it begins
    curvature: float,  # [1/m]
    step: float,  # distance between poses along the arc [m]
    count: int,  # number of them after the first
) -> FloatArray:
    """(N, 4) an arc from a pose on, cut off at the goal; (0, 4) where it leaves the channel."""
    low = channel.low
    high = channel.high
    arc = np.empty((count + 1, 4))
    arc[0, 0] = pose[0]
    arc[0, 1] = pose[1]
    arc[0, 2] = pose[2]
    arc[0, 3] = curvature
    for n in range(1, count + 1):
        half = 0.5 * curvature * step * n
        chord = step * n * (math.sin(half) / half if half != 0.0 else 1.0)
        x = pose[0] + chord * math.cos(pose[2] + half)
        y = pose[1] + chord * math.sin(pose[2] + half)
        if x < low[0] or x > high[0] or y < low[1] or y > high[1]:
            return arc[:0]
        arc[n, 0] = x
        arc[n, 1] = y
        arc[n, 2] = pose[2] + 2.0 * half
        arc[n, 3] = curvature
        if y >= channel.goal:
            return arc[: n + 1]
    return arc
