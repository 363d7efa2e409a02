"""Carrying single floes along a path, pushed by the contact model."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pushplan.interaction.ice_contacts import make_memory, sweep_ice
from pushplan.planners.ship_predictive.beam import Partial
from pushplan.planners.ship_predictive.ice_scene import Scene
from pushplan.world.checks import FloatArray


class FloeCarrier:
    """The ice as poses (N, K, 3) of the floes in reach, at each pose of the last piece of path.

    Args:
        scene: what is searched.
    """

    batch = 1

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._memory = make_memory(scene.crowd)

    def start(self) -> FloatArray:
        """The floes now."""
        return self._scene.floes[None]

    def advance(
        self, ices: Sequence[FloatArray], paths: Sequence[FloatArray]
    ) -> list[tuple[FloatArray, float]]:
        """The floes along each piece of path, and the work on them [kg m]."""
        return [self.sweep(ice[-1], path) for ice, path in zip(ices, paths, strict=True)]

    def sweep(self, floes: FloatArray, path: FloatArray) -> tuple[FloatArray, float]:
        """(N, K, 3) poses of the floes at each pose (N, 3) of a path, and the work [kg m].

        Args:
            floes: (K, 3) where they are before.
            path: (N, 3) poses of the ship.
        """
        poses = floes.copy()
        out = np.empty((len(path), *poses.shape))
        way = np.ascontiguousarray(path)
        scene = self._scene
        work = sweep_ice(way, poses, scene.crowd, scene.solver, self._memory, out)
        return out, work

    def trace(self, node: Partial[FloatArray], stopped: Callable[[], bool]) -> FloatArray:
        """(N, K, 3) poses of the floes at each pose of a path: they are known."""
        first, *others = node.ices()
        return np.concatenate([first, *(ice[1:] for ice in others)])
