"""`IceInteraction`: quasi-static pushing with friction in a crowd, for open water."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from pushplan.compiled import copy_into, kernel, owned
from pushplan.errors import InvalidInputError
from pushplan.geometry.transforms import transform_points
from pushplan.interaction.advance import advance_objects
from pushplan.interaction.ice_bodies import IceBodies, IceProblem, IceSettings, ice_problem
from pushplan.interaction.ice_contacts import drive_ice, sweep_ice
from pushplan.interaction.interaction_model import Interaction, checked_path
from pushplan.interaction.quasi_static import QuasiStatic
from pushplan.world import World
from pushplan.world.checked_fields import (
    CheckedFields,
    NonNegativeFloat,
    PositiveFraction,
    PositiveInt,
)
from pushplan.world.checks import FloatArray, IntArray

STILL = 0.03
"""Fraction of a step's motion that a body may be moved without a look at its neighbours."""


class IceContacts(NamedTuple):
    """`IceInteraction` in compiled form, with memory for one thread."""

    inverse_masses: FloatArray  # (K,)
    radii: FloatArray  # (K,) circumscribed radii [m]
    tests: IntArray  # (1,) steps of the hull so far
    problem: IceProblem
    known: FloatArray  # (K, 3) the poses for which the corners in the memory are worked out


@kernel
def _step(
    model: IceContacts,
    robot_from: FloatArray,
    robot_to: FloatArray,
    poses: FloatArray,
    moved: FloatArray,
) -> bool:
    """Drive the hull a step among the floes, which never hold it."""
    problem = model.problem
    known = model.known
    bodies = problem.bodies
    scratch = problem.scratch
    for k in range(poses.shape[0]):  # only where the last step left other corners behind
        if poses[k, 0] != known[k, 0] or poses[k, 1] != known[k, 1] or poses[k, 2] != known[k, 2]:
            copy_into(known[k], poses[k])
            a = bodies.offsets[k]
            b = bodies.offsets[k + 1]
            transform_points(poses[k], bodies.vertices[a:b], scratch.corners[a:b])
    work, steps = drive_ice(robot_from, robot_to, poses, problem, 0.0)
    model.tests[0] += steps
    if work > 0.0:
        for k in range(poses.shape[0]):
            gx = poses[k, 0] - known[k, 0]
            gy = poses[k, 1] - known[k, 1]
            if gx != 0.0 or gy != 0.0 or poses[k, 2] != known[k, 2]:
                moved[k] += np.sqrt(gx * gx + gy * gy)
                copy_into(known[k], poses[k])
    return True


advance_objects.add(IceContacts, _step)


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

    def bodies(self, world: World) -> IceBodies:
        """The world's shapes and masses as the kernels read them.

        Raises:
            InvalidInputError: if there is something static in it.
        """
        if world.static.convex_parts:
            raise InvalidInputError(
                "IceInteraction knows open water only, the world has "
                f"{len(world.static.convex_parts)} static obstacles: use QuasiStatic"
            )
        bodies = QuasiStatic().bodies(world)
        return IceBodies(
            bodies.robot_vertices,
            bodies.robot_offsets,
            bodies.robot_radius,
            bodies.vertices,
            bodies.offsets,
            bodies.radii,
            owned(world.movables.masses),
            bodies.inverse_gyration,
        )

    def settings(self, world: World) -> IceSettings:
        """The numerical settings for the sizes in this world."""
        radii = world.movables.radii
        size = world.robot.circumscribed_radius
        if len(radii):
            size = float(np.median(radii))
        step = self.step * size
        return IceSettings(step, self.iterations, self.hull_friction, self.friction, STILL * step)

    def problem(self, world: World) -> IceProblem:
        """Bodies and settings as `sweep_ice` reads them; for one thread.

        Raises:
            InvalidInputError: if there is something static in the world.
        """
        problem: IceProblem = ice_problem(self.bodies(world), self.settings(world))
        return problem

    def compiled(self, world: World) -> IceContacts:
        """The model as `pushplan.interaction.advance.advance_objects` takes it.

        Raises:
            InvalidInputError: if there is something static in the world.
        """
        problem = self.problem(world)
        count = len(world.movables)
        return IceContacts(
            1.0 / world.movables.masses,
            problem.bodies.radii,
            np.zeros(1, np.int64),
            problem,
            np.full((count, 3), np.nan),
        )

    def sweep(self, world: World, path: ArrayLike) -> Interaction:
        """Predict the motion of every object; see `InteractionModel.sweep`."""
        robot_path = checked_path(path)
        poses = world.movables.poses.copy()
        out = np.empty((len(robot_path), len(poses), 3))
        sweep_ice(robot_path, poses, self.problem(world), out)
        return Interaction(out, world.movables.masses)
