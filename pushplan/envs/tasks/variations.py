"""Reading what departs from a preset, by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, ClassVar, Self

from pushplan.world import InvalidInputError, RobotModel, ScenarioError, UnknownNameError
from pushplan.world.checked_fields import (
    CheckedFields,
    Fraction,
    Limits,
    NonNegativeFloat,
    OneOf,
    PositiveFloat,
)

Yaw = Annotated[str, OneOf(("aligned", "random"))]
"""Headings of boxes at the start."""
Objects = Annotated[str, OneOf(("boxes", "many"))]
"""Shapes of objects: square boxes, or boxes, L, T and U shapes, chairs and tables."""
Scale = Annotated[float, Limits(1e-3, 1e3)]
Spread = Annotated[float, Limits(1.0, 100.0)]
"""A factor is drawn from [1 / spread, spread], uniformly in its logarithm; 1 draws none."""


@dataclass(frozen=True, kw_only=True)
class TaskVariations(CheckedFields):
    """Variations that every task has; None leaves the preset's value."""

    control_step: PositiveFloat | None = None  # time between two commands [s]
    # greatest speed of the robot [m/s]; that backwards changes with it
    max_speed: PositiveFloat | None = None
    max_turn_rate: PositiveFloat | None = None  # of the robot [rad/s]
    mass_scale: Scale = 1.0  # factor on the masses of all objects
    mass_spread: Spread = 1.0  # of the mass of each object
    # of the radius of the limit surface of each object, which Pymunk has
    gyration_spread: Spread = 1.0
    # friction coefficients between robot and objects, two objects, objects and what is static,
    # plain objects and the ground, which MuJoCo has
    bumper_friction: NonNegativeFloat | None = None
    object_friction: NonNegativeFloat | None = None
    wall_friction: NonNegativeFloat | None = None
    ground_friction: NonNegativeFloat | None = None
    friction_spread: Spread = 1.0  # of each of the four, one factor in a start
    wheeled: Fraction | None = None  # fraction of the objects that stand on casters, 0 to 1
    # claim to the policy about masses and limit surfaces: the truth, or what they would be without
    # scale and spreads
    parameters: Annotated[str, OneOf(("known", "unknown"))] = "known"

    task: ClassVar[str]
    """Name of the task."""

    def limit(self, robot: RobotModel) -> RobotModel:
        """The robot of a preset with these limits of speed and turn rate."""
        speed = self.max_speed
        if speed is None:
            speed = robot.max_speed
        return replace(
            robot,
            max_speed=speed,
            min_speed=robot.min_speed * speed / robot.max_speed,
            max_turn_rate=self.max_turn_rate or robot.max_turn_rate,
        )

    @classmethod
    def read(cls, values: Mapping[str, Any]) -> Self:
        """Read variations from a mapping.

        Raises:
            UnknownNameError: if a name is none of the fields.
            ScenarioError: if a value makes no sense.
        """
        if not isinstance(values, Mapping):
            raise ScenarioError(f"{cls.task}: variations must be a mapping, got {values!r:.60}")
        valid = [field.name for field in fields(cls)]
        for name in values:
            if name not in valid:
                raise UnknownNameError(f"variation of {cls.task}", name, valid)
        try:
            return cls(**values)
        except InvalidInputError as error:
            raise ScenarioError(f"{cls.task}: {error}") from error
