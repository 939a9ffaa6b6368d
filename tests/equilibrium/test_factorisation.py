"""L D L^T against dense solves and eigenvalues, for patterns of many kinds."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.compiled.library import library
from kop_exudyn.equilibrium.factorisation import (
    SparseFactorisation,
    SupernodalFactorisation,
)
from kop_exudyn.equilibrium.supernodes import supernodes_of
from kop_exudyn.errors import SimulationFailure

needs_kernels = pytest.mark.skipif(library() is None, reason="there are no compiled kernels")


def blocks(seed: int, sizes: list[int], density: float) -> np.ndarray:
    """A random symmetric matrix of coupled dense blocks; blocks without neighbours occur."""
    rng = np.random.default_rng(seed)
    coupled = np.triu(rng.random((len(sizes),) * 2) < density, 1)
    starts = np.concatenate([[0], np.cumsum(sizes)])
    mask = np.zeros((starts[-1],) * 2, bool)
    for i, j in [*zip(*np.nonzero(coupled)), *((k, k) for k in range(len(sizes)))]:
        mask[starts[i] : starts[i + 1], starts[j] : starts[j + 1]] = True
    mask |= mask.T
    matrix = np.where(mask, rng.normal(size=mask.shape), 0.0)
    matrix = matrix + matrix.T
    return matrix + np.diag(2 * np.abs(matrix).sum(axis=1) * rng.choice([1.0, -1.0], len(mask)))


def upper_of(matrix: np.ndarray) -> sp.csc_matrix:
    return sp.csc_matrix(np.triu(matrix))


@needs_kernels
@settings(max_examples=80, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    sizes=st.lists(st.sampled_from([1, 1, 2, 5, 6, 6, 6, 7, 13]), min_size=1, max_size=25),
    density=st.floats(0.0, 0.6),
)
def test_inertia_and_solutions(seed, sizes, density):
    matrix = blocks(seed, sizes, density)
    eigenvalues = np.linalg.eigvalsh(matrix)
    rhs = np.random.default_rng(seed).normal(size=(len(matrix), 3))
    expected = np.linalg.solve(matrix, rhs)
    for factors in (SupernodalFactorisation(), SparseFactorisation()):
        for scale in (1.0, -2.0):  # the second time through the numeric refactorisation
            negative = int(np.sum(scale * eigenvalues < 0))
            assert factors.update(upper_of(scale * matrix)) == negative
            assert len(factors.pivots) == len(matrix) and not factors.singular
            found = factors.solve(rhs)
            assert np.allclose(scale * found, expected, rtol=1e-8, atol=1e-10)
            assert np.array_equal(found[:, 1], factors.solve(rhs[:, 1]))


@needs_kernels
@pytest.mark.parametrize("width, below", [(1, 0), (40, 0), (9, 70), (64, 3), (130, 65)])
def test_wide_and_tall_supernodes(width, below):
    """Dense matrices and arrows: one supernode, and two."""
    n = width + below
    rng = np.random.default_rng(n)
    matrix = rng.normal(size=(n, n))
    matrix = matrix @ matrix.T + n * np.eye(n)
    factors = SupernodalFactorisation()
    assert factors.update(upper_of(matrix)) == 0
    rhs = rng.normal(size=n)
    assert np.allclose(matrix @ factors.solve(rhs), rhs, atol=1e-10)
    assert np.prod(factors.pivots / n) == pytest.approx(
        np.exp(np.linalg.slogdet(matrix / n)[1]), rel=1e-9
    )


@needs_kernels
def test_the_symbolic_factorisation_has_everything_once():
    matrix = blocks(5, [6, 1, 6, 6, 2, 6, 1, 1, 6], 0.4)
    upper = upper_of(matrix)
    s = supernodes_of(upper)
    n = len(matrix)
    assert sorted(s.order) == list(range(n)) and s.first[-1] == n
    assert len(s.children) < n  # blocks are supernodes
    assert np.sum(s.children) == len(s.children) - np.sum(np.diff(s.row_start) == 0)
    assert sorted(s.entry_from) == list(range(upper.nnz))
    assert len(np.unique(s.entry_to)) == upper.nnz and s.entry_to.max() < s.panel_start[-1]
    for t in range(len(s.children)):
        rows = s.rows[s.row_start[t] : s.row_start[t + 1]]
        assert (np.diff(rows) > 0).all() and (rows >= s.first[t + 1]).all()


@pytest.mark.parametrize(
    "make", [pytest.param(SupernodalFactorisation, marks=needs_kernels), SparseFactorisation]
)
def test_zero_pivots_and_values_that_are_no_numbers(make):
    factors = make()
    good = np.array([[2.0, 1, 0], [1, 2, 1], [0, 1, 2]])
    assert factors.singular
    assert factors.update(sp.csc_matrix((np.array([2.0, 0, 2]), np.arange(3), np.arange(4)))) == 1
    assert factors.singular
    assert factors.update(upper_of(good)) == 0 and not factors.singular
    upper = upper_of(good)
    upper.data = upper.data * np.nan
    assert factors.update(upper) == 3  # bad pivots, not good ones
    assert factors.update(upper_of(good)) == 0
    assert np.allclose(good @ factors.solve(np.ones(3)), 1)


@needs_kernels
def test_a_matrix_of_another_pattern_is_analysed_anew():
    factors = SupernodalFactorisation()
    for size in (4, 9, 4):
        matrix = blocks(size, [1] * size, 0.5)
        factors.update(upper_of(matrix))
        assert np.allclose(matrix @ factors.solve(np.ones(size)), 1)


@needs_kernels
def test_the_same_matrix_gives_the_same_digits():
    matrix = blocks(3, [6] * 12, 0.3)
    one, two = SupernodalFactorisation(), SupernodalFactorisation()
    one.update(upper_of(blocks(4, [6] * 12, 0.3)))  # what was there before leaves no trace
    for factors in (one, two):
        factors.update(upper_of(matrix))
    assert np.array_equal(one.pivots, two.pivots)
    assert np.array_equal(one.solve(np.ones(72)), two.solve(np.ones(72)))


@pytest.mark.parametrize(
    "make", [pytest.param(SupernodalFactorisation, marks=needs_kernels), SparseFactorisation]
)
def test_more_bad_pivots_than_are_of_use(make):
    matrix = blocks(8, [6, 1, 6, 6], 0.5)
    negative = int(np.sum(np.linalg.eigvalsh(matrix) < 0))
    assert negative > 3
    factors = make()
    for most in (0, 1, negative - 1):
        assert factors.update(upper_of(matrix), most) > most
    for most in (negative, negative + 1, None):
        assert factors.update(upper_of(matrix), most) == negative and not factors.singular
    assert np.allclose(matrix @ factors.solve(np.ones(19)), 1)


@needs_kernels
def test_nothing_is_solved_with_what_was_given_up():
    matrix = blocks(8, [6, 1, 6, 6], 0.5)
    factors = SupernodalFactorisation()
    factors.update(upper_of(matrix), 0)
    assert factors.singular
    with pytest.raises(SimulationFailure):
        factors.solve(np.ones(19))
