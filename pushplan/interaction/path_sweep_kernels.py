"""Compiled sweeps of a portion of a path, with the work on the way."""

from __future__ import annotations

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.interaction.ice_bodies import IceBodies, IceSettings, ice_problem, select_bodies
from pushplan.interaction.ice_contacts import sweep_ice
from pushplan.world.checks import FloatArray


@kernel
def add_works(out: FloatArray, masses: FloatArray, works: FloatArray) -> None:
    """Work on K objects from each of N poses to the next [kg m], from (N, K, 3) ``out``."""
    for n in range(works.shape[0]):
        works[n] = 0.0
        for k in range(masses.shape[0]):
            dx, dy = out[n + 1, k, 0] - out[n, k, 0], out[n + 1, k, 1] - out[n, k, 1]
            works[n] += masses[k] * np.sqrt(dx * dx + dy * dy)


@kernel(allocates=True)
def sweep_near(
    path: FloatArray,  # (N, 3) poses of the hull
    poses: FloatArray,  # (K, 3) poses of the objects, changed in place
    bodies: IceBodies,
    settings: IceSettings,
    margin: float,  # how far from the hull an object may be that is looked at [m]
    out: FloatArray,  # (N, K, 3) receives the poses at each path pose
    works: FloatArray,  # (N - 1,) receives the work from each pose to the next [kg m]
) -> None:
    """`sweep_ice` with those objects only that are near a short path; the rest stays."""
    middle = path[path.shape[0] // 2]
    span = 0.0
    for n in range(path.shape[0]):
        span = max(span, (path[n, 0] - middle[0]) ** 2 + (path[n, 1] - middle[1]) ** 2)
    reach = np.sqrt(span) + bodies.hull_radius + margin
    chosen = np.empty(poses.shape[0], np.int64)
    count = 0
    for k in range(poses.shape[0]):
        dx, dy = poses[k, 0] - middle[0], poses[k, 1] - middle[1]
        if dx * dx + dy * dy < (reach + bodies.radii[k]) ** 2:
            chosen[count] = k
            count += 1
    chosen = chosen[:count]
    part = select_bodies(bodies, chosen)
    here = poses[chosen]
    moved = np.empty((path.shape[0], count, 3))
    sweep_ice(path, here, ice_problem(part, settings), moved)
    add_works(moved, part.masses, works)
    for n in range(path.shape[0]):
        copy_into(out[n], poses)
        for i in range(count):
            copy_into(out[n, chosen[i]], moved[n, i])
    for i in range(count):
        copy_into(poses[chosen[i]], here[i])
