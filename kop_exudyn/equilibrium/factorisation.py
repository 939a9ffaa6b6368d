"""Sparse LDL^T by QDLDL: symbolic analysis once a topology, then numeric refactorisations."""

from __future__ import annotations

import numpy as np
import qdldl
import scipy.sparse as sp

from ..errors import SimulationFailure
from .block_solve import Solutions, panels_of, solve_columns

_SINGULAR = "the stiffness is singular: a pivot is exactly zero, as at a bifurcation"


class Factorisation:
    """L D L^T of a symmetric matrix whose pattern stays the same.

    After `update` the pivots' signs are the matrix's inertia (Sylvester), which tells stability.
    """

    def __init__(self) -> None:
        self._solver: qdldl.Solver | None = None
        self._factors: tuple[sp.csc_matrix, np.ndarray, np.ndarray] | None = None
        self._panels: np.ndarray | None = None  # of L, whose pattern stays the same as well
        self.pivots = np.empty(0)

    def update(self, upper: sp.csc_matrix) -> int:
        """Factorise (upper triangle, all diagonal entries present); returns the number of
        non-positive pivots."""
        try:
            if self._solver is None:
                self._solver = qdldl.Solver(upper, upper=True)
            else:
                self._solver.update(upper, upper=True)
        except RuntimeError:  # an exactly zero pivot: as bad as a negative one
            self._solver = self._factors = None  # what is left is of an earlier matrix
            self.pivots = np.array([0.0])
            return 1
        factors = self._solver.factors()
        self.pivots = factors[1]
        # an exactly zero last pivot is no error to QDLDL
        self._factors = factors if self.pivots.all() else None
        return int(np.count_nonzero(~(self.pivots > 0)))

    @property
    def singular(self) -> bool:
        """Whether the last update met an exactly zero pivot: there is nothing to solve with."""
        return self._factors is None

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        """Solve for one right-hand side (n,) or for a few (n, k). SimulationFailure if singular."""
        if self._solver is None or self._factors is None:
            raise SimulationFailure(_SINGULAR)
        if rhs.ndim == 1:
            return self._solver.solve(rhs)
        return np.stack(
            [self._solver.solve(np.ascontiguousarray(column)) for column in rhs.T], axis=1
        )

    def solve_columns(
        self,
        rhs: sp.csc_matrix,
        constraint: np.ndarray | None = None,
        column: np.ndarray | None = None,
    ) -> Solutions:
        """Solve for many sparse right-hand sides (n, k), bordered by a constraint (n,) if its
        column is given too. SimulationFailure if singular."""
        if self._factors is None:
            raise SimulationFailure(_SINGULAR)
        L, pivots, order = self._factors
        if self._panels is None:
            self._panels = panels_of(L.indptr, L.indices)
        return solve_columns(L, pivots, np.asarray(order), self._panels, rhs, constraint, column)

    @property
    def factor_entries(self) -> int:
        """Non-zeros of L."""
        return 0 if self._factors is None else self._factors[0].nnz
