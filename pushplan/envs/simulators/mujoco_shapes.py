"""Upright prisms for MuJoCo: outlines of the plane, given a height."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from pushplan.envs.simulators.mujoco_library import mujoco
from pushplan.world.checks import FloatArray
from pushplan.world.outline import centroid, signed_area


def as_rectangle(outline: FloatArray) -> tuple[FloatArray, FloatArray, float] | None:
    """Centre (2,), half sides (2,) [m] and heading [rad] of an outline, None if not rectangular."""
    if len(outline) != 4:
        return None
    edges = np.roll(outline, -1, axis=0) - outline
    lengths = np.hypot(edges[:, 0], edges[:, 1])
    right_angle = 1e-9 * lengths[0] * lengths[1]
    if abs(edges[0] @ edges[1]) > right_angle or np.abs(edges[0] + edges[2]).max() > 1e-9:
        return None
    heading = math.atan2(edges[0, 1], edges[0, 0])
    return outline.mean(axis=0), 0.5 * lengths[:2], heading


def add_geom(
    spec: Any,
    body: Any,
    name: str,
    shape: str,
    size: Sequence[float],
    pos: Sequence[float],
    kind: str,
    color: str | None = None,
    yaw: float = 0.0,
) -> None:
    """Give a body a geom.

    Args:
        spec: the model.
        body: MjsBody that gets it.
        name: of the geom.
        shape: such as ``"box"``.
        size: three half sides, or what MuJoCo takes for the shape [m].
        pos: of its middle in the frame of the body [m].
        kind: the class in ``mujoco_scene.xml`` that says how it touches and grips.
        color: ``#rrggbb``; that of the class if None.
        yaw: turn about the vertical axis [rad].
    """
    geom = body.add_geom(
        spec.find_default(kind),
        name=name,
        type=getattr(mujoco.mjtGeom, f"mjGEOM_{shape.upper()}"),
        pos=pos,
        size=size,
        quat=[math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw)],
    )
    if color is not None:
        geom.rgba = rgba(color)


def add_prism(
    spec: Any,
    body: Any,
    name: str,
    outline: FloatArray,
    low: float,
    high: float,
    kind: str,
    color: str | None = None,
) -> None:
    """Give a body an upright prism.

    Args:
        spec: the model, which gets a mesh where the outline is not a rectangle.
        body: MjsBody that gets the geom.
        name: of the geom and the mesh.
        outline: (N, 2) convex corners in the frame of the body [m].
        low: lower end in the frame of the body [m].
        high: upper end [m].
        kind: as in `add_geom`.
        color: likewise.
    """
    box = as_rectangle(outline)
    if box is not None:
        center, half, heading = box
        size = [*half, 0.5 * (high - low)]
        pos = [*center, 0.5 * (low + high)]
        add_geom(spec, body, name, "box", size, pos, kind, color, heading)
        return
    count = len(outline)
    corners = np.empty((2, count, 3))
    corners[..., :2] = outline
    corners[0, :, 2] = low
    corners[1, :, 2] = high
    mesh = spec.add_mesh(name=name, uservert=corners.ravel(), userface=_prism_faces(count))
    mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
    add_geom(spec, body, name, "mesh", [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], kind, color)
    body.geoms[-1].meshname = name


def _prism_faces(count: int) -> FloatArray:
    """Triangles of a prism whose lower corners are 0 to N - 1 and upper ones N to 2 N - 1."""
    around = np.arange(count)
    after = (around + 1) % count
    sides = np.concatenate(
        [
            np.stack([around, after, after + count], axis=1),
            np.stack([around, after + count, around + count], axis=1),
        ]
    )
    fan = np.arange(1, count - 1)
    lid = np.stack([np.full(count - 2, count), fan + count, fan + 1 + count], axis=1)
    base = np.stack([np.zeros(count - 2, dtype=int), fan + 1, fan], axis=1)
    faces: FloatArray = np.concatenate([sides, lid, base]).ravel()
    return faces


def prisms_inertia(
    pieces: Sequence[FloatArray], height: float, mass: float
) -> tuple[FloatArray, FloatArray]:
    """`prism_inertia` of a body of several prisms that do not overlap, (N, 2) corners each [m]."""
    if len(pieces) == 1:
        return prism_inertia(pieces[0], height, mass)
    areas = np.array([signed_area(piece) for piece in pieces])
    each = [
        prism_inertia(piece, height, part)
        for piece, part in zip(pieces, mass * areas / areas.sum(), strict=True)
    ]
    centers = np.array([center for center, _ in each])
    center = areas @ centers / areas.sum()
    inertia = sum(own for _, own in each)
    shares = mass * areas / areas.sum()
    x, y = (centers - center).T
    apart = [shares @ y**2, shares @ x**2, shares @ (x**2 + y**2), -(shares @ (x * y)), 0.0, 0.0]
    return center, inertia + np.array(apart)


def prism_inertia(outline: FloatArray, height: float, mass: float) -> tuple[FloatArray, FloatArray]:
    """Centre of mass and inertia of an upright prism of uniform density.

    Args:
        outline: (N, 2) corners, counter-clockwise [m].
        height: [m].
        mass: [kg].

    Returns:
        Centroid (2,) [m] and (6,) inertia about it: xx, yy, zz, xy, xz, yz [kg m²].
    """
    center = centroid(outline)
    p = outline - center
    q = np.roll(p, -1, axis=0)
    cross = p[:, 0] * q[:, 1] - q[:, 0] * p[:, 1]
    scale = mass / signed_area(outline)
    # second moments of area of a polygon, as sums over its edges
    xx = scale / 12.0 * float(cross @ (p[:, 0] ** 2 + p[:, 0] * q[:, 0] + q[:, 0] ** 2))
    yy = scale / 12.0 * float(cross @ (p[:, 1] ** 2 + p[:, 1] * q[:, 1] + q[:, 1] ** 2))
    mixed = 2.0 * (p[:, 0] * p[:, 1] + q[:, 0] * q[:, 1]) + p[:, 0] * q[:, 1] + q[:, 0] * p[:, 1]
    xy = scale / 24.0 * float(cross @ mixed)
    tall = mass * height * height / 12.0
    return center, np.array([yy + tall, xx + tall, xx + yy, -xy, 0.0, 0.0])


def set_mass(
    body: Any, pieces: Sequence[FloatArray], height: float, mass: float, center: Sequence[float]
) -> None:
    """Give a body the mass and the inertia of prisms, about a centre of mass (3,) [m]."""
    body.mass = mass
    body.ipos = center
    body.fullinertia = prisms_inertia(pieces, height, mass)[1]
    body.explicitinertial = True


def rgba(color: str) -> list[float]:
    """A colour ``#rrggbb`` of the drawing room in MuJoCo's units."""
    return [value / 255.0 for value in bytes.fromhex(color[1:] + "ff")]
