"""`SweptPath`: a path with what it does to the objects."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.core import motion as core
from pushplan.world.checks import FloatArray


class SweptPath(NamedTuple):
    """A path with the objects that it sweeps; buffers may be longer than the poses in use."""

    poses: FloatArray  # (M, 3)
    curvatures: FloatArray  # (M,) curvature of the arc that leads to each pose [1/m]
    objects: FloatArray  # (M, K, 3) where the objects are when the robot is at each pose
    lengths: FloatArray  # (M,) path length so far, at its price [m]
    works: FloatArray  # (M,) interaction work so far [kg m]

    def view(self) -> core.SweptPath:
        """The same memory as the core reads and writes it."""
        return core.SweptPath(*self)


def make_swept_path(capacity: int, objects: int) -> SweptPath:
    """Empty buffers for ``capacity`` poses and ``objects`` objects."""
    return SweptPath(
        np.empty((capacity, 3)),
        np.zeros(capacity),
        np.empty((capacity, objects, 3)),
        np.zeros(capacity),
        np.zeros(capacity),
    )
