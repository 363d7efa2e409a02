"""Velocity that moving bodies keep while nothing pushes them, in the plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pushplan.core import geometry
from pushplan.envs.simulators.base import Materials
from pushplan.world import World
from pushplan.world.checks import FloatArray


@dataclass(frozen=True)
class Momentum:
    """Drag on rolling and floating bodies; plain objects on the ground keep nothing.

    A body's law is ``m v' = -(b + c |v|) v``, and likewise about the vertical axis. A wheeled
    object has ``b = m / rolling_time`` and no c.
    """

    # (N,) whether the body keeps anything; the first is the robot, which never does
    keeps: FloatArray
    inertia: FloatArray  # (N, 2) mass [kg] and moment of inertia [kg m²]
    drag: FloatArray  # (N, 4) b and c of the translation and of the rotation, over mass and moment

    @classmethod
    def of(cls, world: World, materials: Materials) -> Momentum:
        """For the robot and all objects of a world."""
        movables = world.movables
        moments = [
            mass * geometry.polygon_inertia(movables.drawn_outline(k))
            for k, mass in enumerate(movables.masses)
        ]
        inertia = np.ones((1 + len(movables), 2))
        inertia[1:, 0] = movables.masses
        inertia[1:, 1] = moments
        drag = np.zeros((len(inertia), 4))
        if materials.water is not None:
            drag = materials.water.coefficients(world) / np.repeat(inertia, 2, axis=1)
            keeps = np.ones(len(inertia), dtype=bool)
        else:
            drag[:, [0, 2]] = 1.0 / materials.rolling_time
            keeps = np.concatenate([[False], movables.wheeled])
        keeps[0] = False
        return cls(keeps.astype(np.float64), inertia, drag)
