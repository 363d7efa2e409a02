"""Checks of a dataclass's fields, stated once: in the type of each field."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cache, partial
from typing import Annotated, Any, ClassVar, get_args, get_origin, get_type_hints

from pushplan.world.checks import boolean, choice, integer, number


@dataclass(frozen=True)
class Limits:
    """Range of a number, in ``Annotated[float, Limits(...)]``; ``open_low`` leaves ``low`` out."""

    low: Any = None
    high: Any = None
    open_low: bool = False
    finite: bool = True


@dataclass(frozen=True)
class OneOf:
    """Valid names, in ``Annotated[str, OneOf(...)]``."""

    valid: tuple[str, ...]


PositiveFloat = Annotated[float, Limits(0.0, open_low=True)]
NonNegativeFloat = Annotated[float, Limits(0.0)]
Fraction = Annotated[float, Limits(0.0, 1.0)]
PositiveFraction = Annotated[float, Limits(0.0, 1.0, open_low=True)]
PositiveInt = Annotated[int, Limits(1)]
NonNegativeInt = Annotated[int, Limits(0)]


class CheckedFields:
    """Base of dataclasses that check their fields when an instance is made.

    A field of type float, int or bool takes a finite number, a whole number or a truth value and
    keeps it as that type; `Limits` and `OneOf` in the annotation say which ones. None is left alone
    where the annotation allows it, and so are fields of all other types.

    Raises:
        InvalidInputError: naming the first field with a wrong value, the value and the rule.
    """

    field_prefix: ClassVar[str] = ""
    """Stands before the name of a field in errors."""

    def __post_init__(self) -> None:
        kind: Any = type(self)
        for name, check, optional in _checks(kind):
            if (value := getattr(self, name)) is not None or not optional:
                object.__setattr__(self, name, check(self.field_prefix + name, value))


@cache
def _checks(kind: Any) -> tuple[tuple[str, Callable[[str, Any], Any], bool], ...]:
    """Name of each checked field of a dataclass, its check, and whether it may be None."""
    hints = get_type_hints(kind, include_extras=True)
    found = []
    for field in fields(kind):
        hint = hints[field.name]
        optional = type(None) in get_args(hint)
        kinds = [one for one in get_args(hint) if one is not type(None)] if optional else [hint]
        check = _check(kinds[0]) if len(kinds) == 1 else None
        if check is not None:
            found.append((field.name, check, optional))
    return tuple(found)


def _check(hint: Any) -> Callable[[str, Any], Any] | None:
    """The check of one type: a function of what an error calls the value, and the value."""
    base, *notes = get_args(hint) if get_origin(hint) is Annotated else (hint,)
    note = notes[0] if notes else Limits()
    if isinstance(note, OneOf):
        return partial(choice, valid=note.valid)
    if base is bool:
        return boolean
    if base is int:
        return partial(integer, low=note.low, high=note.high)
    if base is not float:
        return None
    low = -math.inf if note.low is None else note.low
    high = math.inf if note.high is None else note.high
    return partial(number, low=low, high=high, open_low=note.open_low, finite=note.finite)
