"""Dense blocks with a border are factorised by themselves; the solution is that of the general
factorisation."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from kop_exudyn.sqp.qp_backends import factorise_positive


def arrow(seed: int, sizes=(90, 120, 70), border: int = 7, shift: float = 1.0) -> sp.csc_matrix:
    rng = np.random.default_rng(seed)
    halves = [rng.normal(size=(n, n)) for n in sizes]
    blocks = sp.block_diag([h @ h.T + shift * np.eye(len(h)) for h in halves])
    coupling = sp.csc_matrix(rng.normal(size=(sum(sizes), border)))
    corner = sp.csc_matrix(5000 * np.eye(border))
    return sp.csc_matrix(sp.bmat([[blocks, coupling], [coupling.T, corner]]))


@pytest.mark.parametrize("seed", range(3))
def test_same_solution_as_a_dense_solve(seed):
    matrix = arrow(seed)
    rhs = np.random.default_rng(seed + 10).normal(size=matrix.shape[0])
    expected = np.linalg.solve(matrix.toarray(), rhs)
    for border in (7, 0):
        np.testing.assert_allclose(
            factorise_positive(matrix, border)(rhs), expected, rtol=1e-8, atol=1e-11
        )


def test_an_indefinite_block_or_border_is_refused():
    matrix = arrow(0)
    dented = matrix.copy().tolil()
    dented[5, 5] -= 1e4
    assert factorise_positive(sp.csc_matrix(dented), 7) is None
    dented = matrix.copy().tolil()
    dented[-1, -1] = -1.0
    assert factorise_positive(sp.csc_matrix(dented), 7) is None
