"""How kernels are compiled."""

import sys

import numba as nb
import numpy as np
import pytest

from kop_exudyn.rods.kernels import kernel


@kernel
def ratios(vectors, out):
    for i in range(vectors.shape[0]):
        row = vectors[i]
        out[i] = row[0] / row[1]


def test_a_division_by_zero_is_no_exception():
    out = np.empty(3)
    ratios(np.array([[1.0, 2.0], [1.0, 0.0], [0.0, 0.0]]), out)
    assert out[0] == 0.5 and np.isinf(out[1]) and np.isnan(out[2])


def test_views_leave_the_caller_its_arrays():
    vectors, out = np.ones((1000, 2)), np.empty(1000)
    before = sys.getrefcount(vectors), sys.getrefcount(out)
    for _ in range(50):
        ratios(vectors, out)
    assert (sys.getrefcount(vectors), sys.getrefcount(out)) == before
    assert np.all(vectors == 1.0) and np.all(out == 1.0)


def test_a_kernel_makes_no_arrays():
    @kernel
    def makes(n):
        return np.empty(n)

    with pytest.raises(nb.core.errors.NumbaError):
        makes(3)
