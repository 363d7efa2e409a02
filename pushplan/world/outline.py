"""Rules for a valid outline of corners, and the flattening of ragged outlines."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pushplan.core import geometry as core
from pushplan.errors import InvalidInputError, short
from pushplan.world.checks import BoolArray, FloatArray, IntArray, array, frozen

ConvexParts = tuple[FloatArray, ...]
"""Convex outlines, counter-clockwise, each (N, 2) [m]; the shape is their union."""

MOST_CORNERS = 1000
"""Corners of an outline that planners work with at most."""
_ALIKE = 4.0  # heights of edges over their median that are left out in one round
LARGEST_M = 1e70
"""Greatest coordinate [m]: its fourth power is finite still."""


def signed_area(corners: FloatArray) -> float:
    """Shoelace area of a polygon [m²], positive when counter-clockwise.

    Args:
        corners: (N, 2) corners [m], in order.
    """
    shifted = corners - corners[0]  # far from the origin the plain formula loses digits
    x = shifted[:, 0]
    y = shifted[:, 1]
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(np.roll(x, -1), y))


def centroid(corners: FloatArray) -> FloatArray:
    """Centre of area (2,) [m] of a simple polygon given by its (N, 2) corners [m]."""
    shifted = corners - corners[0]
    x = shifted[:, 0]
    y = shifted[:, 1]
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    sums = np.array([np.dot(x + np.roll(x, -1), cross), np.dot(y + np.roll(y, -1), cross)])
    centre: FloatArray = corners[0] + sums / (3.0 * cross.sum())
    return centre


def inscribed_radius(corners: FloatArray) -> float:
    """Radius [m] of the largest disc about the origin inside a convex outline, 0 if none.

    Args:
        corners: (V, 2) counter-clockwise [m].
    """
    return core.inscribed_radius(np.ascontiguousarray(corners))


def outward_normals(corners: FloatArray) -> FloatArray:
    """(N, 2) unit vectors outwards from the edges that begin at (N, 2) corners, in order [m]."""
    along = np.roll(corners, -1, axis=0) - corners
    normals: FloatArray = (
        np.stack([along[:, 1], -along[:, 0]], axis=1) / np.hypot(*along.T)[:, None]
    )
    return normals


def convex_outline(name: str, corners: ArrayLike) -> FloatArray:
    """Check one convex outline and return it counter-clockwise, as (N, 2) [m].

    The corners may go round either way, and the first may be repeated at the end. An outline that
    breaks a rule only by rounding is mended: corners that are repeated, or that rounding has put
    inside, are left out. See `_rounding`.

    Raises:
        InvalidInputError: fewer than 3 corners, no area, or not convex.
    """
    points: FloatArray = array(name, corners, (None, 2))
    largest = float(np.abs(points).max(initial=0.0))
    if largest > LARGEST_M:
        raise InvalidInputError(f"{name} must lie within {LARGEST_M:g} m, got {largest:g} m")
    if len(points) < 3:
        raise InvalidInputError(f"{name} must have at least 3 corners, got {len(points)}")
    ring = counter_clockwise(points)
    if _is_well_formed(ring):
        return ring
    rounding = _rounding(points)
    steps = np.roll(points, -1, axis=0) - points
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    for least in (1e-3 * rounding, rounding):  # a closed ring is not to lose its short edges
        ring = counter_clockwise(points[lengths > least])
        if len(ring) < 3:
            raise InvalidInputError(f"{name} must have at least 3 corners that differ")
        if _is_well_formed(ring):
            return frozen(ring)
    return frozen(_without_dents(name, ring, rounding))


def convex_hull(corners: FloatArray) -> FloatArray:
    """(H, 2) those of (N, 2) corners [m] that span the hull, counter-clockwise.

    Fewer than three where the corners lie on a line.
    """
    import shapely  # takes long to load, and few outlines need it

    ring = shapely.get_coordinates(shapely.convex_hull(shapely.multipoints(corners)))[:-1]
    return counter_clockwise(ring)


def _without_dents(name: str, ring: FloatArray, rounding: float) -> FloatArray:
    """The corners of a ring that span its hull, if the others lie on its edges up to rounding."""
    import shapely

    hull = shapely.convex_hull(shapely.multipoints(ring))
    size = float(np.ptp(ring, axis=0).max())
    if hull.area <= 1e-9 * size * size:
        raise InvalidInputError(f"{name} must have an area, got {hull.area:g} m²")
    # a ring may cross itself though all corners lie on the hull: then it has another area
    lost = abs(hull.area - signed_area(ring))
    corners = shapely.get_coordinates(hull).view(np.complex128)
    spans = np.isin(np.ascontiguousarray(ring).view(np.complex128)[:, 0], corners)
    rim = hull.exterior
    shapely.prepare(rim)
    if (
        lost > rounding * hull.length
        or not shapely.dwithin(rim, shapely.points(ring[~spans]), rounding).all()
        or not _is_well_formed(ring[spans])
    ):
        raise InvalidInputError(
            f"{name} must be convex: split it into convex parts first, got {short(ring.tolist())}"
        )
    spanning: FloatArray = ring[spans]
    return spanning


def _rounding(points: FloatArray) -> float:
    """Distance [m] that counts as rounding in an outline.

    A millionth of its size, and four times what float32 loses of its greatest coordinate; at most
    a thousandth of its size, as far from the origin float32 tells little of a small outline.
    """
    size = float(np.ptp(points, axis=0).max())
    single = float(np.finfo(np.float32).eps) * float(np.abs(points).max())
    return min(1e-6 * size + 4.0 * single, 1e-3 * size)


def counter_clockwise(points: FloatArray) -> FloatArray:
    """The corners in the other order if they run clockwise."""
    if len(points) < 3 or signed_area(points) >= 0.0:
        return points
    return frozen(np.ascontiguousarray(points[::-1]))


def _is_well_formed(points: FloatArray) -> bool:
    return bool(well_formed(*flatten([points]))[0])


def grown_outline(corners: FloatArray, margin: float) -> FloatArray:
    """A convex outline (N, 2) [m], counter-clockwise, grown by ``margin`` [m], as (M, 2) corners.

    It holds all points within the margin, with a corner for each corner and two for sharp ones
    (that turn by more than 100 degrees); at corners it reaches at most 1.56 margins away.
    """
    outline = np.ascontiguousarray(corners)
    return grown_outlines(outline, np.array([0, len(corners)]), np.array([margin]))[0]


def grown_outlines(
    vertices: FloatArray, offsets: IntArray, margins: FloatArray
) -> tuple[FloatArray, IntArray]:
    """`grown_outline` of each of K flattened outlines by its own margin (K,) [m]."""
    return core.grown_outlines(vertices, offsets, margins)


def enclosing_outline(corners: FloatArray) -> FloatArray:
    """A convex outline around another one (N, 2) [m], with at most `MOST_CORNERS` corners.

    It is the outline itself if that has no more; the radius of a circle becomes a hundred
    thousandth greater. Edges are left out whose neighbours meet nearest to them, in rounds of at
    most every other one.
    """
    while len(corners) > MOST_CORNERS:
        points = corners[:, 0] + 1j * corners[:, 1]
        edges = np.roll(points, -1) - points
        along = edges / np.abs(edges)
        last = np.roll(along, 1)
        following = np.roll(along, -1)
        # their imaginary parts are the sines of the turns
        before = last.conj() * along
        after = along.conj() * following
        both = last.conj() * following
        fit = (before.imag >= 0.0) & (after.imag >= 0.0) & (both.real > 0.0)
        # how far from its beginning the neighbours of an edge meet: at its end if it is straight
        share = np.divide(after.imag, both.imag, out=np.ones(len(edges)), where=both.imag > 0.0)
        reach = np.abs(edges) * share
        heights = np.where(fit, reach * before.imag, np.inf)
        limit = _ALIKE * float(np.median(heights))
        if limit == np.inf:
            break
        halves = [np.arange(first, len(edges) - 1, 2) for first in (0, 1)]
        low = max((half[heights[half] <= limit] for half in halves), key=len)
        low = low[np.argsort(heights[low], kind="stable")[: len(edges) - MOST_CORNERS]]
        points[low] += reach[low] * last[low]
        points = np.delete(points, low + 1)
        corners = np.column_stack([points.real, points.imag])
    return corners


def listed(name: str, outlines: Sequence[Any]) -> Sequence[Any]:
    """Check that outlines come in a list, a tuple or an array; they themselves are not looked at.

    Raises:
        InvalidInputError: naming the value otherwise.
    """
    a_list = isinstance(outlines, Sequence | np.ndarray) and not isinstance(outlines, str | bytes)
    if not a_list or (isinstance(outlines, np.ndarray) and outlines.ndim == 0):
        raise InvalidInputError(f"{name} must be a list of outlines, got {short(outlines)}")
    return outlines


def convex_outlines(name: str, outlines: Sequence[ArrayLike]) -> list[FloatArray]:
    """`convex_outline` of each of many outlines, called ``name`` and its index; much quicker."""
    points: list[FloatArray] = []
    for i, outline in enumerate(listed(name, outlines)):
        if (
            type(outline) is np.ndarray
            and outline.dtype == np.float64
            and outline.shape[1:] == (2,)
        ):
            points.append(outline)
        else:
            points.append(array(f"{name} {i}", outline, (None, 2)))
    vertices, offsets = flatten(points)
    found = list(unflatten(vertices, offsets))
    good = well_formed(vertices, offsets)  # no if not finite
    for i in np.flatnonzero(np.logical_not(good)).tolist():
        found[i] = convex_outline(f"{name} {i}", found[i])
    return found


def well_formed(vertices: FloatArray, offsets: IntArray) -> BoolArray:
    """Check which of some flattened outlines are convex, counter-clockwise and have an area.

    The rules of `convex_outline` without its allowance for rounding, for all of them at once.

    Args:
        vertices: (V, 2) corners [m].
        offsets: (K + 1,) where each outline starts.

    Returns:
        (K,) flags.
    """
    counts = np.diff(offsets)
    good: BoolArray = counts >= 3
    if not np.abs(vertices).max(initial=0.0) <= LARGEST_M:  # or not a number
        good &= [np.abs(corners).max() <= LARGEST_M for corners in unflatten(vertices, offsets)]
    if not good.all():
        outlines = unflatten(vertices, offsets)
        good[good] = well_formed(*flatten([outlines[k] for k in np.flatnonzero(good)]))
    if not good.all() or len(good) == 0:
        return good
    starts = offsets[:-1]
    after = next_corner(offsets)
    size = np.maximum.reduceat(vertices, starts) - np.minimum.reduceat(vertices, starts)
    least = 1e-9 * size.max(axis=1)
    least_area = least * size.max(axis=1)
    edges = vertices[after] - vertices
    following = edges[after]
    cross = edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0]
    turns = np.arctan2(cross, (edges * following).sum(axis=1))
    shifted = vertices - np.repeat(vertices[starts], counts, axis=0)
    twice = shifted[:, 0] * shifted[after, 1] - shifted[after, 0] * shifted[:, 1]
    good &= 0.5 * np.add.reduceat(twice, starts) > least_area
    good &= np.minimum.reduceat(np.hypot(edges[:, 0], edges[:, 1]), starts) > least
    good &= np.minimum.reduceat(cross, starts) >= -least_area
    # dents between many short edges are small one by one, but not together
    good &= np.abs(np.add.reduceat(np.abs(turns), starts) - 2.0 * np.pi) <= 1e-6
    return good


def areas_and_centroids(vertices: FloatArray, offsets: IntArray) -> tuple[FloatArray, FloatArray]:
    """`signed_area` (K,) [m²] and `centroid` (K, 2) [m] of flattened outlines with an area."""
    if len(offsets) < 2:
        return np.zeros(0), np.zeros((0, 2))
    starts = offsets[:-1]
    after = next_corner(offsets)
    shifted = vertices - np.repeat(vertices[starts], np.diff(offsets), axis=0)
    cross = shifted[:, 0] * shifted[after, 1] - shifted[after, 0] * shifted[:, 1]
    twice = np.add.reduceat(cross, starts)
    sums = np.add.reduceat((shifted + shifted[after]) * cross[:, None], starts)
    return 0.5 * twice, vertices[starts] + sums / (3.0 * twice[:, None])


def next_corner(offsets: IntArray) -> IntArray:
    """(V,) index of the corner that follows each corner of flattened outlines."""
    after = np.arange(1, offsets[-1] + 1)
    after[offsets[1:] - 1] = offsets[:-1]
    return after


def flatten(outlines: Sequence[FloatArray]) -> tuple[FloatArray, IntArray]:
    """Pack ragged outlines into one (V, 2) array and (K + 1,) offsets, both read-only."""
    offsets = np.zeros(len(outlines) + 1, dtype=np.int64)
    np.cumsum([len(outline) for outline in outlines], out=offsets[1:])
    vertices = np.concatenate(outlines) if outlines else np.zeros((0, 2))
    return frozen(np.ascontiguousarray(vertices)), frozen(offsets)


def outline_boxes(vertices: FloatArray, offsets: IntArray) -> FloatArray:
    """(K, 4) x_min, y_min, x_max, y_max [m] of packed outlines."""
    if len(offsets) < 2:
        return np.zeros((0, 4))
    first = offsets[:-1]
    low = np.minimum.reduceat(vertices, first)
    high = np.maximum.reduceat(vertices, first)
    return np.ascontiguousarray(np.hstack([low, high]))


def unflatten(vertices: FloatArray, offsets: IntArray) -> tuple[FloatArray, ...]:
    """The inverse of `flatten`; the outlines are views."""
    return tuple(vertices[a:b] for a, b in pairwise(offsets.tolist()))


def transform(pose: ArrayLike, points_body: FloatArray) -> FloatArray:
    """Carry (N, 2) points [m] from a body frame to the world.

    Args:
        pose: (3,) x, y [m] and theta [rad] of the body in the world frame.
        points_body: (N, 2) points in the body frame.
    """
    x, y, theta = np.asarray(pose, dtype=np.float64)
    c = np.cos(theta)
    s = np.sin(theta)
    rotation = np.array([[c, -s], [s, c]])
    points_world: FloatArray = points_body @ rotation.T + np.array([x, y])
    return points_world


def transform_outlines(poses: FloatArray, vertices: FloatArray, offsets: IntArray) -> FloatArray:
    """Carry flattened outlines (V, 2) [m] from the frames of K bodies at (K, 3) to the world."""
    x, y, theta = np.repeat(poses, np.diff(offsets), axis=0).T
    c = np.cos(theta)
    s = np.sin(theta)
    (u, v) = vertices.T
    return np.column_stack([x + c * u - s * v, y + s * u + c * v])
