"""Reading what departs from a preset, by name."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, ClassVar, Self

import numpy as np

from pushplan.envs.simulators.base import Materials
from pushplan.geometry import gyration_squares
from pushplan.world import (
    InvalidInputError,
    Movables,
    RobotModel,
    ScenarioError,
    UnknownNameError,
)
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

FRICTIONS = {
    "bumper_friction": "robot_object",
    "object_friction": "object_object",
    "wall_friction": "object_static",
    "ground_friction": "object_ground",
}
"""Variation -> the field of `Materials` that it replaces."""
_OF_SENSORS = (
    "view_angle",
    "range_noise",
    "object_noise",
    "turn_noise",
    "drop_out",
    "view_rate",
    "view_delay",
    "unknown_price",
)
"""Variations that mean nothing where everything is seen."""


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
    # what a policy is told of masses and limit surfaces: the truth, or what they would be without
    # scale and spreads
    parameters: Annotated[str, OneOf(("known", "unknown"))] = "known"
    # what a policy gets to see: everything, of the objects only what has been in view, or of what
    # is static, too, only what a lidar has seen (`pushplan.envs.sensing`)
    sensing: Annotated[str, OneOf(("full", "objects", "lidar"))] = "full"
    # how far sensors see [m]; 30 times the robot's circumscribed radius if None
    view_range: PositiveFloat | None = None
    # angle that they see, half of it to each side of the heading [rad]
    view_angle: Annotated[float, Limits(0.0, math.tau, open_low=True)] = math.tau
    range_noise: NonNegativeFloat = 0.0  # standard deviation of the distances of the lidar [m]
    object_noise: NonNegativeFloat = 0.0  # of x and y of the objects that are detected [m]
    turn_noise: NonNegativeFloat = 0.0  # of their headings [rad]
    drop_out: Fraction = 0.0  # fraction of the beams and of the objects in view that are missing
    view_rate: PositiveFloat | None = None  # scans a second at most [Hz]; one each step if None
    view_delay: NonNegativeFloat = 0.0  # from a scan until it is there [s]
    unknown_price: NonNegativeFloat = 0.0  # of a metre where nobody has looked, in metres

    task: ClassVar[str] = "this task"
    """Name of the task."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.sensing != "full":
            return
        for name in _OF_SENSORS:
            if (value := getattr(self, name)) != getattr(type(self), name):
                raise InvalidInputError(
                    f"{name} {value!r} belongs to a robot with sensors: sensing must be objects or "
                    "lidar with it, got full"
                )

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

    def change_materials(self, materials: Materials) -> Materials:
        """The materials of a preset with the friction that is asked for."""
        frictions = {field: getattr(self, name) for name, field in FRICTIONS.items()}
        asked = {field: value for field, value in frictions.items() if value is not None}
        return replace(materials, **asked)

    def vary_materials(self, materials: Materials, rng: np.random.Generator) -> Materials:
        """Draw the friction of a start."""
        factors = self.friction_spread ** rng.uniform(-1.0, 1.0, len(FRICTIONS))
        if self.friction_spread == 1.0:
            return materials
        drawn = zip(FRICTIONS.values(), factors.tolist(), strict=True)
        return replace(
            materials, **{field: factor * getattr(materials, field) for field, factor in drawn}
        )

    def vary_objects(
        self, objects: Movables, rng: np.random.Generator, *, flat: bool
    ) -> tuple[Movables, Movables]:
        """Draw masses, limit surfaces and casters of the objects of a start.

        Every draw is made, asked for or not, so that none changes another.

        Returns:
            The objects on casters with their masses and limit surfaces as before, and as drawn.
        """
        count = len(objects)
        logs = rng.uniform(-1.0, 1.0, (count, 2))
        order = rng.permutation(count)
        if self.wheeled is not None:
            on_casters = round(self.wheeled * count)
            # boxes that were placed on casters stay there
            if on_casters != objects.wheeled.sum():
                objects = replace(objects, wheeled=np.isin(np.arange(count), order[:on_casters]))
        nominal = objects
        if self.mass_scale != 1.0 or self.mass_spread > 1.0:
            factors = self.mass_scale * self.mass_spread ** logs[:, 0]
            objects = replace(objects, masses=objects.masses * factors)
        if flat and self.gyration_spread > 1.0:
            radii = np.sqrt(gyration_squares(objects)) * self.gyration_spread ** logs[:, 1]
            objects = replace(objects, gyration_radii=radii)
        return nominal, objects

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
