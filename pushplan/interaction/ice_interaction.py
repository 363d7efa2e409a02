"""`IceInteraction`: quasi-static pushing with friction in a crowd, for open water."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from pushplan.core import interaction as core
from pushplan.errors import InvalidInputError
from pushplan.interaction.interaction_model import Interaction, checked_path
from pushplan.interaction.quasi_static import inverse_gyration
from pushplan.world import World
from pushplan.world.checked_fields import (
    CheckedFields,
    NonNegativeFloat,
    PositiveFraction,
    PositiveInt,
)
from pushplan.world.checks import IntArray, expect

STILL = 0.03
"""Fraction of a step's motion that a body may be moved without a look at its neighbours."""


class IceSettings(NamedTuple):
    """Numerical settings."""

    step: float  # Longest motion of a hull corner in one step [m]
    iterations: int  # Gauss-Seidel rounds in a step
    hull_friction: float
    friction: float  # Coulomb coefficients between hull and object, and between objects
    still: float  # Displacement in a step below which a body does not look for neighbours [m]


@dataclass(frozen=True)
class IceInteraction(CheckedFields):
    """Floes that push floes, with friction between all of them; nothing static.

    The same physics as `QuasiStatic`, and friction between the objects as well. Contacts are found
    once in each step instead of in each round of the solver, which in dense ice is many times
    as fast. The defaults fit the two-dimensional Ship-Ice, where all friction is 1.

    Args:
        hull_friction: Coulomb coefficient between robot and objects.
        friction: Coulomb coefficient between objects.
        step: longest motion of the robot between two looks for contacts, in units of the median
            radius of the objects.
        iterations: Gauss-Seidel rounds in each step.

    Raises:
        InvalidInputError: if a value is out of range.
    """

    hull_friction: NonNegativeFloat = 1.0
    friction: NonNegativeFloat = 1.0
    step: PositiveFraction = 0.5
    iterations: PositiveInt = 16

    def bodies(self, world: World, near: IntArray | None = None) -> core.IceBodies:
        """The hull and the objects of a world, or those with the numbers ``near`` only.

        Raises:
            InvalidInputError: if there is something static in the world.
        """
        if world.static.convex_parts:
            raise InvalidInputError(
                "IceInteraction knows open water only, the world has "
                f"{len(world.static.convex_parts)} static obstacles: use QuasiStatic"
            )
        robot = world.robot
        objects = world.movables
        inverse = inverse_gyration(objects)
        if near is not None:
            objects = objects.select(near)
            inverse = inverse[near]
        return core.IceBodies(
            robot.vertices,
            robot.offsets,
            robot.circumscribed_radius,
            objects.part_vertices,
            objects.part_offsets,
            objects.first_parts,
            objects.radii,
            objects.masses,
            inverse,
        )

    def settings(self, world: World) -> IceSettings:
        """The numerical settings for the sizes in this world."""
        radii = world.movables.radii
        size = world.robot.circumscribed_radius
        if len(radii):
            size = float(np.median(radii))
        step = self.step * size
        return IceSettings(step, self.iterations, self.hull_friction, self.friction, STILL * step)

    def compiled(self, world: World) -> core.IceInteraction:
        """The model for the shapes of this world, as `CompiledInteraction` has it.

        Raises:
            InvalidInputError: if there is something static in the world.
        """
        return core.IceInteraction(self.bodies(world), *self.settings(world))

    def sweep(self, world: World, path: ArrayLike) -> Interaction:
        """Predict the motion of every object; see `InteractionModel.sweep`."""
        robot_path = checked_path(path)
        poses = expect("world", world, World).movables.poses.copy()
        out = np.empty((len(robot_path), len(poses), 3))
        core.IceContacts(self.bodies(world), *self.settings(world)).sweep(robot_path, poses, out)
        return Interaction(out, world.movables.masses)
