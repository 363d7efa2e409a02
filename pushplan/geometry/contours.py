"""The outlines around which shortest paths bend, as polygons drawn just outside the obstacles."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from pushplan.core import geometry as core
from pushplan.geometry.obstacles import obstacles_of
from pushplan.world import StaticMap
from pushplan.world.checks import BoolArray, FloatArray, IntArray, frozen
from pushplan.world.outline import next_corner

ARC_STEP = math.pi / 36.0
"""Turn per corner where a round outline becomes a polygon [rad]; an arc gets 0.06 % longer."""
COARSE = 3.0
"""Factor on it where the obstacles have more than `MANY_CORNERS`: an arc gets 0.6 % longer."""
MANY_CORNERS = 2_200
"""Corners of obstacles from which on a path that is nearly the shortest is good enough."""
SMALL_RADIUS = 1e-3
"""Arcs below this fraction of the map's diagonal get fewer corners: the same error in metres."""
GAP = 1e-7
"""Fraction of the map's diagonal by which paths stay off obstacles, so that touching ones close."""
_PIECE = 300  # obstacles between two looks at a stop rule: about 5 ms


class Contours(NamedTuple):
    """Corners of polygons around every obstacle, each corner with its neighbours' directions."""

    corners: FloatArray  # (V, 2) all corners [m]; each obstacle's run counter-clockwise
    incoming: FloatArray  # (V, 2) unit direction from the previous corner of the same obstacle
    outgoing: FloatArray  # (V, 2) unit direction to the next corner
    owner: IntArray  # (V,) index of the obstacle
    following: IntArray  # (V,) index of the next corner of the same obstacle

    @property
    def bends(self) -> core.Bends:
        """The corners for the core."""
        return core.Bends(self.corners, self.incoming, self.outgoing)


def gap_of(static: StaticMap) -> float:
    """Return the gap of paths to obstacles [m]; two obstacles closer than this leave no passage."""
    return GAP * _diagonal(static)


def standoff_of(static: StaticMap, clearance: float) -> float:
    """Greatest distance [m] of a contour polygon from the outline that it is drawn around."""
    shapes = obstacles_of(static, clearance)
    radius = max(float(shapes.radii.max(initial=0.0)), 0.0)
    # 1 / cos(step / 2) - 1, which is step² / 8 for small steps and 1.35 times that at the coarsest
    fraction = 1.5 * _arc_step(shapes) ** 2 / 8.0
    return fraction * max(radius, SMALL_RADIUS * _diagonal(static)) + 4.0 * gap_of(static)


def has_many_corners(shapes: core.Obstacles) -> bool:
    """Return True for a map on which speed counts for more than the last percent of length."""
    return len(shapes.vertices) > MANY_CORNERS


def _arc_step(shapes: core.Obstacles) -> float:
    return ARC_STEP * (COARSE if has_many_corners(shapes) else 1.0)


def _diagonal(static: StaticMap) -> float:
    return float(np.hypot(*(static.bounds[2:] - static.bounds[:2])))


