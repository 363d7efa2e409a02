"""`LatticeMap`: the cells under a lattice, with floes and obstacles on them, and their costs."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pushplan.core import geometry
from pushplan.core import motion as core
from pushplan.motion.state_lattice.built_lattice import Frame
from pushplan.motion.time_slicing import go_on, never
from pushplan.world import Movables, StaticMap
from pushplan.world.checks import FloatArray, IntArray

_BLOCKED_MARGIN = 0.8
"""Cells nearer to an obstacle than this are blocked [cells]: more than half their diagonal."""
_FEW = 2  # outlines that are drawn between two looks at a stop rule
LEAN = 0.3
"""Angle φ [rad] of the bound of a length by its parts ahead and across, a cos φ + b sin φ."""


class FloeCosts(NamedTuple):
    """Costs of covering K floes.

    The cost of a floe is spread over its cells in proportion to (1 + ``soft`` - q²)^``exponent``,
    where q is the distance from its centre over the radius of the disc of the same area, at most 1.
    An exponent of -1/2 makes every strip of a disc, of whatever direction, cost the same; 1 weighs
    the middle most.
    """

    totals: FloatArray  # (K,) of covering the whole floe, in metres of travel
    areas: FloatArray  # (K,) [m²]
    exponent: float
    soft: float  # Positive where the exponent is negative


def column_sums(grid: FloatArray) -> FloatArray:
    """(columns, rows + 1) sums of each column of a (rows, columns) grid before each row."""
    rows, columns = grid.shape
    sums = np.empty((columns, rows + 1))
    core.prefix_sums(grid, sums)
    return sums


@dataclass(frozen=True)
class LatticeMap:
    """A grid of cells that is aligned with a lattice."""

    frame: Frame  # of the lattice
    cell: float  # side of a cell [m]
    origin: IntArray  # (2,) row and column of the frame's origin
    shape: tuple[int, int]  # rows and columns

    def to_cells(self, points_world: FloatArray) -> FloatArray:
        """(N, 2) points of the world as rows and columns of the map."""
        points: FloatArray = self.frame.from_world(points_world) / self.cell + self.origin
        return points

    def cost_sums(
        self, floes: Movables, costs: FloeCosts, stopped: Callable[[], bool] = never
    ) -> FloatArray:
        """(columns, rows + 1) sums of the costs of each column before each row [m]."""
        corners = np.empty_like(floes.vertices)
        geometry.transform_outlines(floes.poses, floes.vertices, floes.offsets, corners)
        outlines = np.ascontiguousarray(self.to_cells(corners))
        centres = np.ascontiguousarray(self.to_cells(floes.poses[:, :2]))
        radii = np.sqrt(costs.areas / np.pi) / self.cell  # of the discs of the same areas
        grid = np.zeros(self.shape)
        for first in range(0, len(floes), _FEW):
            go_on(stopped)
            few = slice(first, first + _FEW)
            core.add_floes(
                outlines,
                floes.offsets[first : first + _FEW + 1],
                centres[few],
                radii[few],
                costs.totals[few],
                costs.exponent,
                costs.soft,
                grid,
            )
        go_on(stopped)
        return column_sums(grid)

    def no_costs(self) -> FloatArray:
        """`cost_sums` where there is nothing."""
        return np.zeros((self.shape[1], self.shape[0] + 1))

    def blocked_sums(self, static: StaticMap, stopped: Callable[[], bool] = never) -> FloatArray:
        """Flattened sums of the blocked cells of each column before each row; (0,) without any."""
        if not static.convex_parts:
            return np.zeros(0)
        vertices, offsets = static.packed
        grid = np.zeros(self.shape)
        outlines = np.ascontiguousarray(self.to_cells(vertices))
        for first in range(0, len(offsets) - 1, _FEW):
            go_on(stopped)
            core.block(outlines, offsets[first : first + _FEW + 1], _BLOCKED_MARGIN, grid)
        go_on(stopped)
        return column_sums(grid).ravel()

    def columns_between(
        self, static: StaticMap, side: float, low: int, high: int
    ) -> tuple[int, int]:
        """First and last column from ``low`` to ``high`` that lie ``side`` [m] within bounds."""
        bounds = static.bounds + side * np.array([1.0, 1.0, -1.0, -1.0])
        finite = np.clip(bounds, -1e12, 1e12)
        corners = self.to_cells(finite[[[0, 1], [2, 1], [2, 3], [0, 3]]])[:, 1]
        first = min(max(math.ceil(float(corners.min()) - 1e-9), low), high)
        return first, max(min(math.floor(float(corners.max()) + 1e-9), high), first)


class HullWindow(NamedTuple):
    """Cells that a robot is assumed to cover where it crosses a row of cells."""

    half: int  # Cells to each side of the one below its origin
    reach: int  # Distance ahead of the origin in which it may cover cells already [cells]
    along: int  # Rows to each side over which costs are averaged; 0 for a bound
    stage: int  # Rows from one that is looked at to the next; 1 for a bound
    factor: float  # Factor on costs; at most 1 for a bound
    cell: float  # Side of a cell [m]
    lean: float  # Angle φ [rad]


def place_costs(
    sums: FloatArray,  # (map columns, map rows + 1) costs of each column before each row [m]
    places: IntArray,  # (U,) row of the map on which each row of the lattice lies
    goal_cell: int,  # row of the map on which the goal line lies, or one before
    columns: IntArray,  # (V,) columns of the map on which those of the lattice lie
    between: tuple[int, int],  # first and last column of the map where the origin may be
    window: HullWindow,
) -> FloatArray:
    """(U, V) cost [m] from each place of a lattice to a goal line, at least or about; 0 beyond.

    A path crosses every row of cells up to the line, and where its origin does so, the robot covers
    at least a window as wide as its inscribed disc. So the cost is at least that of the best
    sequence of such windows, one in each row, plus the length of the path that joins them. Of that
    length only a cos φ + b sin φ counts, for a metres ahead and b across, which is never more than
    it: rounding the crossings to cells lengthens b no further if they may be off by one cell.

    That bound dodges floes as no hull can. Averaging the costs along the path over the length of
    the hull takes this out: an estimate that is no bound, but guides a search much better.
    """
    costs = np.empty((len(places), len(columns)))
    core.place_costs(sums, places, goal_cell, columns, between, *window, costs)
    return costs
