"""Kernels without reference counts: what they may do and what is refused."""

import numpy as np
import pytest
from numba.core.errors import NumbaError

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
