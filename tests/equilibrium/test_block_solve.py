"""Many sparse right-hand sides at once against dense solves."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from kop_exudyn.equilibrium.block_solve import Solutions
from kop_exudyn.equilibrium.factorisation import factorisation

pytestmark = pytest.mark.usefixtures("kernels")


def chain(bodies: int, size: int, seed: int) -> sp.csc_matrix:
    """A positive definite matrix of coupled blocks, in rings of neighbours, as bodies of a
    structure have."""
    rng = np.random.default_rng(seed)
    apart = np.abs(np.subtract.outer(np.arange(bodies), np.arange(bodies)))
    dense = np.kron(np.isin(apart, (0, 1, 5)), np.ones((size, size))) * rng.normal(
        size=(bodies * size,) * 2
    )
    symmetric = dense + dense.T
    return sp.csc_matrix(symmetric + np.diag(1 + np.abs(symmetric).sum(axis=1)))


def whole(solutions: Solutions) -> np.ndarray:
    return solutions.rows(np.arange(len(solutions.place)))


@pytest.mark.parametrize(
    "bodies, size, count", [(30, 6, 200), (25, 7, 72), (40, 1, 5), (1, 3, 1), (12, 4, 73)]
)
def test_same_as_a_dense_solve(bodies, size, count):
    matrix = chain(bodies, size, seed=bodies)
    factors = factorisation()
    assert factors.update(sp.triu(matrix, format="csc")) == 0
    rng = np.random.default_rng(1)
    rhs = sp.random(matrix.shape[0], count, density=0.05, random_state=rng, format="csc")
    expected = np.linalg.solve(matrix.toarray(), rhs.toarray())
    solutions = factors.solve_columns(rhs)
    np.testing.assert_allclose(whole(solutions), expected, rtol=1e-10, atol=1e-14)
    some = rng.integers(matrix.shape[0], size=5)
    assert np.array_equal(solutions.rows(some), whole(solutions)[some])
    sparse = sp.random(7, matrix.shape[0], density=0.2, random_state=rng, format="csr")
    np.testing.assert_allclose(
        solutions.product(sparse), sparse @ whole(solutions), rtol=1e-10, atol=1e-13
    )


def test_a_border_makes_up_for_a_matrix_that_is_nearly_singular():
    """The softest mode's share in a solution, all rounding in K^-1, is set by the constraint."""
    n, rng = 40, np.random.default_rng(3)
    modes = np.linalg.qr(rng.normal(size=(n, n)))[0]
    matrix = (modes * np.append(np.linspace(1, 5, n - 1), 1e-10)) @ modes.T
    rhs = rng.normal(size=(n, 80))
    constraint = np.where(np.arange(n) % 7 == 0, 1.0, 0.0)
    bordered = np.block([[matrix, constraint[:, None]], [constraint, 0.0]])
    expected = np.linalg.solve(bordered, np.vstack([rhs, np.zeros(80)]))[:n]
    factors = factorisation()
    factors.update(sp.csc_matrix(np.triu(matrix)))
    found = whole(factors.solve_columns(sp.csc_matrix(rhs), constraint, factors.solve(constraint)))
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(constraint @ found, 0.0, atol=1e-5)


def test_indefinite_matrices_and_no_right_hand_sides():
    factors = factorisation()
    matrix = sp.csc_matrix(np.array([[1.0, 2, 0], [2, 1, 1], [0, 1, 3]]))
    assert factors.update(sp.triu(matrix, format="csc")) == 1
    inverse = whole(factors.solve_columns(sp.identity(3, format="csc")))
    np.testing.assert_allclose(matrix @ inverse, np.eye(3), atol=1e-12)
    assert whole(factors.solve_columns(sp.csc_matrix((3, 0)))).shape == (3, 0)
