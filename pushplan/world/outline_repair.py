"""Repair of outlines as sensors and other programs give them, and cuts into convex parts."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from pushplan.core import geometry
from pushplan.errors import InvalidInputError
from pushplan.world.checks import FloatArray, array, frozen
from pushplan.world.outline import (
    LARGEST_M,
    ConvexParts,
    areas_and_centroids,
    convex_outline,
    convex_outlines,
    flatten,
    listed,
)

MOST_CHANGE = 0.01
"""Fraction of its area by which repair and smoothing may change an outline."""
MOST_CORNERS = 10_000
"""Most corners of an outline that is not convex."""
_CROSSINGS = (1_000, 2)
"""Most crossings of edges that are resolved, and more of them for each edge: each takes 2 kB."""
_NEAR_PAIRS = 1_000
"""Most other edges, on average, whose boxes the box of an edge may meet: each pair costs 0.1 µs."""
_EDGES_AT_ONCE = 16
"""Edges that are compared with all others before the counts are looked at."""
_MANY_CORNERS = 2_000
"""Corners of an outline from which on smoothing bounds its change, and does not measure it."""
_SMOOTHED = 0.003  # share of that for leaving out corners of outlines with many of them,
_FILLED = 0.004  # and for filling dents, so that fewer parts are enough
_FEW_CORNERS = 12  # outlines with no more than these keep all of them
_TOLERANCES = (0.02, 0.01, 0.005, 0.002, 0.001)
"""Distances from the outline [sizes of it] within which corners may be left out, tried in turn."""
_ROUNDING = 1e-12  # a triangle that is a smaller part of the largest has no area
_SLIVER = 1e-6
"""Pieces and parts below this fraction of the area are left out."""


class OutlineWarning(UserWarning):
    """Outlines were repaired, or have changed a little by being cut into convex parts."""


@dataclass(frozen=True)
class OutlineParts:
    """A shape as the union of convex parts.

    Args:
        parts: convex outlines, counter-clockwise, each (N, 2) [m]. They may overlap a little.
        change: area by which their union and the given shape differ, over the area of the shape.
        repaired: True if the outline crossed or touched itself.
    """

    parts: ConvexParts
    change: float
    repaired: bool


def outline_parts(name: str, shape: Any, *, smooth: bool = False) -> OutlineParts:
    """Cut one outline into convex parts, and repair it before if it crosses or touches itself.

    Corners may go round either way and may be repeated. The union of the parts of a valid outline
    is the outline. Of others, spikes are left out, and loops are resolved by Shapely's
    `make_valid`.

    Args:
        name: of the outline, for messages.
        shape: (N, 2) corners [m], or a polygon of Shapely, which may have holes.
        smooth: leave out corners where there are many, and fill small dents, so that fewer parts
            are enough. For outlines with noise, valid or not.

    Raises:
        InvalidInputError: if it has no area, if the parts differ from it by more than 1 % of it, if
            it has more than `MOST_CORNERS`, or crosses itself too often.
    """
    convex = _if_convex(name, shape)
    if convex is not None:
        return OutlineParts((convex,), 0.0, False)
    given = _polygon(name, shape)
    repaired = not given.is_valid
    whole = shapely.orient_polygons(given, exterior_cw=True)
    if repaired:
        _check_crossings(name, given)
        whole = _areal(shapely.make_valid(given, method="structure", keep_collapsed=False))
    low_x, low_y, high_x, high_y = given.bounds
    size = max(high_x - low_x, high_y - low_y)
    if not whole.area > 1e-9 * size * size:
        raise InvalidInputError(f"{name} must have an area, got {whole.area:g} m²")
    change = abs(given.area - whole.area) / whole.area  # the first by the shoelace formula
    if change > MOST_CHANGE:
        raise InvalidInputError(
            f"{name} crosses itself: it has an area of {given.area:.4g} m² as it is and of "
            f"{whole.area:.4g} m² without loops, which may differ by {100 * MOST_CHANGE:g} %"
        )
    if smooth:
        less = _smoothed(_areal(whole), size)
        parts = _merged(_triangles(less), _FILLED * whole.area, _SLIVER)
        union = shapely.union_all([shapely.Polygon(part) for part in parts])
        change += shapely.symmetric_difference(union, whole).area / whole.area
    else:
        parts = _merged(_triangles(whole), 0.0, 0.0)
        change += abs(areas_and_centroids(*flatten(parts))[0].sum() / whole.area - 1.0)
    if change > MOST_CHANGE:
        raise InvalidInputError(
            f"{name} must be a shape whose convex parts differ from it by at most "
            f"{100 * MOST_CHANGE:g} % of its area, got {100 * change:.2g} %"
        )
    return OutlineParts(tuple(parts), change, repaired)


def cut_outlines(
    name: str, shapes: Sequence[Any], called: Callable[[int], str], smooth: bool = False
) -> list[ConvexParts]:
    """The convex parts of each of some shapes; see `pushplan.world.convex_shapes.shapes_of`."""
    found = []
    changed: list[OutlineParts] = []
    for i, shape in enumerate(listed(name, shapes)):
        outlines = {called(i): shape}
        if _is_list_of_outlines(shape):
            outlines = {f"{called(i)}, part {j}": each for j, each in enumerate(shape)}
        cuts = [outline_parts(label, each, smooth=smooth) for label, each in outlines.items()]
        changed += [cut for cut in cuts if cut.repaired or cut.change > _SLIVER]
        found.append(tuple(part for cut in cuts for part in cut.parts))
    if changed:
        most = max(each.change for each in changed)
        warnings.warn(
            f"{len(changed)} of {len(found)} outlines were repaired or smoothed: their "
            f"areas have changed by at most {100 * most:.2g} %",
            OutlineWarning,
            stacklevel=4,
        )
    return found


def _is_list_of_outlines(shape: Any) -> bool:
    if isinstance(shape, np.ndarray):
        return shape.ndim == 3
    if not isinstance(shape, list | tuple) or not shape:
        return False
    first = shape[0]
    if isinstance(first, np.ndarray):
        return first.ndim == 2
    if isinstance(first, list | tuple):
        return len(first) > 0 and isinstance(first[0], list | tuple | np.ndarray)
    return isinstance(first, shapely.Geometry)


def disjoint_pieces(parts: ConvexParts) -> ConvexParts:
    """Triangles (3, 2) [m] that do not overlap, with the union of some convex parts (N, 2) [m]."""
    triangles = _triangles(_union(parts))
    along, across = np.moveaxis(triangles[:, 1:] - triangles[:, :1], 1, 0)
    doubled = along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0]
    triangles[doubled < 0.0] = triangles[doubled < 0.0, ::-1]
    least = _ROUNDING * np.abs(doubled).max()  # two corners may be one but for rounding
    return tuple(frozen(triangles[np.abs(doubled) > least]))


def union_rings(parts: ConvexParts) -> tuple[FloatArray, ...]:
    """Outlines (N, 2) [m] of the union of some convex parts, those of its holes too."""
    # A corner of one part may be off the edge of its neighbour by rounding.
    grid = _ROUNDING * float(np.ptp(np.concatenate(parts), axis=0).max())
    rings = shapely.get_rings(shapely.get_parts(_union(parts, grid)))
    return tuple(shapely.get_coordinates(ring)[:-1] for ring in rings)


def _union(parts: ConvexParts, grid: float | None = None) -> Any:
    """The union of some convex parts (N, 2) [m], its corners on a grid [m] if there is one."""
    polygons = [shapely.Polygon(part) for part in parts]
    _check_crossings(f"an object of {len(parts):,} parts", polygons)
    return _areal(shapely.union_all(polygons, grid_size=grid))


def _check_crossings(name: str, shapes: Any) -> None:
    """Refuse polygons whose edges cross so often that resolving it would take too long."""
    rings = shapely.get_rings(shapely.get_parts(shapes))
    points, ring = shapely.get_coordinates(rings, return_index=True)
    begins = np.flatnonzero(ring[1:] == ring[:-1])
    count = len(begins)
    most = _CROSSINGS[0] + _CROSSINGS[1] * count
    if count * count <= most:
        return
    a = points[begins]
    b = points[begins + 1]
    edges = shapely.linestrings(np.stack([a, b], axis=1))
    tree = shapely.STRtree(edges)
    near = crossings = 0
    for first in range(0, count, _EDGES_AT_ONCE):
        i, j = tree.query(edges[first : first + _EDGES_AT_ONCE])
        i += first
        near += len(i)
        i, j = np.stack([i, j])[:, i < j]
        apart = _side(a[i], b[i], a[j]) * _side(a[i], b[i], b[j]) < 0.0
        apart &= _side(a[j], b[j], a[i]) * _side(a[j], b[j], b[i]) < 0.0
        crossings += int(np.count_nonzero(apart))
        if crossings > most or near > _NEAR_PAIRS * count:
            raise InvalidInputError(
                f"{name} with {count:,} corners is too tangled: at least {crossings:,} crossings, "
                f"{near:,} pairs of edges beside each other; draw it without crossings, or with "
                "fewer corners"
            )


def _side(start: FloatArray, end: FloatArray, point: FloatArray) -> FloatArray:
    """1 where points (N, 2) are to the left of lines through two others, -1 to the right."""
    along = (end - start).T
    away = (point - start).T
    sides: FloatArray = np.sign(along[0] * away[1] - along[1] * away[0])
    return sides


def _polygon(name: str, shape: Any) -> Any:
    """The shape as a polygon of Shapely, valid or not, with corners that count as different."""
    if isinstance(shape, shapely.Geometry):
        if shape.geom_type not in ("Polygon", "MultiPolygon") or shape.is_empty:
            raise InvalidInputError(
                f"{name} must be a polygon with an area, got {shape.geom_type} {shape.wkt[:40]}"
            )
        points = shapely.get_coordinates(shape)
    else:
        points = array(name, shape, (None, 2))
    largest = float(np.abs(points).max(initial=0.0))
    if not largest <= LARGEST_M:
        raise InvalidInputError(f"{name} must lie within {LARGEST_M:g} m, got {largest:g} m")
    if len(points) < 3:
        raise InvalidInputError(f"{name} must have at least 3 corners, got {len(points)}")
    if not isinstance(shape, shapely.Geometry):
        steps = np.roll(points, -1, axis=0) - points
        points = points[np.hypot(*steps.T) > 1e-9 * float(np.ptp(points, axis=0).max())]
        if len(points) < 3:
            raise InvalidInputError(f"{name} must have at least 3 corners that differ")
        shape = shapely.Polygon(points)
    if len(points) > MOST_CORNERS:
        raise InvalidInputError(
            f"{name} may have {MOST_CORNERS:,} corners at most if it is not convex, got "
            f"{len(points):,}: split it, or leave out corners"
        )
    return shape


def _if_convex(name: str, shape: Any) -> FloatArray | None:
    """The outline, if it is one ring and convex."""
    ring = shape
    if isinstance(shape, shapely.Geometry):
        if shape.geom_type != "Polygon" or len(shape.interiors) or shape.is_empty:
            return None
        ring = shapely.get_coordinates(shape)
    try:
        return convex_outline(name, ring)
    except InvalidInputError:
        return None


def _areal(shape: Any) -> Any:
    """The pieces of a shape that have an area, without slivers."""
    pieces = [one for one in shapely.get_parts([shape]) if one.geom_type == "Polygon"]
    least = _SLIVER * sum(one.area for one in pieces)
    return shapely.MultiPolygon([one for one in pieces if one.area > least])


def _smoothed(whole: Any, size: float) -> Any:
    """The shape with fewer corners, where it has many."""
    if shapely.get_num_coordinates(whole) > _MANY_CORNERS:
        # no point moves further, so the change cannot be more
        return _areal(shapely.simplify(whole, _SMOOTHED * whole.area / whole.length))
    if shapely.get_num_coordinates(whole) <= _FEW_CORNERS + 1:
        return whole
    for tolerance in _TOLERANCES:
        less = shapely.simplify(whole, tolerance * size)
        if shapely.symmetric_difference(whole, less).area <= _SMOOTHED * whole.area:
            return _areal(less)
    return whole


def _triangles(shape: Any) -> FloatArray:
    """(T, 3, 2) corners [m] of triangles that make up a shape."""
    pieces = shapely.get_parts(shapely.constrained_delaunay_triangles(shape))
    triangles: FloatArray = shapely.get_coordinates(pieces).reshape(-1, 4, 2)[:, :3]
    return triangles


def _merged(triangles: FloatArray, budget: float, sliver: float) -> list[FloatArray]:
    """Few convex outlines whose union is that of triangles (T, 3, 2), up to an area `budget` [m²].

    Those without an area are left out, and those below a fraction `sliver` of all.
    """
    owners = geometry.merge_pieces(
        triangles.reshape(-1, 2), 3 * np.arange(len(triangles) + 1), budget
    )
    order = np.argsort(owners, kind="stable")
    points = shapely.points(triangles[order].reshape(-1, 2))
    hulls = shapely.convex_hull(shapely.multipoints(points, indices=np.repeat(owners[order], 3)))
    areas = shapely.area(hulls)
    boxes = shapely.bounds(hulls)
    least = 1e-9 * (boxes[:, 2:] - boxes[:, :2]).max(axis=1) ** 2
    kept = hulls[areas > np.maximum(least, sliver * areas.sum())]
    # Shapely's hulls are clockwise, and their first corner is there twice
    return convex_outlines("part", [shapely.get_coordinates(hull)[-2::-1] for hull in kept])
