"""Sweeping a path in portions, so that a call can end in between and a changed path starts late."""

from __future__ import annotations

from typing import Protocol

from pushplan.compiled import owned
from pushplan.interaction.ice import IceInteraction
from pushplan.interaction.kernels import sweep_path
from pushplan.interaction.model import InteractionModel
from pushplan.interaction.path_sweep_kernels import add_works, sweep_near
from pushplan.interaction.quasi_static import QuasiStatic
from pushplan.world import World
from pushplan.world.checks import FloatArray

MARGIN = 1.0
"""How far from the hull objects are that a sweep still looks at [circumscribed radii]."""


class PathSweeper(Protocol):
    """Carries the objects along a portion of a path."""

    def run(self, path: FloatArray, poses: FloatArray, out: FloatArray, works: FloatArray) -> bool:
        """Sweep.

        Args:
            path: (N, 3) robot poses.
            poses: (K, 3) objects at the first of them; those at the last afterwards.
            out: (N, K, 3) receives the objects at each pose.
            works: (N - 1,) receives the work from each pose to the next [kg m].

        Returns:
            False where the robot jams.
        """
        ...


class IceSweeper:
    """Floes in open water."""

    def __init__(self, world: World, interaction: IceInteraction) -> None:
        self._bodies, self._settings = interaction.bodies(world), interaction.settings(world)
        self._margin = MARGIN * world.robot.circumscribed_radius

    def run(self, path: FloatArray, poses: FloatArray, out: FloatArray, works: FloatArray) -> bool:
        """See `PathSweeper`."""
        sweep_near(path, poses, self._bodies, self._settings, self._margin, out, works)
        return True


class QuasiStaticSweeper:
    """Objects among walls."""

    def __init__(self, world: World, interaction: QuasiStatic) -> None:
        self._bodies, self._settings = interaction.bodies(world), interaction.settings(world)
        self._masses = owned(world.movables.masses)

    def run(self, path: FloatArray, poses: FloatArray, out: FloatArray, works: FloatArray) -> bool:
        """See `PathSweeper`."""
        jammed = int(sweep_path(path, poses, self._bodies, self._settings, out))
        add_works(out, self._masses, works)
        return jammed < 0


class ModelSweeper:
    """Any other interaction model; it is asked anew for each portion."""

    def __init__(self, world: World, interaction: InteractionModel) -> None:
        self._world, self._interaction = world, interaction

    def run(self, path: FloatArray, poses: FloatArray, out: FloatArray, works: FloatArray) -> bool:
        """See `PathSweeper`."""
        start = self._world.moved(robot_pose=path[0], robot_twist=(0, 0, 0), movable_poses=poses)
        swept = self._interaction.sweep(start, path)
        out[:] = swept.object_poses
        poses[:] = out[-1]
        add_works(out, self._world.movables.masses, works)
        return swept.jammed_at < 0


def default_interaction(world: World) -> InteractionModel:
    """`IceInteraction` in open water, `QuasiStatic` where there are walls."""
    return QuasiStatic(friction=1.0) if world.static.convex_parts else IceInteraction()


def path_sweeper(world: World, interaction: InteractionModel | None = None) -> PathSweeper:
    """The sweeper for a model, by default `default_interaction`."""
    interaction = default_interaction(world) if interaction is None else interaction
    if isinstance(interaction, IceInteraction):
        return IceSweeper(world, interaction)
    if isinstance(interaction, QuasiStatic):
        return QuasiStaticSweeper(world, interaction)
    return ModelSweeper(world, interaction)
