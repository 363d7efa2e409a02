"""`LatticeMap`: the cells under a lattice, with floes and obstacles put on them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pushplan.core import geometry
from pushplan.core import motion as core
from pushplan.motion.state_lattice.cost_map import FloeCosts, column_sums
from pushplan.motion.state_lattice.frame import Frame
from pushplan.motion.time_slicing import go_on, never
from pushplan.world import Movables, StaticMap
from pushplan.world.checks import FloatArray, IntArray

_BLOCKED_MARGIN = 0.8
"""Cells nearer to an obstacle than this are blocked [cells]: more than half their diagonal."""


_FEW = 2  # outlines that are drawn between two looks at a stop rule


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
