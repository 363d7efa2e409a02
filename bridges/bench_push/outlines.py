"""Shapes of Pymunk as lists of corners, as world files have them."""

from __future__ import annotations

import numpy as np
import pymunk
from shapely.geometry import MultiPoint, Polygon


def pose_of(body: pymunk.Body) -> list:
    """[x, y, theta] of a body."""
    x, y = body.position
    return [float(x), float(y), float(body.angle)]


def convex(points: object) -> list:
    """Corners as lists, counter-clockwise."""
    corners = np.array([(float(x), float(y)) for x, y in points])
    x, y = corners.T
    area = float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    return (corners if area > 0.0 else corners[::-1]).tolist()


def outline_of(shape: pymunk.Poly, grown: float = 0.0) -> list:
    """The corners of a polygon, moved out by ``grown`` [m]; body frame."""
    if not grown:
        return convex(shape.get_vertices())
    return hull(Polygon(shape.get_vertices()).buffer(grown, join_style=2).exterior.coords)


def drawn_area(shape: pymunk.Poly) -> float:
    """Area of a polygon without its radius [m²]."""
    return float(Polygon(shape.get_vertices()).area)


def hull(points: object) -> list:
    """The convex hull, counter-clockwise."""
    return convex(list(MultiPoint(list(points)).convex_hull.exterior.coords)[:-1])


def statics(space: pymunk.Space) -> tuple[list, list]:
    """Polygons and thick segments of everything that stands still, grown by their radius."""
    polygons = []
    segments = []
    for shape in space.shapes:
        label = getattr(shape, "label", "")
        if shape.body.body_type != pymunk.Body.STATIC or label == "receptacle":
            continue
        to_world = shape.body.local_to_world
        if isinstance(shape, pymunk.Segment):
            a = to_world(shape.a)
            b = to_world(shape.b)
            ends = {"from": [float(a.x), float(a.y)], "to": [float(b.x), float(b.y)]}
            segments.append({**ends, "radius": float(shape.radius)})
        else:
            polygons.append(
                convex([to_world(corner) for corner in outline_of(shape, shape.radius)])
            )
    return polygons, segments


def can_leave(a: np.ndarray, b: np.ndarray, size: float, walls: list) -> bool:
    """Whether a square of this size [m] finds room somewhere outside the edge from a to b."""
    along = (b - a) / np.linalg.norm(b - a)
    out = np.array([along[1], -along[0]])
    for share in np.linspace(0.0, 1.0, 41):
        corner = a + share * (np.linalg.norm(b - a) - size) * along
        corners = [
            corner,
            corner + size * along,
            corner + size * (along + out),
            corner + size * out,
        ]
        if not any(wall.intersects(Polygon(corners)) for wall in walls):
            return True
    return False
