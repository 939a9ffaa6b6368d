"""Sparse L D L^T: symbolic analysis once a topology, then numeric refactorisations."""

from __future__ import annotations

import ctypes
from abc import ABC, abstractmethod

import numpy as np
import qdldl
import scipy.sparse as sp

from ..compiled.library import address, library
from ..errors import SimulationFailure
from .block_solve import COLUMNS, Solutions
from .supernodes import Supernodes, supernodes_of

_STOPPED = 2  # as in compiled/sources/factor.c
_SINGULAR = "the stiffness is singular: a pivot is exactly zero, as at a bifurcation"


class Factorisation(ABC):
    """L D L^T of a symmetric matrix whose pattern stays the same, without pivoting.

    pivots : (n,) of the last update, in the order of the elimination; their signs are the matrix's
        inertia (Sylvester), which tells stability
    singular : whether the last update met an exactly zero pivot, or was stopped: there is nothing
        to solve with
    """

    def __init__(self) -> None:
        self.pivots = np.empty(0)
        self.singular = True

    @abstractmethod
    def update(self, upper: sp.csc_matrix, most: int | None = None) -> int:
        """Factorise (upper triangle, all diagonal entries present); returns the number of
        non-positive pivots, 1 for a zero one.

        most : stop, with a larger number, once more pivots than this are not positive
        """

    @abstractmethod
    def solve(self, rhs: np.ndarray) -> np.ndarray:
        """Solve for one right-hand side (n,) or for a few (n, k). SimulationFailure if singular."""

    @abstractmethod
    def solve_columns(
        self,
        rhs: sp.csc_matrix,
        constraint: np.ndarray | None = None,
        column: np.ndarray | None = None,
    ) -> Solutions:
        """A^-1 rhs for many sparse right-hand sides (n, k); with a constraint c (n,) and `column` =
        A^-1 c (n,), the solutions d of A d + c t = rhs, c.d = 0. SimulationFailure if singular.

        Every t comes from the solution that it corrects: where A is nearly singular, what rounding
        leaves of its softest mode in a solution is then taken out of it again.
        """

    @property
    @abstractmethod
    def factor_entries(self) -> int:
        """Numbers that L is kept in."""

    def _check(self) -> None:
        if self.singular:
            raise SimulationFailure(_SINGULAR)

    def _counted(self, pivots: np.ndarray | None) -> int:
        """Keep the pivots of an update, None where one is exactly zero, and count the bad ones."""
        self.singular = pivots is None
        self.pivots = np.array([0.0]) if pivots is None else pivots
        return int(np.count_nonzero(~(self.pivots > 0)))


def factorisation() -> Factorisation:
    """An empty factorisation: by supernodes where there are compiled kernels, else by QDLDL."""
    return SparseFactorisation() if library() is None else SupernodalFactorisation()


class _Pattern(ctypes.Structure):
    """`Supernodes` of compiled/sources/factor.c."""

    _fields_ = (
        [(name, ctypes.c_int64) for name in ("n", "n_supernodes")]
        + [
            (name, ctypes.c_void_p)
            for name in (
                "first",
                "row_start",
                "rows",
                "in_parent",
                "children",
                "panel_start",
                "entry_start",
                "entry_from",
                "entry_to",
            )
        ]
        + [(name, ctypes.c_int64) for name in ("stack_size", "widest", "tallest")]
    )


