"""Lower bounds of the cost to a goal line: the Dubins path to it, and what must be covered."""

from __future__ import annotations

import numpy as np

from pushplan.planners.lattice.cost_map import window_minima
from pushplan.world.checks import FloatArray


def dubins_to_line(distance: FloatArray, heading: FloatArray, radius: float) -> FloatArray:
    """Length [m] of the shortest path of bounded curvature from a pose to a line.

    The robot turns towards the normal of the line until it faces it or is there, and then drives
    straight. While it turns from α to β it gets on by R (sin α - sin β).

    Args:
        distance: from the line [m], not negative.
        heading: relative to the line's normal [rad]; broadcast with ``distance``.
        radius: least turning radius R [m].
    """
    angle = np.abs((np.asarray(heading) + np.pi) % (2.0 * np.pi) - np.pi)
    gained = radius * np.sin(angle)
    straight = radius * angle + (distance - gained)
    left = np.arcsin(np.clip(np.sin(angle) - distance / radius, -1.0, 1.0))
    turning = radius * (angle - left)
    length: FloatArray = np.where(distance >= gained, straight, np.maximum(turning, 0.0))
    return np.where(distance <= 0.0, 0.0, length)


def row_bounds(
    headings: FloatArray,
    rows: FloatArray,
    goal_row: float,
    step: float,
    radius: float,
    cell_bounds: FloatArray,
) -> FloatArray:
    """(H, U) lower bounds of the cost from each heading and row of a lattice [m].

    Args:
        headings: (H,) relative to the normal of the goal line [rad].
        rows: (U,) rows of the lattice.
        goal_row: row of the goal line, in steps.
        step: of the lattice [m].
        radius: least turning radius [m].
        cell_bounds: (U,) what must be paid for cells from each row on, from `covering_bounds`.
    """
    distance = np.maximum(goal_row - rows, 0.0) * step
    lengths = dubins_to_line(distance[None], headings[:, None], radius)
    return np.ascontiguousarray(np.where(distance > 0.0, lengths + cell_bounds, 0.0))


def covering_bounds(
    grid: FloatArray,
    places: FloatArray,
    goal_cell: int,
    width: int,
    reach: int,
    columns: tuple[int, int],
) -> FloatArray:
    """(U,) the least that any path pays for the cells between each row and the goal line.

    Whatever way it takes, the robot covers in each row of cells that its origin crosses a window
    as wide as its inscribed disc; what it covers already does not count.

    Args:
        grid: (rows, columns) the map.
        places: (U,) row of the map on which each row of the lattice lies.
        goal_cell: row of the map on which the goal line lies.
        width: of the window [cells].
        reach: how far ahead of the origin the robot may cover cells already [cells].
        columns: first and last column of the map on which the origin may be.
    """
    least = window_minima(grid, width, *columns)
    least[max(goal_cell, 0) :] = 0.0
    rest = np.concatenate([np.cumsum(least[::-1])[::-1], [0.0]])
    ahead = np.clip(places.astype(np.int64) + reach + 1, 0, len(rest) - 1)
    bounds: FloatArray = rest[ahead]
    return bounds
