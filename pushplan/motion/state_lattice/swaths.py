"""Swaths: the cells of a map that a robot newly covers along a primitive, as runs in columns."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pushplan.core import motion as core
from pushplan.motion.state_lattice.primitives import PrimitiveSet
from pushplan.motion.time_slicing import go_on, never
from pushplan.world.checks import FloatArray, IntArray

_FEW = 8  # primitives between two looks at a stop rule


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
    cells_per_step: int,  # length of a lattice step [cells of the map]
    stopped: Callable[[], bool] = never,
) -> Swaths:
    """Swaths of all primitives of a set, cached by everything that they depend on.

    What is done when the stop rule fires is kept for the next time.

    Raises:
        Stopped: if the stop rule fires before they are all there.
    """
    shape = np.round(vertices, 9).tobytes()
    return _maker(primitives, shape, offsets.tobytes(), cells_per_step).make(stopped)


class _SwathMaker:
    """Swaths of which some are there; thread-safe."""

    def __init__(
        self, primitives: PrimitiveSet, vertices: FloatArray, offsets: IntArray, cells: int
    ) -> None:
        self._cells = cells
        self._primitives = primitives
        self._vertices = vertices
        self._offsets = offsets
        self._reach = float(np.hypot(vertices[:, 0], vertices[:, 1]).max())
        self._parts: list[IntArray] = []
        self._lock = threading.Lock()

    def make(self, stopped: Callable[[], bool]) -> Swaths:
        """Work until all are there."""
        while len(self._parts) < len(self._primitives):
            go_on(stopped)
            with self._lock:
                for p in range(len(self._parts), len(self._primitives))[:_FEW]:
                    self._parts.append(self._one(p))
        return self._swaths

    def _one(self, p: int) -> IntArray:
        cells = self._cells
        primitives = self._primitives
        pieces = primitives.pieces[p] * np.array([cells, 1.0 / cells])
        heading = float(primitives.angles[primitives.heading_of(p)])
        return core.sweep_cells(heading, pieces, self._vertices, self._offsets, self._reach, 0.5)

    @functools.cached_property
    def _swaths(self) -> Swaths:
        first = np.cumsum([0, *(len(part) for part in self._parts)])
        return Swaths(first.astype(np.int64), np.concatenate(self._parts))


@functools.lru_cache(maxsize=32)
def _maker(
    primitives: PrimitiveSet, shape: bytes, starts: bytes, cells_per_step: int
) -> _SwathMaker:
    vertices = np.frombuffer(shape).reshape(-1, 2) * cells_per_step
    offsets = np.frombuffer(starts, dtype=np.int64)
    return _SwathMaker(primitives, vertices, offsets, cells_per_step)


def flat_runs(runs: IntArray, stride: int) -> IntArray:
    """(R, 2) runs of `Swaths` as offsets in flattened sums with ``stride`` entries a column."""
    flat: IntArray = runs[:, :1] * stride + runs[:, 1:]
    return flat
