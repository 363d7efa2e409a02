"""Compiled swaths: the cells of a map that a moving footprint covers, as runs in columns."""

from __future__ import annotations

import numpy as np

from pushplan.compiled import kernel
from pushplan.motion.dubins import sample_pieces
from pushplan.world.checks import BoolArray, FloatArray, IntArray


@kernel
def row_span(outline: FloatArray, row: float) -> tuple[float, float]:
    """Least and greatest column of a convex outline (N, 2) in a row; empty as (inf, -inf)."""
    low = np.inf
    high = -np.inf
    count = outline.shape[0]
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        a = outline[i, 0] - row
        b = outline[j, 0] - row
        if (a > 0.0 and b > 0.0) or (a < 0.0 and b < 0.0):
            continue
        if a == b:
            low = min(low, outline[i, 1], outline[j, 1])
            high = max(high, outline[i, 1], outline[j, 1])
            continue
        column = outline[i, 1] + (outline[j, 1] - outline[i, 1]) * a / (a - b)
        low = min(low, column)
        high = max(high, column)
    return low, high


@kernel(allocates=True)
def _stamp(
    pose: FloatArray,
    vertices: FloatArray,
    offsets: IntArray,
    middle: int,
    value: bool,
    window: BoolArray,
) -> None:
    """Set the cells of ``window`` whose centres a footprint at ``pose`` covers."""
    c = np.cos(pose[2])
    s = np.sin(pose[2])
    for part in range(offsets.shape[0] - 1):
        body = vertices[offsets[part] : offsets[part + 1]]
        outline = np.empty_like(body)
        for i in range(body.shape[0]):
            outline[i, 0] = pose[0] + c * body[i, 0] - s * body[i, 1] + middle
            outline[i, 1] = pose[1] + s * body[i, 0] + c * body[i, 1] + middle
        top = max(int(np.ceil(outline[:, 0].min() - 1e-9)), 0)
        bottom = min(int(np.floor(outline[:, 0].max() + 1e-9)), window.shape[0] - 1)
        for row in range(top, bottom + 1):
            low, high = row_span(outline, float(row))
            first = max(int(np.ceil(low - 1e-9)), 0)
            last = min(int(np.floor(high + 1e-9)), window.shape[1] - 1)
            for column in range(first, last + 1):
                window[row, column] = value


@kernel
def _runs(window: BoolArray, middle: int, out: IntArray) -> int:
    """Write the runs of set cells into ``out`` (M, 3) and return their number."""
    count = 0
    for column in range(window.shape[1]):
        row = 0
        while row < window.shape[0]:
            if window[row, column]:
                begin = row
                while row < window.shape[0] and window[row, column]:
                    row += 1
                out[count, 0] = column - middle
                out[count, 1] = begin - middle
                out[count, 2] = row - middle
                count += 1
            else:
                row += 1
    return count


@kernel(allocates=True)
def sweep_cells(
    heading: float,  # at the start [rad]
    pieces: FloatArray,  # (E, 2) length [cells] and curvature [1/cells] of the arcs
    vertices: FloatArray,  # (V, 2) parts of the footprint [cells], body frame
    offsets: IntArray,  # (P + 1,) where each part starts
    reach: float,  # radius of the disc about the origin that holds the footprint [cells]
    spacing: float,  # distance between the poses that are looked at [cells]
) -> IntArray:
    """(R, 3) runs of the cells that a footprint newly covers on its path from the cell (0, 0)."""
    length = pieces[:, 0].sum()
    middle = int(np.ceil(length + reach)) + 2
    window = np.zeros((2 * middle + 1, 2 * middle + 1), np.bool_)
    start = np.zeros(3)
    start[2] = heading
    # the greatest number of poses: spacing, and the bound on the turn between two poses
    turn = 0.0
    for i in range(pieces.shape[0]):
        turn += abs(pieces[i, 0] * pieces[i, 1])
    capacity = int(length / spacing + turn / 0.1) + 4 * pieces.shape[0] + 8
    poses = np.empty((capacity, 3))
    curvatures = np.empty(capacity)
    count = sample_pieces(start, pieces, spacing, poses, curvatures)
    for i in range(count):
        _stamp(poses[i], vertices, offsets, middle, True, window)
    _stamp(start, vertices, offsets, middle, False, window)
    runs = np.empty((window.shape[0] * 8, 3), np.int64)
    return runs[: _runs(window, middle, runs)]