class SupernodalFactorisation(Factorisation):
    """Multifrontal, by dense blocks, in compiled/sources/factor.c."""

    def __init__(self) -> None:
        super().__init__()
        kernels = library()
        assert kernels is not None
        self._kernels = kernels
        self._supernodes: Supernodes | None = None

    def update(self, upper: sp.csc_matrix, most: int | None = None) -> int:
        if self._supernodes is None or not self._same_pattern(upper):
            self._analyse(upper)
        pivots = np.empty(self._n)
        values = np.ascontiguousarray(upper.data, float)
        status = self._kernels.factorise(
            self._at,
            address(values),
            address(self._panels),
            address(pivots),
            self._n if most is None else most,
        )
        if status < 0:
            raise MemoryError("no memory for a factorisation")
        if status == _STOPPED:
            self._counted(None)
            return self._n if most is None else most + 1
        return self._counted(None if status else pivots)

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        self._check()
        if rhs.ndim == 2:
            return np.stack([self.solve(column) for column in rhs.T], axis=1)
        if rhs.shape != (self._n,):
            raise ValueError(f"a right-hand side of shape {rhs.shape}, expected ({self._n},)")
        x = np.asarray(rhs, float)[self._order]
        self._kernels.solve(
            self._at,
            address(self._panels),
            address(self.pivots),
            address(x),
            address(self._work),
        )
        out = np.empty(self._n)
        out[self._order] = x
        return out

    def solve_columns(
        self,
        rhs: sp.csc_matrix,
        constraint: np.ndarray | None = None,
        column: np.ndarray | None = None,
    ) -> Solutions:
        self._check()
        count = rhs.shape[1]
        if rhs.shape[0] != self._n:
            raise ValueError(f"right-hand sides of {rhs.shape[0]} rows, expected {self._n}")
        constrained, shares, own = np.empty(0, np.int64), np.empty(0), np.empty(0)
        if constraint is not None and column is not None:
            rows = np.flatnonzero(constraint)
            shares = constraint[rows] / (constraint @ column)
            constrained, own = self._place[rows], np.asarray(column, float)[self._order]
        blocks = np.empty((-(-count // COLUMNS), self._n, COLUMNS))
        start, rows = rhs.indptr.astype(np.int32), self._place[rhs.indices].astype(np.int32)
        values = np.ascontiguousarray(rhs.data, float)
        status = self._kernels.solve_columns(
            self._at,
            address(self._panels),
            address(self.pivots),
            count,
            address(start, np.int32),
            address(rows, np.int32),
            address(values),
            len(constrained),
            address(constrained, np.int64),
            address(shares),
            address(own),
            address(blocks),
        )
        if status < 0:
            raise MemoryError("no memory for sensitivities")
        return Solutions(blocks, self._place, count)

    @property
    def factor_entries(self) -> int:
        return 0 if self._supernodes is None else len(self._panels)

    def _same_pattern(self, upper: sp.csc_matrix) -> bool:
        known, given = self._entries, (upper.indptr, upper.indices)
        return all(a is b or np.array_equal(a, b) for a, b in zip(known, given))

    def _analyse(self, upper: sp.csc_matrix) -> None:
        self._n = n = upper.shape[0]
        self._entries = upper.indptr, upper.indices
        self._supernodes = s = supernodes_of(upper)
        self._order = s.order
        self._place = np.empty(n, np.int64)
        self._place[s.order] = np.arange(n)
        self._panels = np.empty(int(s.panel_start[-1]))
        self._work = np.empty(s.tallest)
        pattern = _Pattern(n=n, n_supernodes=len(s.children))
        for name, kind in _Pattern._fields_[2:]:
            value = getattr(s, name)
            is_array = kind is ctypes.c_void_p
            setattr(pattern, name, address(value, value.dtype.type) if is_array else value)
        self._pattern = pattern  # with the arrays, whose addresses it has
        self._at = ctypes.addressof(pattern)


class SparseFactorisation(Factorisation):
    """By QDLDL, column by column."""

    def __init__(self) -> None:
        super().__init__()
        self._solver: qdldl.Solver | None = None

    def update(self, upper: sp.csc_matrix, most: int | None = None) -> int:
        try:
            if self._solver is None:
                self._solver = qdldl.Solver(upper, upper=True)
            else:
                self._solver.update(upper, upper=True)
        except RuntimeError:  # an exactly zero pivot: as bad as a negative one
            self._solver = None
            return self._counted(None)
        pivots = self._solver.factors()[1]
        return self._counted(pivots if pivots.all() else None)  # a zero last one is no error to it

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        self._check()
        assert self._solver is not None
        if rhs.ndim == 1:
            return self._solver.solve(np.ascontiguousarray(rhs))
        return np.stack([self.solve(column) for column in rhs.T], axis=1)

    def solve_columns(
        self,
        rhs: sp.csc_matrix,
        constraint: np.ndarray | None = None,
        column: np.ndarray | None = None,
    ) -> Solutions:
        found = np.empty(rhs.shape)
        for j in range(rhs.shape[1]):
            found[:, j] = self.solve(rhs[:, [j]].toarray().ravel())
        if constraint is not None and column is not None:
            found -= np.outer(column, (constraint @ found) / (constraint @ column))
        return Solutions.of(found)

    @property
    def factor_entries(self) -> int:
        return 0 if self._solver is None else self._solver.factors()[0].nnz
