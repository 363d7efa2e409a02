"""Kernels without reference counts: what they may do and what is refused."""

import ast
from pathlib import Path

import numpy as np
import pytest
from numba.core.errors import NumbaError

import pushplan
from pushplan.compiled import copy_into, kernel


@pytest.mark.parametrize("shape", [(4,), (3, 2), (0, 3)])
def test_arrays_are_copied_and_the_source_stays_as_it_is(shape):
    source = np.arange(float(np.prod(shape))).reshape(shape)
    before, out = source.copy(), np.full(shape, np.nan)
    copy_into(out, source)
    assert np.array_equal(out, source) and np.array_equal(source, before)


def test_views_of_arrays_that_are_given_outlive_the_kernel():
    def fill(rows):
        for i in range(rows.shape[0]):
            row = rows[i]
            row[0] = float(i)

    compiled = kernel(fill)
    rows = np.full((1000, 2), -1.0)
    for _ in range(50):
        compiled(rows[::2].copy())
        compiled(rows)
    assert np.array_equal(rows[:, 0], np.arange(1000.0)) and (rows[:, 1] == -1.0).all()


def test_a_kernel_that_makes_an_array_is_refused_when_it_is_compiled():
    def make(count):
        return np.zeros(count)

    with pytest.raises(NumbaError):
        kernel(make)(3)


REDUCTIONS = {"all", "any", "argmax", "argmin", "max", "mean", "min", "sum", "take"}
"""Methods of arrays that Numba compiles with reference counts, unless it has done so before."""


def kernels_of(path):
    """Functions of a file that are kernels which make no arrays."""
    for function in ast.walk(ast.parse(path.read_text())):
        for mark in getattr(function, "decorator_list", []):
            options = {key.arg for key in mark.keywords} if isinstance(mark, ast.Call) else set()
            name = mark.func if isinstance(mark, ast.Call) else mark
            if getattr(name, "id", "") == "kernel" and "allocates" not in options:
                yield function


def test_kernels_that_make_no_arrays_reduce_none():
    """Whether such a kernel compiles would depend on what was compiled before it."""
    files = sorted(Path(pushplan.__file__).parent.rglob("*.py"))
    found, count = [], 0
    for path in files:
        for function in kernels_of(path):
            count += 1
            for call in ast.walk(function):
                method = call.func if isinstance(call, ast.Call) else None
                if isinstance(method, ast.Attribute) and method.attr in REDUCTIONS:
                    found.append(f"{path.name}:{call.lineno}: {ast.unparse(call)}")
    assert count > 100
    assert not found
