"""A digest of all that a kernel's machine code depends on."""

from __future__ import annotations

import functools
import hashlib
import sys
from collections.abc import Iterator
from types import CodeType, FunctionType, ModuleType
from typing import Any

import llvmlite
import numba
import numpy as np

_TYPE_KERNELS: dict[type, tuple[Any, ...]] = {}


def add_type_kernels(kind: type, *kernels: Any) -> None:
    """Say that kernels which take a type call others that are chosen by it."""
    _TYPE_KERNELS[kind] = (*_TYPE_KERNELS.get(kind, ()), *kernels)


def fingerprint(kernel: Any, signature: tuple[Any, ...], target: Any, form: str) -> str:
    """Digest a kernel, all that it calls, its argument types and the processor.

    Args:
        kernel: a compiled function.
        signature: Numba types of its arguments.
        target: Numba's code generator.
        form: how it was compiled.
    """
    versions = (numba.__version__, llvmlite.__version__, sys.version_info[:3])
    by_type = [
        source_digest(called)
        for kind in _named_tuples(signature)
        for called in _TYPE_KERNELS.get(kind, ())
    ]
    options = sorted(kernel.targetoptions.items())
    parts = (form, versions, target.magic_tuple(), options, signature, by_type)
    return _digest([source_digest(kernel), repr(parts)])


def _named_tuples(kinds: tuple[Any, ...]) -> Iterator[type]:
    """Classes of the named tuples among the types of arguments, and of those inside them."""
    for kind in kinds:
        if hasattr(kind, "instance_class"):
            yield kind.instance_class
            yield from _named_tuples(kind.types)


@functools.cache
def source_digest(kernel: Any) -> str:
    """Digest the code of a kernel and of all kernels and constants that it names."""
    seen: set[int] = set()
    return _digest(_parts(kernel.py_func, seen))


def _digest(parts: Any) -> str:
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part.encode())
        digest.update(b"\0")
    return digest.hexdigest()


def _parts(function: Any, seen: set[int]) -> Iterator[str]:
    if id(function) in seen:
        return
    seen.add(id(function))
    yield function.__qualname__
    yield repr(function.__defaults__)
    names: list[str] = []
    # a docstring is the first constant; it changes no machine code
    constants = function.__code__.co_consts[function.__doc__ is not None :]
    yield from _code_parts(function.__code__, constants, names)
    values = [function.__globals__[name] for name in names if name in function.__globals__]
    values += [cell.cell_contents for cell in function.__closure__ or ()]
    ours = [value for value in values if isinstance(value, ModuleType) and _is_ours(value.__name__)]
    values += [getattr(module, name) for module in ours for name in names if hasattr(module, name)]
    for value in values:
        yield from _value_parts(value, seen)


def _code_parts(code: CodeType, constants: tuple[object, ...], names: list[str]) -> Iterator[str]:
    yield code.co_code.hex()
    yield repr((code.co_varnames, code.co_names))
    names += [name for name in code.co_names if name not in names]
    for constant in constants:
        if isinstance(constant, CodeType):
            yield from _code_parts(constant, constant.co_consts, names)
        elif isinstance(constant, frozenset):
            yield repr(sorted(map(repr, constant)))
        else:
            yield repr(constant)


def _value_parts(value: Any, seen: set[int]) -> Iterator[str]:
    if hasattr(value, "py_func"):
        yield from _parts(value.py_func, seen)
    elif isinstance(value, FunctionType) and _is_ours(value.__module__):
        yield from _parts(value, seen)
    elif isinstance(value, type):
        fields = getattr(value, "_fields", ())
        yield repr((value.__module__, value.__qualname__, fields))
    elif isinstance(value, np.ndarray):
        yield hashlib.sha256(value.tobytes()).hexdigest() + str(value.dtype) + str(value.shape)
    elif value is None or isinstance(
        value, int | float | complex | str | bytes | tuple | np.generic
    ):
        yield repr(value)
    else:
        yield getattr(value, "__name__", type(value).__name__)


def _is_ours(module: str) -> bool:
    return module.partition(".")[0] == __name__.partition(".")[0]
