"""`ScanMap`: log-odds of the cells of a scene, from laser scans."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from pushplan.core import perception as core
from pushplan.errors import short
from pushplan.perception.lidar import LidarScan
from pushplan.world import InvalidInputError, StaticMap
from pushplan.world.checks import (
    BoolArray,
    FloatArray,
    checked_bounds,
    choice,
    expect,
    frozen,
    number,
)
from pushplan.world.occupancy_grid import UNKNOWN, rectangle_cover

_EVIDENCE = frozen(
    np.array([1.5, -0.4, -2.0, 4.5])
)  # log-odds of a hit and of a miss, and their limits
_ROOM = 2.0  # cells around bodies that are free where nobody has seen
_DEEP = 1.5  # cells inside something else in which a cell of a wall cannot be
_GONE = -1.0  # log-odds below which an occupied cell is free again
_TILE = 16  # cells along the side of a part of the map whose rectangles are found anew together
_MOST_CELLS = 25_000_000


class ScanMap:
    """Occupancy grid (Moravec and Elfes 1985) whose occupied cells become a `StaticMap`.

    A beam is taken to end half a cell and half the noise behind what it has hit, so that surfaces
    are as often drawn too near as too far. Where noise spreads what is hit over several cells, a
    cell gets the mean of what a scan's beams say of it, so that single readings count little.

    Args:
        bounds: (4,) x_min, y_min, x_max, y_max of the scene [m].
        cell: side of a cell [m].
        rim: how far the map goes on beyond the bounds, where walls may stand [m].
        noise: standard deviation of the distances that are measured [m]; should be no more than a
            cell, since surfaces are drawn too far by what it is more.

    Attributes:
        origin: (2,) x, y [m] of the outer corner of cell (0, 0).
        log_odds: (rows, columns) of being occupied; 0 where nobody has looked.

    Raises:
        InvalidInputError: if the bounds are empty, or hold more than 25 million cells.
    """

    def __init__(
        self, bounds: ArrayLike, cell: float, rim: float = 0.0, noise: float = 0.0
    ) -> None:
        self._bounds = checked_bounds("bounds", bounds)
        self.cell = number("cell", cell, low=0.0, open_low=True)
        rim = number("rim", rim, low=0.0)
        self._noise = number("noise", noise, low=0.0)
        self.origin = frozen(self._bounds[:2] - rim)
        extent = self._bounds[2:] - self._bounds[:2] + 2.0 * rim
        sides = [side / self.cell for side in extent.tolist()]
        if sides[0] * sides[1] > _MOST_CELLS:
            raise InvalidInputError(
                f"a map may have at most {_MOST_CELLS:,} cells, {sides[1]:.3g} x {sides[0]:.3g} "
                "are too many: use larger cells"
            )
        columns, rows = (math.ceil(side - 1e-9) for side in sides)
        self.log_odds = np.zeros((rows, columns))
        self._occupied = np.zeros((rows, columns), dtype=np.bool_)
        self._hit = np.zeros((rows, columns), dtype=np.bool_)
        self._since = np.zeros((rows, columns))
        self._solid = np.zeros((rows, columns), dtype=np.bool_)
        self._unseen: BoolArray = frozen(np.ones((rows, columns), dtype=np.bool_))
        self._changed = _Window(rows, columns)
        self._closed = False
        self._tiles: dict[tuple[int, int], list[FloatArray]] = {}
        self._static = _plain_map((), self._bounds)

    @property
    def unseen(self) -> BoolArray:
        """(rows, columns) cells at which nobody has looked."""
        return self._unseen

    def add(self, scan: LidarScan, ignored: BoolArray) -> None:
        """Mark a scan; one from beyond the map says nothing.

        Args:
            scan: what the sensor saw.
            ignored: (N,) beams that have hit something that belongs to no map.
        """
        expect("scan", scan, LidarScan)
        ignored = np.asarray(ignored)
        if ignored.shape != scan.ranges.shape or ignored.dtype != np.bool_:
            raise InvalidInputError(
                f"ignored must be {len(scan.ranges)} booleans, one a beam, got {short(ignored)}"
            )
        row, column = ((scan.pose[1::-1] - self.origin[::-1]) / self.cell).tolist()
        if not (0.0 <= row <= len(self.log_odds) and 0.0 <= column <= self.log_odds.shape[1]):
            return
        hit = np.isfinite(scan.ranges)
        passed = np.where(np.isnan(scan.ranges), 0.0, np.minimum(scan.ranges, scan.range_max))
        behind = 0.5 * (self.cell + self._noise)
        ends = np.where(hit & ~ignored, scan.ranges + behind, np.inf)
        left, low = self.origin.tolist()
        x, y, heading = scan.pose.tolist()
        bearings = frozen(heading + scan.bearings)
        averaged = 2.0 * self._noise > self.cell
        beams = bearings, passed, ends
        place = left, low, self.cell, x, y
        window = core.mark_scan(self.log_odds, *place, *beams, _EVIDENCE, averaged)
        part = self._changed.include(*window)
        hit = self.log_odds[part] > 0.0
        fresh = hit > self._hit[part]
        if fresh.any():
            self._since[part][fresh] = scan.time
        self._hit[part] = hit
        hidden = self.log_odds[part] == 0.0
        if not np.array_equal(hidden, self._unseen[part]):
            unseen = self._unseen.copy()
            unseen[part] = hidden
            self._unseen = frozen(unseen)

    def clear(self, shapes: NDArray[Any], rim: float, near: FloatArray, since: FloatArray) -> None:
        """Hold the cells of objects for free, where they are held for occupied.

        Cells that few beams have hit are free up to the rim. Where the map is sure, cells that were
        occupied before an object was last seen are walls which it touches, unless they are well
        inside it.

        Args:
            shapes: polygons of Shapely (K,), where the objects are.
            rim: distance around them in which a cell is theirs [m].
            near: (K,) by how much they may be elsewhere [m].
            since: (K,) when each object was last seen [s].
        """
        wide = rim + near
        corners = (shapely.bounds(shapes).reshape(-1, 2, 2) - self.origin) / self.cell
        corners[:, 0] -= wide[:, None] / self.cell
        corners[:, 1] += wide[:, None] / self.cell + 1.0
        boxes = np.clip(corners, 0.0, self.log_odds.shape[::-1]).astype(np.int64).reshape(-1, 4)
        for k, (c0, r0, c1, r1) in enumerate(boxes.tolist()):
            part = self.log_odds[r0:r1, c0:c1]
            if not (part > 0.0).any():
                continue
            rows, columns = np.nonzero(part > 0.0)
            x, y = self.origin[:, None] + self.cell * (np.array([columns + c0, rows + r0]) + 0.5)
            sure = part[rows, columns] >= _EVIDENCE[3]
            new = self._since[rows + r0, columns + c0] > since[k]
            within = [
                shapely.contains_xy(shapely.buffer(shapes[k], by), x, y)
                for by in (rim + near[k], rim - near[k], -max(near[k], _DEEP * self.cell))
            ]
            cleared = np.where(sure, np.where(new, within[1], within[2]), within[0])
            part[rows[cleared], columns[cleared]] = _EVIDENCE[2]
            self._changed.include(r0, c0, r1, c1)

    def static_map(
        self, *, unknown: str = "free", free: Sequence[shapely.Geometry] = ()
    ) -> StaticMap:
        """The occupied cells as rectangles; the same map where nothing has changed.

        Args:
            unknown: ``"free"`` or ``"obstacle"``, what cells count as that nobody has seen.
            free: polygons around which cells are free that nobody has seen, such as the robot.
        """
        choice("treatment of unknown cells", unknown, UNKNOWN)
        part = self._changed.taken()
        odds = self.log_odds[part]
        self._occupied[part] = (odds > 0.0) | (self._occupied[part] & (odds > _GONE))
        closed = unknown == "obstacle"
        if closed or self._closed:
            part = np.s_[:, :]
        self._closed = closed
        solid = self._occupied[part]
        if closed:
            hidden = self._unseen.copy()
            for shape in free:
                self._clear_around(hidden, shape)
            solid = solid | hidden
        rows, columns = np.nonzero(solid != self._solid[part])
        if not len(rows):
            return self._static
        self._solid[part] = solid
        rows = (rows + (part[0].start or 0)) // _TILE
        columns = (columns + (part[1].start or 0)) // _TILE
        for tile in set(zip(rows.tolist(), columns.tolist(), strict=True)):
            self._tiles[tile] = self._rectangles(*tile)
        polygons = [one for tile in sorted(self._tiles) for one in self._tiles[tile]]
        self._static = _plain_map(tuple(polygons), self._bounds)
        return self._static

    def _clear_around(self, flags: BoolArray, shape: shapely.Geometry) -> None:
        """Set flags (rows, columns) of the cells within two of a polygon to False."""
        wide = shapely.buffer(shape, _ROOM * self.cell)
        sides: FloatArray = (shapely.bounds(wide) - np.tile(self.origin, 2)) / self.cell
        c0, r0, c1, r1 = sides.tolist()
        rows = slice(*np.clip([int(r0), int(r1) + 1], 0, flags.shape[0]).tolist())
        columns = slice(*np.clip([int(c0), int(c1) + 1], 0, flags.shape[1]).tolist())
        y, x = np.mgrid[rows, columns]
        left, low = self.origin.tolist()
        cells = left + self.cell * (x + 0.5), low + self.cell * (y + 0.5)
        flags[rows, columns] &= ~shapely.contains_xy(wide, *cells)

    def _rectangles(self, row: int, column: int) -> list[FloatArray]:
        """Polygons (4, 2) [m] that cover the occupied cells of a tile."""
        corner = _TILE * np.array([row, column])
        part = self._solid[corner[0] : corner[0] + _TILE, corner[1] : corner[1] + _TILE]
        r0, c0, r1, c1 = (rectangle_cover(part) + np.tile(corner, 2)).T
        points = np.stack([c0, r0, c1, r0, c1, r1, c0, r1], axis=1).reshape(-1, 4, 2)
        return [frozen(one) for one in self.origin + self.cell * points]


class _Window:
    """Rows and columns of a map that have changed."""

    def __init__(self, rows: int, columns: int) -> None:
        self._none = rows, columns, 0, 0
        self._sides = self._none

    def include(self, r0: int, c0: int, r1: int, c1: int) -> tuple[slice, slice]:
        """Note that cells from row and column ``r0``, ``c0`` up to ``r1``, ``c1`` have changed.

        Returns:
            Indices of those cells.
        """
        old = self._sides
        self._sides = min(old[0], r0), min(old[1], c0), max(old[2], r1), max(old[3], c1)
        return slice(r0, r1), slice(c0, c1)

    def taken(self) -> tuple[slice, slice]:
        """Indices of all cells that have changed since the last call."""
        r0, c0, r1, c1 = self._sides
        self._sides = self._none
        return slice(r0, max(r0, r1)), slice(c0, max(c0, c1))


def _plain_map(polygons: tuple[FloatArray, ...], bounds: FloatArray) -> StaticMap:
    """A map of convex polygons that need no check."""
    static = StaticMap.build(bounds=bounds)
    object.__setattr__(static, "polygons", polygons)
    return static
