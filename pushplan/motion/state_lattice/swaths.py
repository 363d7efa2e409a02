"""Swaths: the cells of a map that a robot newly covers along a primitive, as runs in columns."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.motion.dubins import sample_pieces
from pushplan.motion.state_lattice.primitives import PrimitiveSet
from pushplan.world.checks import BoolArray, FloatArray, IntArray


class Swaths(NamedTuple):
    """Newly covered cells of P primitives, relative to the cell of the start.

    Args:
        first: (P + 1,) where the runs of each primitive start.
        runs: (R, 3) column, first row, and the row after the last: columns, since a robot drives
            along rows most of the time and its swath then is few long runs.
    """

    first: IntArray
    runs: IntArray


@kernel(allocates=True)
def row_span(outline: FloatArray, row: float) -> tuple[float, float]:
    """Least and greatest column of a convex outline (N, 2) in a row; empty as (inf, -inf)."""
    low, high = np.inf, -np.inf
    count = outline.shape[0]
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        a, b = outline[i, 0] - row, outline[j, 0] - row
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
    c, s = np.cos(pose[2]), np.sin(pose[2])
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


@kernel(allocates=True)
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
    heading: float,
    pieces: FloatArray,
    vertices: FloatArray,
    offsets: IntArray,
    reach: float,
    spacing: float,
) -> IntArray:
    """Cells that a footprint newly covers on its way from the cell (0, 0).

    Args:
        heading: at the start [rad].
        pieces: (E, 2) length [cells] and curvature [1/cells] of the arcs.
        vertices: (V, 2) parts of the footprint [cells], body frame.
        offsets: (P + 1,) where each part starts.
        reach: radius of the disc about the origin that holds the footprint [cells].
        spacing: distance between the poses that are looked at [cells].

    Returns:
        (R, 3) runs.
    """
    length = pieces[:, 0].sum()
    middle = int(np.ceil(length + reach)) + 2
    window = np.zeros((2 * middle + 1, 2 * middle + 1), np.bool_)
    start = np.zeros(3)
    start[2] = heading
    # the greatest number of poses: spacing, and the bound on the turn between two poses
    turn = 0.0
    for i in range(pieces.shape[0]):
        turn += abs(pieces[i, 0] * pieces[i, 1])
    room = int(length / spacing + turn / 0.1) + 4 * pieces.shape[0] + 8
    poses, bends = np.empty((room, 3)), np.empty(room)
    count = sample_pieces(start, pieces, spacing, poses, bends)
    for i in range(count):
        _stamp(poses[i], vertices, offsets, middle, True, window)
    _stamp(start, vertices, offsets, middle, False, window)
    runs = np.empty((window.shape[0] * 8, 3), np.int64)
    return runs[: _runs(window, middle, runs)]


class _Key(NamedTuple):
    """What swaths depend on, beside the primitives."""

    vertices: bytes
    offsets: bytes


def swaths(
    primitives: PrimitiveSet, vertices: FloatArray, offsets: IntArray, cells_per_step: int
) -> Swaths:
    """Swaths of all primitives of a set, cached by everything that they depend on.

    Args:
        primitives: the set.
        vertices: (V, 2) convex parts of the footprint in lattice steps, body frame.
        offsets: (Q + 1,) where each part starts.
        cells_per_step: how many cells of the map a lattice step is long.
    """
    rounded = np.round(vertices, 9)
    key = _Key(rounded.tobytes(), offsets.tobytes())
    return _swaths(primitives, key, cells_per_step)


@functools.lru_cache(maxsize=32)
def _swaths(primitives: PrimitiveSet, key: _Key, cells_per_step: int) -> Swaths:
    vertices = np.frombuffer(key.vertices).reshape(-1, 2) * cells_per_step
    offsets = np.frombuffer(key.offsets, dtype=np.int64)
    reach = float(np.hypot(vertices[:, 0], vertices[:, 1]).max())
    parts, first = [], [0]
    for p in range(len(primitives)):
        pieces = primitives.pieces[p] * np.array([cells_per_step, 1.0 / cells_per_step])
        heading = float(primitives.angles[primitives.heading_of(p)])
        parts.append(sweep_cells(heading, pieces, vertices, offsets, reach, 0.5))
        first.append(first[-1] + len(parts[-1]))
    return Swaths(np.array(first, dtype=np.int64), np.concatenate(parts))
