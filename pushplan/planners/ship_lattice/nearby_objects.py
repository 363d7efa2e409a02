"""`NearbyObjects`: the part of a world that a sweep of limited length can move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pushplan.interaction.path_sweepers import MARGIN
from pushplan.world import World
from pushplan.world.checks import BoolArray, FloatArray


@dataclass(frozen=True)
class NearbyObjects:
    """The part of a world that a sweep of limited length can move."""

    world: World  # with the objects that are near
    which: BoolArray  # (K,) which of all objects they are

    @classmethod
    def around(
        cls,
        world: World,
        normal: FloatArray,  # (2,) direction towards the goal
        ahead: float,  # length of a path that is swept [m]
    ) -> NearbyObjects:
        """The objects from a little behind the robot to a little beyond what is swept."""
        size = world.robot.circumscribed_radius
        along = (world.movables.poses[:, :2] - world.robot_pose[:2]) @ normal
        reach = (1.0 + MARGIN) * size + world.movables.radii
        which = (along > -ahead - reach) & (along < ahead + reach)
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

    def everything(
        self,
        world: World,  # the whole world
        objects: FloatArray,  # (M, N, 3) poses of those that are near
        missing: int,  # number of further poses
    ) -> FloatArray:
        """(M + missing, K, 3) poses of all objects of a world; after the M given ones they rest."""
        count = len(objects)
        out = np.empty((count + missing, len(world.movables), 3))
        out[:] = world.movables.poses
        out[:count, self.which] = objects
        out[count:, self.which] = objects[-1]
        return out
