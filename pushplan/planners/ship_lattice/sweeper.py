"""Sweeping a path in portions, so that a call can end in between and a changed path starts late."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pushplan.compiled import kernel
from pushplan.interaction import InteractionModel, QuasiStatic
from pushplan.interaction.ice import IceInteraction
from pushplan.interaction.ice_contacts import Crowd, Solver, make_memory, sweep_ice
from pushplan.interaction.kernels import sweep_path
from pushplan.world import World
from pushplan.world.checks import BoolArray, FloatArray

MARGIN = 1.0
"""How far from the hull objects are that a sweep still looks at [R]."""


@dataclass(frozen=True)
class Near:
    """The part of a world that a sweep of limited length can move.

    Args:
        world: with the objects that are near.
        which: (K,) which of all objects they are.
    """

    world: World
    which: BoolArray

    @classmethod
    def around(cls, world: World, normal: FloatArray, ahead: float) -> Near:
        """The objects from a little behind the robot to a little beyond what is swept.

        Args:
            world: the snapshot.
            normal: (2,) direction of the way.
            ahead: how far along a path is swept [m].
        """
        size = world.robot.circumscribed_radius
        along = (world.movables.poses[:, :2] - world.robot_pose[:2]) @ normal
        room = (1.0 + MARGIN) * size + world.movables.radii
        which = (along > -ahead - room) & (along < ahead + room)
        if which.all():
            return cls(world, which)
        near = World(
            world.robot,
            world.robot_pose,
            world.static,
            world.movables.select(which),
            world.goal,
        )
        return cls(near, which)

    def everything(self, world: World, objects: FloatArray, missing: int) -> FloatArray:
        """(M + missing, K, 3) poses of all objects of a world; those after the M given ones rest.

        Args:
            world: the whole world.
            objects: (M, N, 3) poses of those that are near.
            missing: how many more poses there are.
        """
        count = len(objects)
        out = np.empty((count + missing, len(world.movables), 3))
        out[:] = world.movables.poses
        out[:count, self.which] = objects
        out[count:, self.which] = objects[-1]
        return out


class Sweeper(Protocol):
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


@kernel(allocates=True)
def add_works(out: FloatArray, masses: FloatArray, works: FloatArray) -> None:
    """Work on K objects from each of N poses to the next [kg m], from (N, K, 3) ``out``."""
    for n in range(works.shape[0]):
        works[n] = 0.0
        for k in range(masses.shape[0]):
            dx, dy = out[n + 1, k, 0] - out[n, k, 0], out[n + 1, k, 1] - out[n, k, 1]
            works[n] += masses[k] * np.sqrt(dx * dx + dy * dy)


@kernel(allocates=True)
def sweep_near(
    path: FloatArray,
    poses: FloatArray,
    crowd: Crowd,
    solver: Solver,
    margin: float,
    out: FloatArray,
    works: FloatArray,
) -> None:
    """`sweep_ice` with those objects only that are near a short path; the rest stays.

    Args:
        path: (N, 3) poses of the hull.
        poses: (K, 3) poses of the objects, changed in place.
        crowd: shapes and masses.
        solver: settings.
        margin: how far from the hull an object may be that is looked at [m].
        out: (N, K, 3) receives the poses at each path pose.
        works: (N - 1,) receives the work from each pose to the next [kg m].
    """
    middle = path[path.shape[0] // 2]
    span = 0.0
    for n in range(path.shape[0]):
        span = max(span, (path[n, 0] - middle[0]) ** 2 + (path[n, 1] - middle[1]) ** 2)
    reach = np.sqrt(span) + crowd.hull_radius + margin
    chosen = np.empty(poses.shape[0], np.int64)
    corners = np.zeros(poses.shape[0] + 1, np.int64)
    count = 0
    for k in range(poses.shape[0]):
        dx, dy = poses[k, 0] - middle[0], poses[k, 1] - middle[1]
        if dx * dx + dy * dy < (reach + crowd.radii[k]) ** 2:
            chosen[count] = k
            corners[count + 1] = corners[count] + crowd.offsets[k + 1] - crowd.offsets[k]
            count += 1
    chosen, corners = chosen[:count], corners[: count + 1]
    vertices = np.empty((corners[count], 2))
    for i in range(count):
        k = chosen[i]
        vertices[corners[i] : corners[i + 1]] = crowd.vertices[
            crowd.offsets[k] : crowd.offsets[k + 1]
        ]
    part = Crowd(
        crowd.hull,
        crowd.hull_offsets,
        crowd.hull_radius,
        vertices,
        corners,
        crowd.radii[chosen],
        crowd.masses[chosen],
        crowd.inverse_gyration[chosen],
    )
    here = poses[chosen]
    moved = np.empty((path.shape[0], count, 3))
    sweep_ice(path, here, part, solver, make_memory(part), moved)
    add_works(moved, part.masses, works)
    for n in range(path.shape[0]):
        out[n] = poses
        for i in range(count):
            out[n, chosen[i]] = moved[n, i]
    for i in range(count):
        poses[chosen[i]] = here[i]


class IceSweeper:
    """Floes in open water."""

    def __init__(self, world: World, interaction: IceInteraction) -> None:
        self._crowd, self._solver = interaction.crowd(world), interaction.solver(world)
        self._margin = MARGIN * world.robot.circumscribed_radius

    def run(self, path: FloatArray, poses: FloatArray, out: FloatArray, works: FloatArray) -> bool:
        """See `Sweeper`."""
        sweep_near(path, poses, self._crowd, self._solver, self._margin, out, works)
        return True


class QuasiStaticSweeper:
    """Objects among walls."""

    def __init__(self, world: World, interaction: QuasiStatic) -> None:
        self._bodies, self._settings = interaction.bodies(world), interaction.settings(world)
        self._masses = world.movables.masses

    def run(self, path: FloatArray, poses: FloatArray, out: FloatArray, works: FloatArray) -> bool:
        """See `Sweeper`."""
        jammed = int(sweep_path(path, poses, self._bodies, self._settings, out))
        add_works(out, self._masses, works)
        return jammed < 0


class ModelSweeper:
    """Any other interaction model; it is asked anew for each portion."""

    def __init__(self, world: World, interaction: InteractionModel) -> None:
        self._world, self._interaction = world, interaction

    def run(self, path: FloatArray, poses: FloatArray, out: FloatArray, works: FloatArray) -> bool:
        """See `Sweeper`."""
        start = self._world.moved(robot_pose=path[0], movable_poses=poses)
        swept = self._interaction.sweep(start, path)
        out[:] = swept.object_poses
        poses[:] = out[-1]
        add_works(out, self._world.movables.masses, works)
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
