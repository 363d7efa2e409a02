"""The ice along a path: single floes, or an occupancy map that the network changes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from pushplan.core import interaction as core
from pushplan.interaction.network import IceNetwork
from pushplan.interaction.occupancy import CHANNELS, PATCH_CELLS, Patch, cell_size, ice_density
from pushplan.planners.ship_predictive.beam_search import BeamNode
from pushplan.planners.ship_predictive.channel_view import ChannelView
from pushplan.world.checks import FloatArray

_TRACED = 10  # poses that are swept between two looks at the stop rule


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


class MapPropagator:
    """The ice as a map (H, W) of covered fractions; each piece of path changes a patch of it."""

    batch = 8

    def __init__(self, view: ChannelView, network: IceNetwork) -> None:
        self._view = view
        self._network = network
        self._cell = cell_size(view.world)
        self._scale = ice_density(view.world) * self._cell**3
        half = PATCH_CELLS // 2
        channel = view.channel
        reach = half * self._cell
        low = np.array([channel.low[0] - reach, -view.length - reach])
        high = np.array([channel.high[0] + reach, max(channel.goal, 0.0) + view.length + reach])
        self._corner = self._cell * np.floor(low / self._cell)
        columns, rows = np.ceil((high - self._corner) / self._cell).astype(int)
        self._start = np.zeros((max(rows, PATCH_CELLS), max(columns, PATCH_CELLS)), np.float32)
        objects = view.objects
        floes = view.floes[objects.part_owners]
        frame = np.array([*self._corner, 0.0])
        core.cover_objects(
            floes, objects.part_vertices, objects.part_offsets, frame, self._cell, self._start
        )

    def start(self) -> Patch:
        """The map now."""
        return self._start

    def advance(
        self, ices: Sequence[Patch], paths: Sequence[FloatArray]
    ) -> list[tuple[Patch, float]]:
        """The maps after each piece of path, and the work on the ice [kg m]; one network call."""
        robot = self._view.world.robot
        patches = np.empty((len(ices), len(CHANNELS), PATCH_CELLS, PATCH_CELLS), np.float32)
        places = [self._place(path) for path in paths]
        for i, (ice, path, (row, column)) in enumerate(zip(ices, paths, places, strict=True)):
            patches[i, 0] = ice[row : row + PATCH_CELLS, column : column + PATCH_CELLS]
            corner = self._corner + self._cell * np.array([column, row])
            frame = np.array([*corner, 0.0])
            poses = np.ascontiguousarray(path)
            hull = (robot.vertices, robot.offsets, frame, self._cell)
            core.cover_sweep(poses[:1], *hull, patches[i, 1])
            core.cover_sweep(poses, *hull, patches[i, 2])
        after, work = self._network.predict_patches(patches)
        found = []
        for i, (ice, (row, column)) in enumerate(zip(ices, places, strict=True)):
            changed = ice.copy()
            changed[row : row + PATCH_CELLS, column : column + PATCH_CELLS] = after[i]
            found.append((changed, float(work[i]) * self._scale))
        return found

    def trace(self, node: BeamNode[Patch], stopped: Callable[[], bool]) -> FloatArray | None:
        """(N, K, 3) poses of the floes at each pose of a path, by the contact model."""
        floes = FloePropagator(self._view)
        path = node.path()[:, :3]
        out = self._view.floes[None]
        parts = [out]
        for i in range(0, len(path) - 1, _TRACED):
            if stopped():
                return None
            out = floes.sweep(out[-1], path[i : i + _TRACED + 1])[0]
            parts.append(out[1:])
        return np.concatenate(parts)

    def _place(self, path: FloatArray) -> tuple[int, int]:
        """First row and column of the patch about the middle between a piece's two ends."""
        middle = 0.5 * (path[0, :2] + path[-1, :2])
        column, row = (middle - self._corner) / self._cell
        rows, columns = self._start.shape
        half = PATCH_CELLS // 2
        return (
            min(max(math.floor(row + 0.5) - half, 0), rows - PATCH_CELLS),
            min(max(math.floor(column + 0.5) - half, 0), columns - PATCH_CELLS),
        )
