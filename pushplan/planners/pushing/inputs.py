"""Checks at the doors of this package."""

from __future__ import annotations

from typing import TypeVar

from pushplan.world import InvalidInputError

_T = TypeVar("_T")


def expect(name: str, value: object, kind: type[_T]) -> _T:
    """Check that a value is of a type and return it.

    Raises:
        InvalidInputError: naming the value and the type otherwise.
    """
    if not isinstance(value, kind):
        raise InvalidInputError(f"{name} must be a {kind.__name__}, got {value!r:.60}")
    return value
