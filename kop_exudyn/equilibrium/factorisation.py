"""Sparse LDL^T by QDLDL: symbolic analysis once a topology, then numeric refactorisations; solves by blocks."""
from __future__ import annotations

import numba as nb
import numpy as np
import qdldl
import scipy.sparse as sp

# Right-hand sides solved together: enough to fill vector registers, few enough for the rows to stay in cache.
_BLOCK = 16


class Factorisation:
    """L D L^T of a symmetric matrix whose pattern stays the same.

    After `update` the pivots' signs are the matrix's inertia (Sylvester), which tells stability.
    """

    def __init__(self) -> None:
        self._solver: qdldl.Solver | None = None
        self._factors: tuple[sp.csc_matrix, np.ndarray, np.ndarray] | None = None
        self.pivots = np.empty(0)

    def update(self, upper: sp.csc_matrix) -> int:
        """Factorise (upper triangle, all diagonal entries present); returns the number of non-positive pivots."""
        try:
            if self._solver is None:
                self._solver = qdldl.Solver(upper, upper=True)
            else:
                self._solver.update(upper, upper=True)
        except RuntimeError:  # an exactly zero pivot: as bad as a negative one
            self._solver = None
            self.pivots = np.array([0.0])
            return 1
        self._factors = self._solver.factors()
        self.pivots = self._factors[1]
        return int(np.count_nonzero(~(self.pivots > 0)))

    @property
    def singular(self) -> bool:
        """Whether the last update met an exactly zero pivot: there is nothing to solve with."""
        return self._solver is None

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        """Solve for one right-hand side (n,) or for many (n, k)."""
        if rhs.ndim == 1:
            return self._solver.solve(rhs)
        L, D, order = self._factors
        out = np.empty(rhs.shape)
        _solve_blocks(L.indptr, L.indices, L.data, 1 / D, np.asarray(order), np.ascontiguousarray(rhs), out)
        return out

    @property
    def factor_entries(self) -> int:
        """Non-zeros of L."""
        return 0 if self._factors is None else self._factors[0].nnz


@nb.njit(cache=True)
def _solve_blocks(indptr, indices, data, inverse_pivots, order, rhs, out):
    """Forward, diagonal and backward substitution for blocks of columns at once (A = P L D L^T P^T).

    Right-hand sides of sensitivities are sparse, so the forward pass skips rows that are still zero.
    """
    n, total = rhs.shape
    work = np.empty((n, _BLOCK))
    for start in range(0, total, _BLOCK):
        k = min(_BLOCK, total - start)
        for i in range(n):
            for c in range(_BLOCK):
                work[i, c] = rhs[order[i], start + c] if c < k else 0.0
        for j in range(n):
            filled = False
            for c in range(_BLOCK):
                filled |= work[j, c] != 0.0
            if not filled:
                continue
            for t in range(indptr[j], indptr[j + 1]):
                i, v = indices[t], data[t]
                for c in range(_BLOCK):
                    work[i, c] -= v * work[j, c]
        for i in range(n):
            for c in range(_BLOCK):
                work[i, c] *= inverse_pivots[i]
        for j in range(n - 1, -1, -1):
            for t in range(indptr[j], indptr[j + 1]):
                i, v = indices[t], data[t]
                for c in range(_BLOCK):
                    work[j, c] -= v * work[i, c]
        for i in range(n):
            for c in range(k):
                out[order[i], start + c] = work[i, c]
