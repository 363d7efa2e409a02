"""Pieces of random path shortcutting with Dubins curves, compiled."""

from __future__ import annotations

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.motion.dubins import dubins, sample_pieces
from pushplan.world.checks import FloatArray


@kernel
def displace(pose: FloatArray, sideways: float, turn: float, out: FloatArray) -> None:
    """Write a pose (3,) moved to its left by ``sideways`` [m] and turned by ``turn`` [rad]."""
    out[0] = pose[0] - sideways * np.sin(pose[2])
    out[1] = pose[1] + sideways * np.cos(pose[2])
    out[2] = pose[2] + turn


@kernel
def copy_start(
    poses: FloatArray,
    curvatures: FloatArray,
    last: int,
    out: FloatArray,
    out_curvatures: FloatArray,
) -> int:
    """Copy a path up to its pose ``last``; the number of poses."""
    copy_into(out[: last + 1], poses[: last + 1])
    copy_into(out_curvatures[: last + 1], curvatures[: last + 1])
    return last + 1


@kernel(allocates=True)
def lay_dubins(
    start: FloatArray,  # (3,)
    end: FloatArray,  # (3,)
    limits: tuple[float, float, float],  # turning radius, spacing [m], greatest turn in all [rad]
    poses: FloatArray,
    curvatures: FloatArray,
) -> int:
    """Sample the Dubins path between two poses; -1 where it turns too much or does not fit."""
    radius, spacing, most_turn = limits
    pieces = np.empty((3, 2))
    dubins(start, end, radius, pieces)
    turn = 0.0
    for i in range(3):
        turn += abs(pieces[i, 0] * pieces[i, 1])
    if turn > most_turn:
        return -1
    count: int = sample_pieces(start, pieces, spacing, poses, curvatures)
    return count


@kernel
def copy_rest(
    poses: FloatArray,  # (N, 3) the old path
    curvatures: FloatArray,  # (N,)
    last: int,  # its pose at which the new piece of ``out`` ends
    out: FloatArray,
    out_curvatures: FloatArray,
    size: int,  # poses in ``out`` so far
) -> int:
    """Copy a path after its pose ``last``, with the whole turns of a new piece; the new size."""
    rest = poses.shape[0] - 1 - last
    # the new piece may end with whole turns more or less than the old one
    turns = np.rint((out[size - 1, 2] - poses[last, 2]) / (2.0 * np.pi))
    copy_into(out[size : size + rest], poses[last + 1 :])
    copy_into(out_curvatures[size : size + rest], curvatures[last + 1 :])
    for n in range(size, size + rest):
        out[n, 2] += 2.0 * np.pi * turns
    total: int = size + rest
    return total
