"""Hull and surrounding floes as the kernels of ice contacts read them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray, IntArray


class IceBodies(NamedTuple):
    """Shapes and masses, as the kernels read them."""

    hull: FloatArray  # (V, 2) convex parts of the robot in its body frame [m]
    hull_offsets: IntArray  # (P + 1,)
    hull_radius: float
    vertices: FloatArray  # (W, 2) outlines of the objects in their body frames [m]
    offsets: IntArray  # (K + 1,)
    radii: FloatArray  # (K,) circumscribed radii [m]
    masses: FloatArray  # (K,) [kg]
    inverse_gyration: FloatArray  # (K,) 1 / c² [1/m²], c² being inertia over mass


class IceSettings(NamedTuple):
    """Numerical settings."""

    step: float  # Longest motion of a hull corner in one step [m]
    iterations: int  # Gauss-Seidel rounds in a step
    hull_friction: float
    friction: float  # Coulomb coefficients between hull and object, and between objects
    still: float  # Displacement in a step below which a body does not look for neighbours [m]


class IceScratch(NamedTuple):
    """Memory that one caller reuses."""

    hull: FloatArray  # (V, 2) hull corners in the world frame
    corners: FloatArray  # (W, 2) object corners in the world frame, kept up to date
    moves: FloatArray  # (K, 3) displacement of each object in this step
    state: IntArray  # (K,) 0 out of it, 1 in contact with something, 2 its neighbours are known
    pairs: IntArray  # (C, 2) bodies of each contact point
    points: FloatArray
    """(C, 11) of each contact point: normal, arms from both bodies, gap, both effective inverse
    masses, accumulated impulses along and across the normal."""
    spot: FloatArray  # (2, 5) points of one pair: x, y, normal, gap
    pose: FloatArray  # (2, 3) pose of the hull before a step, and its displacement


class IceProblem(NamedTuple):
    """Bodies, settings and memory of one caller in one thread; see `ice_problem`."""

    bodies: IceBodies
    settings: IceSettings
    scratch: IceScratch


@kernel(allocates=True)
def ice_problem(bodies: IceBodies, settings: IceSettings) -> IceProblem:
    """Bodies and settings with memory of their size."""
    count = bodies.radii.shape[0]
    most = 24 * count + 64
    scratch = IceScratch(
        np.empty_like(bodies.hull),
        np.empty_like(bodies.vertices),
        np.zeros((count, 3)),
        np.zeros(count, np.int64),
        np.empty((most, 2), np.int64),
        np.empty((most, 11)),
        np.empty((2, 5)),
        np.empty((2, 3)),
    )
    return IceProblem(bodies, settings, scratch)


@kernel(allocates=True)
def select_bodies(bodies: IceBodies, chosen: IntArray) -> IceBodies:
    """Some of the objects (M,), with the whole hull."""
    count = chosen.shape[0]
    offsets = np.zeros(count + 1, np.int64)
    for i in range(count):
        k = chosen[i]
        offsets[i + 1] = offsets[i] + bodies.offsets[k + 1] - bodies.offsets[k]
    vertices = np.empty((offsets[count], 2))
    for i in range(count):
        k = chosen[i]
        vertices[offsets[i] : offsets[i + 1]] = bodies.vertices[
            bodies.offsets[k] : bodies.offsets[k + 1]
        ]
    return IceBodies(
        bodies.hull,
        bodies.hull_offsets,
        bodies.hull_radius,
        vertices,
        offsets,
        bodies.radii[chosen],
        bodies.masses[chosen],
        bodies.inverse_gyration[chosen],
    )
