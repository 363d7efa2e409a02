"""Reading what departs from a preset, by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, ClassVar, Self

from pushplan.world import InvalidInputError, RobotModel, ScenarioError, UnknownNameError
from pushplan.world.checked_fields import CheckedFields, OneOf, PositiveFloat

Yaw = Annotated[str, OneOf(("aligned", "random"))]
"""Headings of boxes at the start."""
Objects = Annotated[str, OneOf(("boxes", "many"))]
"""Shapes of objects: square boxes, or boxes, L, T and U shapes, chairs and tables."""


@dataclass(frozen=True, kw_only=True)
class TaskVariations(CheckedFields):
    """Variations that every task has; None leaves the preset's value."""

    control_step: PositiveFloat | None = None  # time between two commands [s]
    # greatest speed of the robot [m/s]; that backwards changes with it
    max_speed: PositiveFloat | None = None
    max_turn_rate: PositiveFloat | None = None  # of the robot [rad/s]

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
