"""Sweeping a path in portions, so that a call can end in between and a changed path starts late."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from pushplan.interaction import InteractionModel, QuasiStatic
from pushplan.interaction.ice import IceInteraction
from pushplan.interaction.ice_contacts import make_memory, sweep_ice
from pushplan.interaction.kernels import sweep_path
from pushplan.world import World
from pushplan.world.checks import FloatArray


class Sweeper(Protocol):
    """Carries the objects along a portion of a path."""

    def run(self, path: FloatArray, poses: FloatArray, out: FloatArray) -> bool:
        """Sweep.

        Args:
            path: (N, 3) robot poses.
            poses: (K, 3) objects at the first of them; those at the last afterwards.
            out: (N, K, 3) receives the objects at each pose.

        Returns:
            False where the robot jams.
        """
        ...


class IceSweeper:
    """Floes in open water."""

    def __init__(self, world: World, interaction: IceInteraction) -> None:
        self._crowd, self._solver = interaction.crowd(world), interaction.solver(world)
        self._memory = make_memory(self._crowd)

    def run(self, path: FloatArray, poses: FloatArray, out: FloatArray) -> bool:
        """See `Sweeper`."""
        sweep_ice(path, poses, self._crowd, self._solver, self._memory, out)
        return True


class QuasiStaticSweeper:
    """Objects among walls."""

    def __init__(self, world: World, interaction: QuasiStatic) -> None:
        self._bodies, self._settings = interaction.bodies(world), interaction.settings(world)

    def run(self, path: FloatArray, poses: FloatArray, out: FloatArray) -> bool:
        """See `Sweeper`."""
        return int(sweep_path(path, poses, self._bodies, self._settings, out)) < 0


class ModelSweeper:
    """Any other interaction model; it is asked anew for each portion."""

    def __init__(self, world: World, interaction: InteractionModel) -> None:
        self._world, self._interaction = world, interaction

    def run(self, path: FloatArray, poses: FloatArray, out: FloatArray) -> bool:
        """See `Sweeper`."""
        start = self._world.moved(robot_pose=path[0], movable_poses=poses)
        swept = self._interaction.sweep(start, path)
        out[:] = swept.object_poses
        poses[:] = out[-1]
        return swept.jammed_at < 0


def make_sweeper(world: World, interaction: InteractionModel | None) -> Sweeper:
    """The sweeper for a model; None chooses `IceInteraction` in open water, else `QuasiStatic`."""
    if interaction is None:
        walls = bool(world.static.convex_parts)
        interaction = QuasiStatic(friction=1.0) if walls else IceInteraction()
    if isinstance(interaction, IceInteraction):
        return IceSweeper(world, interaction)
    if isinstance(interaction, QuasiStatic):
        return QuasiStaticSweeper(world, interaction)
    return ModelSweeper(world, interaction)


def portion_works(out: FloatArray, masses: FloatArray) -> FloatArray:
    """(N - 1,) work on the objects from each pose to the next [kg m], from (N, K, 3) poses."""
    moved = out[1:, :, :2] - out[:-1, :, :2]
    works: FloatArray = np.sqrt((moved * moved).sum(axis=2)) @ masses
    return works
