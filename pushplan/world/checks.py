"""Validation of input at the doors: each check returns a clean value or raises one clear error."""

from __future__ import annotations

import dataclasses
import math
import numbers
from collections.abc import Sequence
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from pushplan.errors import InvalidInputError, short, unknown_name_message

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
_T = TypeVar("_T")

_FEW = 64  # numbers whose finiteness Python finds sooner than NumPy


def expect(name: str, value: object, kind: type[_T]) -> _T:
    """Check that ``value`` is of a type and return it.

    Raises:
        InvalidInputError: naming the value and the type otherwise.
    """
    if not isinstance(value, kind):
        raise InvalidInputError(f"{name} must be a {kind.__name__}, got {short(value)}")
    return value


def number(
    name: str,
    value: object,
    *,
    low: float = -math.inf,
    high: float = math.inf,
    open_low: bool = False,
    finite: bool = True,
) -> float:
    """Check that ``value`` is a real number in the stated range and return it as a float.

    Raises:
        InvalidInputError: if it is not a number, not finite, or out of range.
    """
    if type(value) is float and low < value < high and -math.inf < value < math.inf:
        return value  # most often; the rest sorts out what is wrong
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise InvalidInputError(f"{name} must be a number, got {short(value)}")
    try:
        result = float(value)
    except OverflowError:
        result = math.inf
    outside = math.isnan(result) or result < low or result > high or (open_low and result == low)
    if not outside and not (finite and math.isinf(result)):
        return result
    if finite and low == -math.inf and high == math.inf:
        raise InvalidInputError(f"{name} must be finite, got {result:g}")
    opening = "(" if open_low or (finite and low == -math.inf) else "["
    closing = ")" if finite and high == math.inf else "]"
    rule = f"{opening}{low:g}, {high:g}{closing}"
    raise InvalidInputError(f"{name} must lie in {rule}, got {result:g}")


def integer(name: str, value: object, *, low: float = -math.inf, high: float = math.inf) -> int:
    """Check that ``value`` is a whole number in the stated range and return it as an int.

    Raises:
        InvalidInputError: if it is not a whole number or out of range.
    """
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        raise InvalidInputError(f"{name} must be a whole number, got {short(value)}")
    result = int(value)
    if not low <= result <= high:
        limits = f"in [{low}, {high}]"
        if high == math.inf:
            limits = f"at least {low}"
        raise InvalidInputError(f"{name} must be {limits}, got {short(result)}")
    return result


def boolean(name: str, value: object) -> bool:
    """Check that ``value`` is true or false and return it as a bool.

    Raises:
        InvalidInputError: if it is anything else.
    """
    if not isinstance(value, bool | np.bool_):
        raise InvalidInputError(f"{name} must be true or false, got {short(value)}")
    return bool(value)


def word(name: str, value: object) -> str:
    """Check that ``value`` is a text and return it.

    Raises:
        InvalidInputError: if it is not.
    """
    if not isinstance(value, str):
        raise InvalidInputError(f"{name} must be a text, got {short(value)}")
    return value


def choice(kind: str, value: object, valid: Sequence[str]) -> str:
    """Check that ``value`` is one of the valid names and return it.

    Raises:
        InvalidInputError: naming the nearest valid choice otherwise.
    """
    if not isinstance(value, str) or value not in valid:
        raise InvalidInputError(unknown_name_message(kind, value, valid))
    return value


