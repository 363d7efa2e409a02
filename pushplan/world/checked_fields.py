"""Checks of a dataclass's fields, stated once: in the type of each field."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import cache, partial
from typing import Annotated, Any, ClassVar, get_args, get_origin, get_type_hints

import numpy as np

from pushplan.errors import InvalidInputError, short
from pushplan.world.checks import array, boolean, choice, expect, integer, number, word


@dataclass(frozen=True)
class Limits:
    """Range of a number, in ``Annotated[float, Limits(...)]``; ``open_low`` leaves ``low`` out."""

    low: float = -math.inf
    high: float = math.inf
    open_low: bool = False
    finite: bool = True


@dataclass(frozen=True)
class OneOf:
    """Valid names, in ``Annotated[str, OneOf(...)]``."""

    valid: tuple[str, ...]


@dataclass(frozen=True)
class Each:
    """Rule of the entries of a tuple, in ``Annotated[tuple[int, ...], Each(Limits(1))]``.

    There are as many entries as the type says, or at least ``least`` where it says ``...``.
    """

    rule: Limits | OneOf = Limits()
    least: int = 1


class Shape(tuple[int | str | None, ...]):
    """Shape of an array, in ``Annotated[FloatArray, Shape("N", 3)]``.

    A letter stands for any number, the same one in all fields of an instance; None for any.
    """

    def __new__(cls, *sides: int | str | None) -> Shape:
        """Take the sides one by one."""
        return super().__new__(cls, sides)


PositiveFloat = Annotated[float, Limits(0.0, open_low=True)]
NonNegativeFloat = Annotated[float, Limits(0.0)]
Fraction = Annotated[float, Limits(0.0, 1.0)]
PositiveFraction = Annotated[float, Limits(0.0, 1.0, open_low=True)]
PositiveInt = Annotated[int, Limits(1)]
NonNegativeInt = Annotated[int, Limits(0)]


class CheckedFields:
    """Base of dataclasses that check their fields when an instance is made.

    A field of type float, int, bool or str takes a finite number, a whole number, a truth value or
    a text and keeps it as that type; `Limits` and `OneOf` in the annotation say which ones. A tuple
    with `Each` in the annotation takes a list of such values too. An array becomes a read-only copy
    of the `Shape` in the annotation. A field whose type is a dataclass takes an instance of it.
    None is left alone where the annotation allows it, and so are fields of all other types.

    Raises:
        InvalidInputError: naming the first field with a wrong value, the value and the rule.
    """

    field_prefix: ClassVar[str] = ""
    """Stands before the name of a field in errors."""

    def __post_init__(self) -> None:
        kind: Any = type(self)
        values = self.__dict__
        sides = dict[str | int | None, int]()
        for name, called, check, optional, shape in _checks(kind):
            value = values[name]
            if optional and value is None:
                continue
            if check is number and type(value) is float and math.isfinite(value):
                continue  # most commands: a call of `number` takes as long as all the rest
            if shape is None:
                values[name] = check(called, value)
            else:
                wanted = tuple(n if isinstance(n, int) else sides.get(n) for n in shape)
                values[name] = found = check(called, value, wanted)
                sides.update((n, k) for n, k in zip(shape, found.shape, strict=True) if n)


@cache
def _checks(kind: Any) -> tuple[tuple[str, str, Callable[..., Any], bool, Shape | None], ...]:
    """Each checked field: name, the same in errors, check, whether it may be None, shape.

    A check is a function of what errors call the value, the value, and of arrays a shape.
    """
    hints = get_type_hints(kind, include_extras=True)
    found = []
    for field in fields(kind):
        hint = hints[field.name]
        optional = type(None) in get_args(hint)
        if optional:
            hint, *others = [one for one in get_args(hint) if one is not type(None)]
            if others:
                continue
        base, *notes = get_args(hint) if get_origin(hint) is Annotated else (hint,)
        note = notes[0] if notes else Limits()
        check = _check(base, note)
        if check is not None:
            shape = note if isinstance(note, Shape) else None
            found.append((field.name, kind.field_prefix + field.name, check, optional, shape))
    return tuple(found)


def _check(base: Any, note: Any) -> Callable[..., Any] | None:
    if isinstance(note, OneOf):
        return partial(choice, valid=note.valid)
    if isinstance(note, Each):
        entry, *others = get_args(base)
        least = note.least
        most = math.inf
        if others != [Ellipsis]:
            least = most = 1 + len(others)
        return partial(_entries, kind=entry, check=_check(entry, note.rule), least=least, most=most)
    if isinstance(note, Shape):
        kind = get_args(base)[-1]  # of an NDArray: a dtype, and since NumPy 2.5 its scalar
        return partial(array, dtype=np.dtype((get_args(kind) or (kind,))[0]))
    if isinstance(base, type) and is_dataclass(base):
        return partial(expect, kind=base)
    plain: dict[Any, Callable[..., Any]] = {
        bool: boolean,
        str: word,
        int: partial(integer, low=note.low, high=note.high),
        float: number,
    }
    if note != Limits():
        plain[float] = partial(number, **vars(note))
    return plain.get(base)


def _entries(
    name: str, value: object, *, kind: Any, check: Any, least: int, most: float
) -> tuple[Any, ...]:
    """The checked entries of a list, from ``least`` to ``most`` of them."""
    if isinstance(value, str) or not isinstance(value, Sequence) or not least <= len(value) <= most:
        count = "one or more " if least else ""
        if least == most:
            count = f"{least} "
        noun = "names" if kind is str else "numbers"
        raise InvalidInputError(f"{name} must be a list of {count}{noun}, got {short(value)}")
    return tuple(check(f"{name}[{i}]", one) for i, one in enumerate(value))
