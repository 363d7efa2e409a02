"""Reading what departs from a preset, by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Annotated, Any, ClassVar, Self

from pushplan.world import InvalidInputError, ScenarioError, UnknownNameError
from pushplan.world.checked_fields import CheckedFields, OneOf

Yaw = Annotated[str, OneOf(("aligned", "random"))]
"""Headings of boxes at the start."""


class TaskVariations(CheckedFields):
    """Base of the frozen dataclasses that say what may depart from a task's presets."""

    task: ClassVar[str]
    """Name of the task."""

    @classmethod
    def read(cls, values: Mapping[str, Any]) -> Self:
        """Read variations from a mapping.

        Raises:
            UnknownNameError: if a name is none of the fields.
            ScenarioError: if a value makes no sense.
        """
        if not isinstance(values, Mapping):
            raise ScenarioError(f"{cls.task}: variations must be a mapping, got {values!r:.60}")
        valid = [field.name for field in fields(cls)]  # type: ignore[arg-type]
        for name in values:
            if name not in valid:
                raise UnknownNameError(f"variation of {cls.task}", name, valid)
        try:
            return cls(**values)
        except InvalidInputError as error:
            raise ScenarioError(f"{cls.task}: {error}") from error
