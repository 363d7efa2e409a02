"""Types of the C that kernels are translated to."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np


class CType(NamedTuple):
    """A type: ``double``, ``int``, ``bool``, ``void``, an array, a record, or values returned."""

    name: str
    kind: str = "scalar"  # or "array", "record", "values", "literal"
    rank: int = 0  # Dimensions of an array
    parts: tuple[Any, ...] = ()  # Types of values

    def declared(self, name: str) -> str:
        """A parameter or local variable of the type."""
        return f"const {self.name} *{name}" if self.kind == "record" else f"{self.name} {name}"


DOUBLE, INT, BOOL, VOID = CType("double"), CType("int"), CType("bool"), CType("void")

NUMBERS = (BOOL, INT, DOUBLE)


def array_type(rank: int, integer: bool = False) -> CType:
    """An array of numbers."""
    if integer:
        return CType("ints", "array", 1)
    return CType("doubles" if rank == 1 else "doubles2", "array", rank)


def record_type(kind: type) -> CType:
    """A named tuple."""
    return CType(kind.__name__, "record")


def values_type(parts: tuple[CType, ...]) -> CType:
    """Values that are returned together."""
    return CType("Values_" + "_".join(part.name[0] for part in parts), "values", 0, parts)


def type_of(value: Any) -> CType:
    """The type of an example."""
    if isinstance(value, bool | np.bool_):
        return BOOL
    if isinstance(value, int | np.integer):
        return INT
    if isinstance(value, float):
        return DOUBLE
    if isinstance(value, np.ndarray):
        return array_type(value.ndim, value.dtype.kind == "i")
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return record_type(type(value))
    raise TypeError(f"no C type for {type(value).__name__}")


def joined(a: CType | None, b: CType) -> CType:
    """The type that holds values of both."""
    if a is None or a == b:
        return b
    if a in NUMBERS and b in NUMBERS:
        return NUMBERS[max(NUMBERS.index(a), NUMBERS.index(b))]
    raise TypeError(f"one variable holds {a.name} and {b.name}")
