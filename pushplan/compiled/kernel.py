"""`kernel`: the one decorator of compiled functions."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar, overload

import numpy as np
from numba import config
from numba.core import options
from numpy.typing import NDArray

from pushplan.compiled.dispatcher import KernelDispatcher

_F = TypeVar("_F", bound=Callable[..., Any])
_T = TypeVar("_T", bound=np.generic)

_COUNTS_REFERENCES = hasattr(getattr(options, "DefaultOptions", None), "_nrt")


@overload
def kernel(function: _F) -> _F: ...
@overload
def kernel(
    function: None = None, *, allocates: bool = ..., inline: bool = ...
) -> Callable[[_F], _F]: ...
def kernel(function: Any = None, *, allocates: bool = False, inline: bool = False) -> Any:
    """Compile a function on its first call, cached on disk, without the interpreter's lock.

    Numba counts a reference whenever an array, also one in a tuple, is passed on or looked into.
    In small functions that take tuples of arrays these atomic increments last as long as the
    arithmetic. What makes no array needs none of them, and Numba can be told so by an option that
    it keeps for itself; a version without it compiles the function as usual. Such a function may
    take views of arrays. If it makes an array nevertheless, Numba refuses it when it is compiled;
    so is the assignment of one array to another, for which there is `copy_into`.

    Args:
        function: plain Python over numbers, arrays and named tuples of them.
        allocates: it, or a function that it calls, makes arrays.
        inline: the compiler puts its code in the place of each call.
    """
    if function is None:
        return partial(_compiled, allocates=allocates, inline=inline)
    return _compiled(function, allocates=allocates, inline=inline)


def _compiled(function: Callable[..., Any], *, allocates: bool, inline: bool) -> Any:
    if config.DISABLE_JIT:
        return function
    chosen: dict[str, Any] = {"nopython": True, "nogil": True}
    if inline:
        chosen["forceinline"] = True
    if not allocates and _COUNTS_REFERENCES:
        chosen["_nrt"] = False
    return KernelDispatcher(function, targetoptions=chosen)


@kernel
def copy_into(out: NDArray[_T], source: NDArray[_T]) -> None:
    """Copy an array, of one or two dimensions, into another of its shape."""
    for index in np.ndindex(source.shape):
        out[index] = source[index]


def owned(values: NDArray[_T]) -> NDArray[_T]:
    """Give an array as kernels take it: C-contiguous and writable; a copy of one that is not."""
    values = np.ascontiguousarray(values)
    return values if values.flags.writeable else values.copy()
