"""Lengths along polylines and paths of poses."""

from __future__ import annotations

import numpy as np

from pushplan.world.checks import BoolArray, FloatArray


def step_lengths(points: FloatArray) -> FloatArray:
    """Distance between consecutive points of paths.

    Args:
        points: (N, 2) or (N, 3) x, y [m] and maybe a heading; or (N, K, 2 or 3) for K paths.

    Returns:
        (N - 1,) or (N - 1, K) lengths [m]; headings do not count.
    """
    steps = np.diff(points[..., :2], axis=0)
    lengths: FloatArray = np.hypot(steps[..., 0], steps[..., 1])
    return lengths


def arc_lengths(points: FloatArray) -> FloatArray:
    """(N,) length of a path (N, 2 or 3) up to each of its points [m]."""
    return np.concatenate([[0.0], np.cumsum(step_lengths(points))])


def path_length(points: FloatArray) -> float:
    """Length [m] of a path (N, 2 or 3)."""
    return float(step_lengths(points).sum())


def path_lengths(points: FloatArray) -> FloatArray:
    """(K,) length [m] of each of the paths (N, K, 2 or 3)."""
    lengths: FloatArray = step_lengths(points).sum(axis=0)
    return lengths


def goes_back(poses: FloatArray, size: float) -> BoolArray:
    """(N,) whether the step from each pose (N, 3) leads back; the last as the one before.

    Args:
        poses: x, y [m] and heading [rad].
        size: of the robot [m]; what leads back by less than a thousandth of it is rounding.
    """
    moves = np.diff(poses[:, :2], axis=0)
    headings = poses[:-1, 2]
    back = moves[:, 0] * np.cos(headings) + moves[:, 1] * np.sin(headings) < -1e-3 * size
    return np.append(back, back[-1:] if len(back) else [False])
