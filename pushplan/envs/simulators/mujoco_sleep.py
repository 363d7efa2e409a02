"""Resting objects of a MuJoCo scene, and the engine's record of who sleeps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from pushplan.envs.simulators.mujoco_library import mujoco
from pushplan.world.checks import BoolArray, FloatArray, IntArray
from pushplan.world.outline import outward_normals, transform_outlines, unflatten

AWAKE = -1 - 10
"""Value that MuJoCo writes for a tree that has just been woken: -(1 + mjMINAWAKE)."""
TILT = 1e-4
"""Square of half the sine of the greatest tilt at which an object may rest."""


def quiet_objects(
    velocities: FloatArray,
    positions: FloatArray,
    before: FloatArray,
    radii: FloatArray,
    speed: float,
    interval: float,
) -> BoolArray:
    """(K,) which objects have hardly moved of late, and do not stand tilted.

    Args:
        velocities: (K, 3) of floating bodies, or (K, 6) of free ones, turning last.
        positions: (K, 3) x, y, theta, or (K, 7) x, y, z and a quaternion w x y z.
        before: the same, one sample earlier.
        radii: (K,) of the objects [m]; they turn a rate of rotation into a speed.
        speed: below which an object counts as quiet [m/s].
        interval: since the sample before [s].
    """
    linear = 3 if velocities.shape[1] == 6 else 2
    sizes = radii[:, None]
    change = np.abs(positions - before)
    rates = np.abs(velocities)
    rates[:, linear:] *= sizes
    turned = change[:, linear:] * sizes
    upright: BoolArray = np.ones(len(radii), dtype=bool)
    if linear == 3:
        # half the turn, near enough while it is small; w says nothing of it
        turned = 2.0 * change[:, 4:] * sizes
        upright = (positions[:, 4:6] ** 2).sum(axis=1) < TILT
    moved = np.maximum(change[:, :linear].max(axis=1), turned.max(axis=1))
    slow: BoolArray = (rates.max(axis=1) < speed) & (moved < speed * interval)
    return upright & slow


def rest_gap(radii: FloatArray) -> float:
    """Objects closer than this [m] may touch: a hundredth of the smallest one's radius."""
    return 0.01 * float(radii.min()) if len(radii) else math.inf


def rest_cycles(
    poses: FloatArray,
    vertices: FloatArray,
    offsets: IntArray,
    radii: FloatArray,
    quiet: BoolArray,
    gap: float,
) -> NDArray[Any]:
    """Let quiet objects sleep, together with all that they may touch.

    MuJoCo wakes bodies that sleep together at once, and expects that no two bodies touch that sleep
    apart: objects closer than ``gap`` form a group, and one restless member keeps it awake.

    Args:
        poses: (K, 3) x, y [m], theta [rad].
        vertices: (V, 2) outlines in body frames, flattened [m].
        offsets: (K + 1,) where each begins.
        radii: (K,) of the discs that hold them [m].
        quiet: (K,) which may sleep.
        gap: nearer objects form a group [m].

    Returns:
        (1 + K,) the next tree of each sleeper's group, the robot's first.
    """
    count = len(poses)
    asleep = np.full(1 + count, AWAKE, dtype=np.int32)
    if not quiet.any():
        return asleep
    pairs = cKDTree(poses[:, :2]).query_pairs(2.0 * radii.max() + gap, output_type="ndarray")
    away = np.hypot(*(poses[pairs[:, 0], :2] - poses[pairs[:, 1], :2]).T)
    pairs = pairs[away <= radii[pairs].sum(axis=1) + gap]
    corners = unflatten(transform_outlines(poses, vertices, offsets), offsets)
    touch = [_widest_gap(corners[a], corners[b]) < gap for a, b in pairs.tolist()]
    links = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(count, count))
    links.data[~np.array(touch, dtype=bool)] = 0.0
    links.eliminate_zeros()
    groups, labels = connected_components(links, directed=False)
    for group in range(groups):
        members = np.flatnonzero(labels == group)
        if quiet[members].all():
            asleep[1 + members] = 1 + np.roll(members, -1)
    return asleep


def _widest_gap(a: FloatArray, b: FloatArray) -> float:
    """Widest gap [m] between convex outlines along a normal of an edge, negative if none."""
    gaps = [
        float(((there[:, None] - here) * outward_normals(here)).sum(axis=2).min(axis=0).max())
        for here, there in ((a, b), (b, a))
    ]
    return max(gaps)


def put_to_sleep(model: Any, data: Any, asleep: IntArray) -> None:
    """Set which trees sleep, and the lists that MuJoCo derives from that.

    Args:
        model: of the scene.
        data: changed in place.
        asleep: (T,) negative where a tree is awake.
    """
    data.tree_asleep[:] = asleep
    awake = asleep < 0
    state = mujoco.mjtSleepState
    bodies = np.where(awake[model.body_treeid], state.mjS_AWAKE, state.mjS_ASLEEP)
    bodies[model.body_treeid < 0] = state.mjS_STATIC
    data.tree_awake[:] = awake
    data.body_awake[:] = bodies
    moving = bodies != state.mjS_ASLEEP
    data.ntree_awake = int(awake.sum())
    data.nbody_awake = _listed(data.body_awake_ind, moving)
    # the world is no child
    data.nparent_awake = _listed(
        data.parent_awake_ind, moving[model.body_parentid] & (np.arange(model.nbody) > 0)
    )
    data.nv_awake = _listed(data.dof_awake_ind, awake[model.dof_treeid])


def _listed(into: IntArray, flags: BoolArray) -> int:
    """Write the indices of what is flagged at the beginning of an array; how many there are."""
    found = np.flatnonzero(flags)
    into[: len(found)] = found
    return len(found)
