"""Interface of observation builders, as tasks, environments and networks use it."""

from __future__ import annotations

from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from pushplan.world import World


class ObservationBuilder(Protocol):
    """Turns a snapshot into an array of fixed shape and type, within fixed bounds."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array."""

    @property
    def dtype(self) -> np.dtype[Any]:
        """Element type of the array."""

    @property
    def low(self) -> float:
        """Least value of an element."""

    @property
    def high(self) -> float:
        """Greatest value of an element."""

    def observe(self, world: World) -> NDArray[Any]:
        """A new array for this snapshot."""


class LimitedVector:
    """Base of builders of float32 vectors whose entries lie between ``-limit`` and ``limit``."""

    limit: float
    dtype: ClassVar[np.dtype[Any]] = np.dtype(np.float32)

    @property
    def low(self) -> float:
        """Least value of any entry."""
        return -self.limit

    @property
    def high(self) -> float:
        """Greatest value of any entry."""
        return self.limit