def array(
    name: str,
    value: ArrayLike,
    shape: tuple[int | None, ...],
    *,
    dtype: DTypeLike = np.float64,
    finite: bool = True,
) -> NDArray[Any]:
    """Copy ``value`` into a read-only, C-contiguous array of the stated shape.

    Args:
        name: what the value is called in an error.
        value: anything that NumPy reads as an array.
        shape: expected shape; ``None`` leaves a dimension free.
        dtype: element type of the result.
        finite: refuse floats that are infinite or NaN.

    Raises:
        InvalidInputError: if the type, the shape or an element is wrong.
    """
    wanted = np.dtype(dtype)
    try:
        source = np.asarray(value)
        if source.size == 0:
            source = source.astype(wanted)
        if wanted.kind == "f" and source.dtype.kind not in "iuf":
            raise TypeError
        if wanted.kind in "ib" and source.dtype.kind not in ("iu" if wanted.kind == "i" else "b"):
            raise TypeError
        result = np.array(source, dtype=wanted, order="C")
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInputError(
            f"{name} must be an array of {wanted.name} of shape {_shape_text(shape)}, "
            f"got {short(value)}"
        ) from error
    if result.size == 0 and result.ndim != len(shape) and shape[0] is None:
        result = result.reshape((0, *(n or 0 for n in shape[1:])))
    if result.shape != shape and (
        result.ndim != len(shape)
        or any(want not in (None, have) for have, want in zip(result.shape, shape, strict=True))
    ):
        raise InvalidInputError(f"{name} must have shape {_shape_text(shape)}, got {result.shape}")
    if finite and wanted.kind == "f" and not is_finite(result):
        bad = np.argwhere(~np.isfinite(result))[0]
        raise InvalidInputError(
            f"{name} must be finite, got {result[tuple(bad)]} at index {tuple(int(i) for i in bad)}"
        )
    result.flags.writeable = False
    return result


def is_finite(values: NDArray[Any]) -> bool:
    """Return True if every number is finite."""
    if values.size <= _FEW:
        return all(map(math.isfinite, values.ravel().tolist()))
    return bool(np.isfinite(values).all())


def checked_bounds(name: str, value: Any) -> FloatArray:
    """Check a rectangle (4,) x_min, y_min, x_max, y_max [m] and return it as `array` does.

    Raises:
        InvalidInputError: if it has another shape, is not finite or is empty.
    """
    sides: FloatArray = array(name, value, (4,))
    if (sides[:2] >= sides[2:]).any():
        raise InvalidInputError(
            f"{name} must be x_min, y_min, x_max, y_max with min < max, got {sides.tolist()}"
        )
    return sides


def frozen(values: NDArray[Any]) -> NDArray[Any]:
    """Mark an array that we own as read-only and return it."""
    values.flags.writeable = False
    return values


def _shape_text(shape: tuple[int | None, ...]) -> str:
    inner = ", ".join("N" if n is None else str(n) for n in shape)
    return f"({inner},)" if len(shape) == 1 else f"({inner})"


class ArrayRecord:
    """Mixin for frozen dataclasses that hold arrays: equality and hash by content.

    Fields declared with ``compare=False`` are left out, as in an ordinary dataclass.
    """

    @cached_property
    def _content(self) -> tuple[object, ...]:
        # kept, as a cache compares it whenever the same map is made again
        assert dataclasses.is_dataclass(self)
        return tuple(
            _hashable(getattr(self, field.name))
            for field in dataclasses.fields(self)
            if field.compare
        )

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if type(self) is not type(other):
            return NotImplemented
        assert isinstance(other, ArrayRecord)
        return self._content == other._content

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash((type(self).__name__, self._content))

    def __getstate__(self) -> dict[str, object]:
        """Leave caches behind: string hashes differ between processes."""
        return {key: value for key, value in self.__dict__.items() if not key.startswith("_")}

    def __setstate__(self, state: dict[str, object]) -> None:
        for value in state.values():  # arrays come back writeable from a pickle
            for item in value if isinstance(value, tuple) else (value,):
                if isinstance(item, np.ndarray):
                    item.flags.writeable = False
        self.__dict__.update(state)


def _hashable(value: object) -> object:
    if isinstance(value, np.ndarray):
        # adding 0.0 turns -0.0 into 0.0, so that equal arrays give equal bytes
        clean = value + 0.0 if value.dtype.kind == "f" else value
        return value.shape, clean.tobytes()
    if isinstance(value, tuple):
        if value and all(isinstance(item, np.ndarray) and item.shape[1:] == (2,) for item in value):
            # outlines: thousands of small objects would take long, and wake the garbage collector
            return tuple(map(len, value)), _hashable(np.concatenate(value))
        return tuple(_hashable(item) for item in value)
    return value
