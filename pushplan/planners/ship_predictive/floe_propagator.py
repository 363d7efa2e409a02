"""`FloePropagator`: single floes along a path, pushed by the contact model."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pushplan.core import interaction as core
from pushplan.planners.ship_predictive.beam_node import BeamNode
from pushplan.planners.ship_predictive.channel_view import ChannelView
from pushplan.world.checks import FloatArray


class FloePropagator:
    """The ice as poses (N, K, 3) of the floes in reach, at each pose of the last piece of path."""

    batch = 1

    def __init__(self, view: ChannelView) -> None:
        self._floes = view.floes
        self._contacts = core.IceContacts(view.bodies, *view.settings)

    def start(self) -> FloatArray:
        """The floes now."""
        return self._floes[None]

    def advance(
        self, ices: Sequence[FloatArray], paths: Sequence[FloatArray]
    ) -> list[tuple[FloatArray, float]]:
        """The floes along each piece of path, and the work on them [kg m]."""
        return [self.sweep(ice[-1], path) for ice, path in zip(ices, paths, strict=True)]

    def sweep(
        self,
        floes: FloatArray,  # (K, 3) where they are before
        path: FloatArray,  # (N, 3) poses of the ship
    ) -> tuple[FloatArray, float]:
        """(N, K, 3) poses of the floes at each pose (N, 3) of a path, and the work [kg m]."""
        poses = floes.copy()
        out = np.empty((len(path), *poses.shape))
        return out, self._contacts.sweep(np.ascontiguousarray(path), poses, out)

    def trace(self, node: BeamNode[FloatArray], stopped: Callable[[], bool]) -> FloatArray:
        """(N, K, 3) poses of the floes at each pose of a path: they are known."""
        first, *others = node.chain()
        return np.concatenate([first.ice, *(later.ice[1:] for later in others)])
