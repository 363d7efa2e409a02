"""`kernel`: compiled functions that make no arrays."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numba import njit
from numba.core import options

from pushplan.world.checks import FloatArray

_F = TypeVar("_F", bound=Callable[..., Any])

_OPTIONS: dict[str, Any] = {"cache": True, "nogil": True}
if hasattr(getattr(options, "DefaultOptions", None), "_nrt"):
    _OPTIONS["_nrt"] = False


def kernel(function: _F) -> _F:
    """Compile a function that makes no arrays (views of others it may take).

    Numba counts a reference whenever an array, also one in a tuple, is passed on or looked into.
    In small functions that take tuples of arrays these atomic increments last as long as the
    arithmetic. What makes no array needs none of them, and Numba can be told so by an option that
    it keeps for itself; a version without it compiles the function as usual. A function that does
    make an array is refused by Numba when it is compiled; so is the assignment of one array to
    another, for which there is `copy_into`.
    """
    compiled: _F = njit(**_OPTIONS)(function)
    return compiled


@kernel
def copy_into(out: FloatArray, source: FloatArray) -> None:
    """Copy an array, of one or two dimensions, into another of its shape."""
    for index in np.ndindex(source.shape):
        out[index] = source[index]
