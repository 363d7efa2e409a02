"""`BeamNode`: a path from the start on, and the contract of what keeps the ice along it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from pushplan.world.checks import FloatArray

Ice = TypeVar("Ice")


@dataclass(slots=True)
class BeamNode(Generic[Ice]):
    """A path from the start on."""

    pose: FloatArray
    """(3,) where it ends."""
    arc: FloatArray
    """(N, 4) last piece: poses, the first being that of the parent, and curvatures to each."""
    length: float
    work: float
    total: float
    """Cost so far plus estimate of the rest [kg m]."""
    ice: Ice
    parent: BeamNode[Ice] | None
    done: bool = False
    """True once the node has reached the goal."""

    def chain(self) -> list[BeamNode[Ice]]:
        """The nodes from the start on."""
        found: list[BeamNode[Ice]] = []
        at: BeamNode[Ice] | None = self
        while at is not None:
            found.append(at)
            at = at.parent
        return found[::-1]

    def path(self) -> FloatArray:
        """(N, 4) poses and curvatures from the start on."""
        first, *others = self.chain()
        return np.concatenate([first.arc, *(node.arc[1:] for node in others)])


class StatePropagator(Protocol[Ice]):
    """Keeps the ice along a path and says what going on does to it."""

    batch: int
    """Number of pieces that are predicted between two looks at the stop rule."""

    def start(self) -> Ice:
        """The ice now."""
        ...

    def advance(self, ices: Sequence[Ice], paths: Sequence[FloatArray]) -> list[tuple[Ice, float]]:
        """The ice after each piece (N, 3) of path, and the work on it [kg m]."""
        ...

    def trace(self, node: BeamNode[Ice], stopped: Callable[[], bool]) -> FloatArray | None:
        """(N, K, 3) poses of the floes in reach at each pose of a path; None if stopped before."""
        ...
