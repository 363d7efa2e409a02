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
    convex_hull,
    convex_outline,
    convex_outlines,
    flatten,
    listed,
    signed_area,
    well_formed,
)

MOST_CHANGE = 0.01
"""Fraction of its area by which repair and cutting may change an outline."""
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


def outline_parts(name: str, shape: Any) -> OutlineParts:
    """Repair one outline and cut it into convex parts.

    Corners may go round either way and may be repeated. Spikes are left out, and loops where the
    outline crosses itself are resolved by Shapely's `make_valid`.

    Args:
        name: of the outline, for messages.
        shape: (N, 2) corners [m], or a polygon of Shapely, which may have holes.

    Raises:
        InvalidInputError: if it has no area, or if the parts differ from it by more than 1 % of it.
    """
    convex = _if_convex(name, shape)
    if convex is not None:
        return OutlineParts((convex,), 0.0, False)
    given = _polygon(name, shape)
    repaired = not given.is_valid
    whole = _areal(shapely.make_valid(given, method="structure", keep_collapsed=False))
    low_x, low_y, high_x, high_y = given.bounds
    size = max(high_x - low_x, high_y - low_y)
    if not whole.area > 1e-9 * size * size:
        raise InvalidInputError(f"{name} must have an area, got {whole.area:g} m²")
    unclear = abs(given.area - whole.area) / whole.area  # the first by the shoelace formula
    if unclear > MOST_CHANGE:
        raise InvalidInputError(
            f"{name} crosses itself: it has an area of {given.area:.4g} m² as it is and of "
            f"{whole.area:.4g} m² without loops, which may differ by {100 * MOST_CHANGE:g} %"
        )
    parts = _merged(_triangles(_smoothed(whole, size)), _FILLED * whole.area)
    union = shapely.union_all([shapely.Polygon(part) for part in parts])
    change = unclear + shapely.symmetric_difference(union, whole).area / whole.area
    if change > MOST_CHANGE:
        raise InvalidInputError(
            f"{name} must be a shape whose convex parts differ from it by at most "
            f"{100 * MOST_CHANGE:g} % of its area, got {100 * change:.2g} %"
        )
    return OutlineParts(tuple(parts), change, repaired)


def cut_outlines(
    name: str, shapes: Sequence[Any], called: Callable[[int], str]
) -> list[ConvexParts]:
    """The convex parts of each of some shapes; see `pushplan.world.convex_shapes.shapes_of`."""
    named: list[list[tuple[str, Any]]] = []  # of each shape its outlines, with what they are called
    for i, shape in enumerate(listed(name, shapes)):
        if _is_list_of_outlines(shape):
            named.append([(f"{called(i)}, part {j}", each) for j, each in enumerate(shape)])
        else:
            named.append([(called(i), shape)])
    convex = iter(_convex_ones([outline for outlines in named for _, outline in outlines]))
    found = []
    changed: list[OutlineParts] = []
    for outlines in named:
        parts: list[FloatArray] = []
        for label, outline in outlines:
            if next(convex):
                parts.append(frozen(outline.copy()))
                continue
            cut = outline_parts(label, outline)
            parts += cut.parts
            if cut.repaired or cut.change > _SLIVER:
                changed.append(cut)
        found.append(tuple(parts))
    if changed:
        most = max(each.change for each in changed)
        warnings.warn(
            f"{len(changed)} of {len(found)} outlines were repaired or lost small dents: their "
            f"areas have changed by at most {100 * most:.2g} %",
            OutlineWarning,
            stacklevel=4,
        )
    return found


def _convex_ones(outlines: list[Any]) -> list[bool]:
    """Find the outlines that are arrays and need no repair, at a quick look at all of them."""
    plain = [
        isinstance(one, np.ndarray)
        and one.dtype == np.float64
        and one.ndim == 2
        and one.shape[1] == 2
        and len(one) >= 3
        for one in outlines
    ]
    good = np.array(plain, dtype=bool)
    good[good] = well_formed(*flatten([outlines[i] for i in np.flatnonzero(good).tolist()]))
    return [bool(one) for one in good]


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
    union = shapely.union_all([shapely.Polygon(part) for part in parts])
    triangles = np.array(_triangles(_areal(union)))
    along, across = np.moveaxis(triangles[:, 1:] - triangles[:, :1], 1, 0)
    doubled = along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0]
    triangles[doubled < 0.0] = triangles[doubled < 0.0, ::-1]
    least = _ROUNDING * np.abs(doubled).max()  # two corners may be one but for rounding
    return tuple(frozen(triangles[np.abs(doubled) > least]))


def union_rings(parts: ConvexParts) -> tuple[FloatArray, ...]:
    """Outlines (N, 2) [m] of the union of some convex parts, those of its holes too."""
    union = _areal(shapely.union_all([shapely.Polygon(part) for part in parts]))
    rings = [ring for piece in union.geoms for ring in (piece.exterior, *piece.interiors)]
    return tuple(shapely.get_coordinates(ring)[:-1] for ring in rings)


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
    if isinstance(shape, shapely.Geometry):
        return shape
    steps = np.roll(points, -1, axis=0) - points
    kept = points[np.hypot(*steps.T) > 1e-9 * float(np.ptp(points, axis=0).max())]
    if len(kept) < 3:
        raise InvalidInputError(f"{name} must have at least 3 corners that differ")
    return shapely.Polygon(kept)


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
    if shapely.get_num_coordinates(whole) <= _FEW_CORNERS + 1:
        return whole
    for tolerance in _TOLERANCES:
        less = shapely.simplify(whole, tolerance * size)
        if shapely.symmetric_difference(whole, less).area <= _SMOOTHED * whole.area:
            return _areal(less)
    return whole


def _triangles(shape: Any) -> list[FloatArray]:
    pieces = shapely.get_parts(shapely.constrained_delaunay_triangles(shape))
    return list(shapely.get_coordinates(pieces).reshape(-1, 4, 2)[:, :3])


def _merged(pieces: list[FloatArray], budget: float) -> list[FloatArray]:
    """Few convex outlines whose union is that of convex pieces, up to an area `budget` [m²]."""
    owners = geometry.merge_pieces(*flatten(pieces), budget)
    parts = [
        convex_hull(np.concatenate([pieces[i] for i in np.flatnonzero(owners == k)]))
        for k in range(owners.max() + 1)
    ]
    areas = [signed_area(part) for part in parts]
    least = _SLIVER * sum(areas)
    kept = [part for part, area in zip(parts, areas, strict=True) if area > least]
    return convex_outlines("part", kept)
