"""The default interaction model: quasi-static pushing."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from pushplan.core import geometry
from pushplan.core import interaction as core
from pushplan.geometry import gyration_squares
from pushplan.interaction.interaction_model import Interaction, checked_path
from pushplan.world import Movables, RobotModel, StaticMap, World
from pushplan.world.checked_fields import (
    CheckedFields,
    NonNegativeFloat,
    PositiveFloat,
    PositiveFraction,
    PositiveInt,
)
from pushplan.world.checks import FloatArray, expect, frozen
from pushplan.world.outline import unflatten

_TOLERANCE = 1e-3  # overlap that counts as resolved [sizes of the thinnest body]
_MOST_SLENDER = 30.0
"""A body that is thinner than the robot by more sets no finer steps, which would take forever."""


class Settings(NamedTuple):
    """Numerical settings of the core's `QuasiStatic`."""

    max_step: float  # Longest motion of a robot corner in one resolution step [m]
    tolerance: float  # Overlap that counts as resolved [m]
    jam_depth: float  # Overlap that cannot be resolved and counts as a jam [m]
    iterations: int  # Gauss-Seidel rounds in one step
    friction: float  # Coulomb coefficient between robot and objects
    static_friction: float  # Coulomb coefficient between objects and walls


@dataclass(frozen=True)
class QuasiStatic(CheckedFields):
    """Objects move only while they are pushed, by the least total motion.

    The robot pushes objects, objects push objects, walls hold both; friction on the ground gives
    each object an ellipsoidal limit surface (Goyal, Ruina and Papadopoulos 1991; Lynch and Mason
    1996). Wheeled objects are treated like the others: the way they roll on is not predicted.

    Args:
        friction: Coulomb coefficient between robot and objects.
        gyration_scale: factor on the radius c of the limit surface, where c² = inertia / mass at
            1. That is exact for a simulator with full damping; 0.94 fits a square box whose weight
            rests evenly on the ground, 1.73 one that stands on its four corners.
        step: longest motion of the robot between two contact resolutions, as a fraction of the
            half diagonal of the thinnest body; bodies below a thirtieth of the robot count as
            that.
        iterations: Gauss-Seidel rounds for each resolution.
        static_friction: Coulomb coefficient between objects and walls. With it an object that is
            squeezed against a wall within the friction cone jams instead of sliding along.

    Raises:
        InvalidInputError: if a value is out of range.
    """

    friction: NonNegativeFloat = 0.0
    gyration_scale: PositiveFloat = 1.0
    step: PositiveFraction = 0.1
    iterations: PositiveInt = 12
    static_friction: NonNegativeFloat = 0.0

    def bodies(self, world: World) -> core.Bodies:
        """The world's shapes as the core reads them; cached."""
        return _bodies(world.robot, _Shapes(world.movables), world.static, self.gyration_scale)

    def settings(self, world: World) -> Settings:
        """The numerical settings for the sizes in this world."""
        size = _thinnest(world.robot, _Shapes(world.movables))
        return Settings(
            max_step=self.step * size,
            tolerance=_TOLERANCE * size,
            jam_depth=0.25 * self.step * size,
            iterations=self.iterations,
            friction=float(self.friction),
            static_friction=float(self.static_friction),
        )

    def compiled(self, world: World) -> core.QuasiStatic:
        """The model for the shapes of this world, as `CompiledInteraction` has it."""
        return core.QuasiStatic(self.bodies(world), *self.settings(world))

    def sweep(self, world: World, path: ArrayLike) -> Interaction:
        """Predict the motion of every object; see `InteractionModel.sweep`."""
        robot_path = checked_path(path)
        poses = expect("world", world, World).movables.poses.copy()
        out = np.empty((len(robot_path), len(poses), 3))
        jammed = self.compiled(world).sweep(robot_path, poses, out)
        return Interaction(out, world.movables.masses, jammed)


class _Shapes:
    """Movables compared by what does not change when they are pushed, as a cache key."""

    def __init__(self, movables: Movables) -> None:
        self.movables = movables
        arrays = (
            movables.part_vertices,
            movables.part_offsets,
            movables.first_parts,
            movables.contact_radii,
            movables.gyration_radii,
            movables.masses,
        )
        self.key = tuple(values.tobytes() for values in arrays)

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Shapes) and self.key == other.key


@functools.lru_cache(maxsize=32)
def _thinnest(robot: RobotModel, shapes: _Shapes) -> float:
    """Half diagonal of the square that is as wide as the thinnest body [m]."""
    movables = shapes.movables
    outlines = [*robot.wall_parts, *unflatten(movables.part_vertices, movables.part_offsets)]
    width = min(map(geometry.least_width, outlines))
    return max(width / math.sqrt(2.0), robot.circumscribed_radius / _MOST_SLENDER)


@functools.lru_cache(maxsize=32)
def _gyration(shapes: _Shapes) -> FloatArray:
    """(K,) c² of the objects at a scale of 1 [m²]."""
    return frozen(gyration_squares(shapes.movables))


def inverse_gyration(movables: Movables) -> FloatArray:
    """(K,) inertia of the objects over their masses, inverted [1/m²]."""
    return 1.0 / _gyration(_Shapes(movables))


@functools.lru_cache(maxsize=32)
def _bodies(robot: RobotModel, shapes: _Shapes, static: StaticMap, gyration: float) -> core.Bodies:
    movables = shapes.movables
    vertices, offsets = static.packed
    return core.Bodies(
        robot_vertices=robot.vertices,
        robot_offsets=robot.offsets,
        wall_parts=len(robot.wall_parts),
        robot_radius=robot.circumscribed_radius,
        vertices=movables.vertices,
        offsets=movables.offsets,
        part_vertices=movables.part_vertices,
        part_offsets=movables.part_offsets,
        first_parts=movables.first_parts,
        radii=movables.radii,
        inverse_masses=1.0 / movables.masses,
        inverse_gyration=1.0 / (_gyration(shapes) * gyration**2),
        wall_vertices=vertices,
        wall_offsets=offsets,
        wall_boxes=static.boxes,
    )
