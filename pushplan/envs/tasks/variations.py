"""Reading what departs from a preset, by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, Self

from pushplan.world import InvalidInputError, RobotModel, ScenarioError, UnknownNameError
from pushplan.world.checks import number


@dataclass(frozen=True, kw_only=True)
class TaskVariations:
    """What may depart from the presets of every task; None leaves the preset's value.

    Args:
        control_step: time between two commands [s].
        max_speed: greatest speed of the robot [m/s]; that backwards changes with it.
        max_turn_rate: the same of turning [rad/s].
    """

    control_step: float | None = None
    max_speed: float | None = None
    max_turn_rate: float | None = None

    task: ClassVar[str]
    """Name of the task."""

    def __post_init__(self) -> None:
        for name in ("control_step", "max_speed", "max_turn_rate"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, number(name, value, low=0.0, open_low=True))

    def limit(self, robot: RobotModel) -> RobotModel:
        """The robot of a preset with these limits of speed and turn rate."""
        speed = robot.max_speed if self.max_speed is None else self.max_speed
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