class _ContourMaker:
    """Makes the contours of one map and clearance in small steps; what is done is kept."""

    def __init__(self, static: StaticMap, clearance: float) -> None:
        self._shapes = obstacles_of(static, clearance)
        diagonal = _diagonal(static)
        small = SMALL_RADIUS * diagonal / np.maximum(self._shapes.radii, 1e-300)
        steps = _arc_step(self._shapes) * np.sqrt(np.maximum(1.0, small))
        self._steps = np.minimum(math.pi / 2.0, steps)
        self._radii = self._shapes.radii + 2.0 * gap_of(static)
        self._parts: list[Contours] = []
        self._done = self._corners = 0
        self._whole: Contours | None = None
        self._lock = threading.Lock()

    def make(self, stopped: Callable[[], bool]) -> Contours | None:
        """Go on until all is done, or ``stopped``, asked every few milliseconds, says so: None."""
        count = len(self._radii)
        while self._done < count or not self._parts:
            if stopped():
                return None
            with self._lock:
                if self._done < count or not self._parts:
                    self._make_some(self._done, min(self._done + _PIECE, count))
        with self._lock:
            if self._whole is None:
                columns = zip(*self._parts, strict=True)
                self._whole = Contours(*(frozen(np.concatenate(column)) for column in columns))
        return self._whole

    def _make_some(self, first: int, last: int) -> None:
        """Add the contours of the obstacles from ``first`` to ``last`` (exclusive)."""
        vertices = self._shapes.vertices
        offsets = self._shapes.offsets
        cores = vertices[offsets[first] : offsets[last]], offsets[first : last + 1] - offsets[first]
        points, owner = _outlines(*cores, self._radii[first:last], self._steps[first:last])
        ends = np.flatnonzero(np.diff(owner, append=-1)) + 1
        after = next_corner(np.concatenate([[0], ends]))
        outgoing = points[after] - points
        outgoing /= np.hypot(outgoing[:, 0], outgoing[:, 1])[:, None]
        incoming = np.empty_like(outgoing)
        incoming[after] = outgoing
        owner = owner.astype(np.int64) + first
        after = after.astype(np.int64) + self._corners
        self._parts.append(Contours(points, incoming, outgoing, owner, after))
        self._corners += len(points)
        self._done = last


_maker_of = lru_cache(maxsize=64)(_ContourMaker)


def contours_of(static: StaticMap, clearance: float = 0.0) -> Contours:
    """Polygons around the obstacles grown by ``clearance`` [m]: nowhere inside, tangent to arcs."""
    made = _maker_of(static, clearance).make(lambda: False)
    assert made is not None
    return made


def prepare_contours(static: StaticMap, clearance: float, stopped: Callable[[], bool]) -> bool:
    """Make what `contours_of` returns unless ``stopped`` says so before; whether it is there."""
    return _maker_of(static, clearance).make(stopped) is not None


def _outlines(
    cores: FloatArray, offsets: IntArray, radii: FloatArray, steps: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Corners (V, 2) [m] of polygons tangent to the outlines at ``radii`` around convex cores."""
    sizes = np.diff(offsets)
    core = np.repeat(np.arange(len(sizes)), sizes)  # of each corner of the cores
    after = next_corner(offsets)
    before = np.arange(-1, len(cores) - 1)
    before[offsets[:-1]] = offsets[1:] - 1
    edges = cores[after] - cores
    normals = np.arctan2(-edges[:, 0], edges[:, 1])  # outward, of the edge that leaves
    turns = (normals - normals[before]) % (2.0 * math.pi)
    turns = np.where(turns > 1.5 * math.pi, 0.0, turns)  # rounding of a straight corner
    points = np.flatnonzero((sizes == 2) & ~edges[offsets[:-1]].any(axis=1))
    turns[offsets[points]] = 2.0 * math.pi
    turns[offsets[points] + 1] = 0.0
    counts = np.ceil(turns / steps[core] - 1e-9).astype(np.int64)
    source = np.repeat(np.arange(len(cores)), counts)
    part = (turns / np.maximum(counts, 1))[source]
    place = np.arange(len(source)) - np.repeat(np.cumsum(counts) - counts, counts)
    angles = normals[before][source] + part * (place + 0.5)
    reach = radii[core[source]] / np.cos(part / 2.0)
    ray = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.ascontiguousarray(cores[source] + reach[:, None] * ray), core[source]


def box_edges(box: FloatArray) -> FloatArray:
    """The four sides (4, 4) of a box x_min, y_min, x_max, y_max [m], as segments."""
    x0, y0, x1, y1 = box.tolist()
    return np.array([[x0, y0, x1, y0], [x1, y0, x1, y1], [x1, y1, x0, y1], [x0, y1, x0, y0]])


def contour_edges(contours: Contours, which: BoolArray | None = None) -> FloatArray:
    """Sides (N, 4) of the contours as segments [m] in the order of their first corner.

    Args:
        contours: the contours.
        which: (V,) flags of the first corners; all of them if None.
    """
    first = contours.corners
    after = contours.following
    if which is not None:
        first = first[which]
        after = after[which]
    return np.ascontiguousarray(np.hstack([first, contours.corners[after]]))
