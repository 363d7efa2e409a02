"""Swaths: the cells of a map that a robot newly covers along a primitive, as runs in columns."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from pushplan.motion.state_lattice.primitive_set import PrimitiveSet
from pushplan.motion.state_lattice.swath_kernels import sweep_cells
from pushplan.world.checks import FloatArray, IntArray


class Swaths(NamedTuple):
    """Newly covered cells of P primitives, relative to the cell of the start."""

    first: IntArray  # (P + 1,) where the runs of each primitive start
    # (R, 3) column, first row, and the row after the last: columns, since a robot drives along rows
    # most of the time and its swath then is few long runs
    runs: IntArray


def swaths(
    primitives: PrimitiveSet,  # the set
    vertices: FloatArray,  # (V, 2) convex parts of the footprint in lattice steps, body frame
    offsets: IntArray,  # (Q + 1,) where each part starts
    cells_per_step: int,  # how many cells of the map a lattice step is long
) -> Swaths:
    """Swaths of all primitives of a set, cached by everything that they depend on."""
    shape = np.round(vertices, 9).tobytes()
    return _swaths(primitives, shape, offsets.tobytes(), cells_per_step)


@functools.lru_cache(maxsize=32)
def _swaths(primitives: PrimitiveSet, shape: bytes, starts: bytes, cells_per_step: int) -> Swaths:
    vertices = np.frombuffer(shape).reshape(-1, 2) * cells_per_step
    offsets = np.frombuffer(starts, dtype=np.int64)
    reach = float(np.hypot(vertices[:, 0], vertices[:, 1]).max())
    parts, first = [], [0]
    for p in range(len(primitives)):
        pieces = primitives.pieces[p] * np.array([cells_per_step, 1.0 / cells_per_step])
        heading = float(primitives.angles[primitives.heading_of(p)])
        parts.append(sweep_cells(heading, pieces, vertices, offsets, reach, 0.5))
        first.append(first[-1] + len(parts[-1]))
    return Swaths(np.array(first, dtype=np.int64), np.concatenate(parts))


def flat_runs(runs: IntArray, stride: int) -> IntArray:
    """(R, 2) runs of `Swaths` as offsets in flattened sums with ``stride`` entries a column."""
    flat: IntArray = runs[:, :1] * stride + runs[:, 1:]
    return flat
