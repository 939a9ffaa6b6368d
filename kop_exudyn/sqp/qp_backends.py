"""The solvers behind qp.py. All of them work on the scaled QP: unit diagonal of H, largest gradient
entry 1.

    min 1/2 x^T H x + g^T x   with   lo <= A x <= hi,   lb <= x <= ub
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import osqp
import piqp
import scipy.sparse as sp
from numpy.linalg import LinAlgError
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse.linalg import splu

_SMALLEST_PIVOT = 1e-13  # of the largest; anything below counts as singular
_DENSE_SHARE = 50  # entries a column from which dense blocks are looked for
_MOST_BLOCKS = 200
_FILLED = 0.5  # share of H's entries from which it counts as dense
_SEMIDEFINITE = 1e-7  # shift that a semidefinite matrix may need; OSQP itself adds 1e-6
_RHO = 0.1  # with few active limits faster than 1 on the scaled QP, with very many slower
_SOLVED = (osqp.SolverStatus.OSQP_SOLVED, osqp.SolverStatus.OSQP_SOLVED_INACCURATE)
_INFEASIBLE = (
    osqp.SolverStatus.OSQP_PRIMAL_INFEASIBLE,
    osqp.SolverStatus.OSQP_PRIMAL_INFEASIBLE_INACCURATE,
)
_UNBOUNDED = (
    osqp.SolverStatus.OSQP_DUAL_INFEASIBLE,
    osqp.SolverStatus.OSQP_DUAL_INFEASIBLE_INACCURATE,
)


@dataclass(frozen=True)
class QP:
    """min 1/2 x^T H x + g^T x with lo <= A x <= hi and lb <= x <= ub.

    H : (n, n) sparse, symmetric with both triangles, positive semidefinite
    g : (n,); A : (m, n) sparse; lo, hi : (m,); lb, ub : (n,), infinite where free
    border : how many of the last unknowns couple otherwise uncoupled blocks of H; only speed
        depends on it
    """

    H: sp.csc_matrix
    g: np.ndarray
    A: sp.csr_matrix
    lo: np.ndarray
    hi: np.ndarray
    lb: np.ndarray
    ub: np.ndarray
    border: int = 0


@dataclass(frozen=True)
class RawSolution:
    """x (n,), multipliers y (m,) and z (n,) with H x + g + A^T y + z = 0, and what the solver says
    of itself."""

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    status: str  # solved, infeasible, unbounded, indefinite or failed
    iterations: int


def factorise_positive(
    matrix: sp.csc_matrix, border: int = 0
) -> Callable[[np.ndarray], np.ndarray] | None:
    """A solver for a symmetric sparse matrix, or None unless it is (numerically) positive definite.

    border : how many of the last unknowns couple blocks of the others. Dense blocks are then
        factorised by themselves (LAPACK's Cholesky) and the border by its Schur complement: for
        five designs ten times faster than SuperLU.
    Otherwise SuperLU with diagonal pivots is an L D L^T factorisation, D the diagonal of U.
    """
    blocks = _dense_blocks(matrix, border)
    if blocks is not None:
        return _factorise_blocks(matrix, blocks, border)
    try:
        options = {"SymmetricMode": True}
        lu = splu(matrix, permc_spec="COLAMD", diag_pivot_thresh=0.0, options=options)
    except RuntimeError:  # exactly singular
        return None
    pivots = lu.U.diagonal()
    if (
        not np.array_equal(lu.perm_r, lu.perm_c)
        or pivots.min() <= _SMALLEST_PIVOT * np.abs(pivots).max()
    ):
        return None
    return lu.solve


def _dense_blocks(matrix: sp.csc_matrix, border: int) -> list[slice] | None:
    """Consecutive, uncoupled blocks of the unknowns before the border, if they are dense enough to
    be worth it."""
    n = matrix.shape[0] - border
    inner = sp.csc_matrix(matrix)[:n, :n]
    if n == 0 or inner.nnz < _DENSE_SHARE * n:
        return None
    inner.sort_indices()
    last, filled = np.arange(n), np.diff(inner.indptr) > 0
    last[filled] = inner.indices[inner.indptr[1:][filled] - 1]
    reach = np.maximum.accumulate(np.maximum(last, np.arange(n)))
    ends = np.flatnonzero(reach == np.arange(n)) + 1
    blocks = [slice(a, b) for a, b in zip([0, *ends[:-1]], ends)]
    area = sum((b.stop - b.start) ** 2 for b in blocks)
    return blocks if inner.nnz > 0.2 * area and len(blocks) <= _MOST_BLOCKS else None


def _factorise_blocks(
    matrix: sp.csc_matrix, blocks: list[slice], border: int
) -> Callable[[np.ndarray], np.ndarray] | None:
    """Cholesky of every block and of the border's Schur complement."""
    n = matrix.shape[0] - border
    columns = matrix[:n, n:].toarray()
    corner = matrix[n:, n:].toarray()
    factors, reduced = [], np.empty_like(columns)
    try:
        for block in blocks:
            factors.append(cho_factor(matrix[block, block].toarray(), lower=True))
            reduced[block] = cho_solve(factors[-1], columns[block])
        schur = cho_factor(corner - columns.T @ reduced, lower=True) if border else None
    except LinAlgError:
        return None
    pivots = np.concatenate([np.diag(f[0]) ** 2 for f in [*factors, *([schur] if border else [])]])
    if pivots.min() <= _SMALLEST_PIVOT * pivots.max():
        return None

    def solve(rhs: np.ndarray) -> np.ndarray:
        x = np.concatenate(
            [cho_solve(factor, rhs[block]) for factor, block in zip(factors, blocks)]
        )
        if not border:
            return x
        y = cho_solve(schur, rhs[n:] - columns.T @ x)
        return np.concatenate([x - reduced @ y, y])

    return solve


def is_indefinite(matrix: sp.csc_matrix, border: int = 0) -> bool:
    """Whether a matrix of unit diagonal that is not positive definite isn't semidefinite either,
    beyond rounding."""
    shifted = sp.csc_matrix(matrix + _SEMIDEFINITE * sp.identity(matrix.shape[0]))
    return factorise_positive(shifted, border) is None


def solve_direct(qp: QP, solve: Callable[[np.ndarray], np.ndarray]) -> RawSolution | None:
    """The unconstrained minimiser, if no limit cuts it off: then it solves the QP. ``solve`` is
    H^-1."""
    x = solve(-qp.g)
    x += solve(-qp.g - qp.H @ x)  # one refinement brings the residual to rounding
    row = qp.A @ x
    inside = np.all((qp.lb <= x) & (x <= qp.ub)) and np.all((qp.lo <= row) & (row <= qp.hi))
    if not (inside and np.all(np.isfinite(x))):
        return None
    return RawSolution(x, np.zeros(row.size), np.zeros(x.size), "solved", 0)


class OsqpBackend:
    """OSQP, set up once for a sparsity pattern and updated afterwards.

    Results depend only on the data and the warm start, not on earlier solves, which an interrupted
    and resumed run needs: OSQP's own scaling, which accumulates rounding between updates, is off
    (the QP comes scaled), and its penalty starts from the same value in every solve.
    """

    def __init__(self, eps: float, max_iterations: int):
        self._settings = dict(
            verbose=False,
            eps_abs=eps,
            eps_rel=eps,
            eps_prim_inf=1e-9,
            eps_dual_inf=1e-9,
            max_iter=max_iterations,
            polishing=False,
            polish_refine_iter=10,
            scaling=0,
            rho=_RHO,
            adaptive_rho=1,
            adaptive_rho_interval=50,
            check_termination=25,
        )
        self._solver: Any = None  # osqp.OSQP, which is untyped
        self._pattern: tuple[np.ndarray, ...] = ()
        self._rho_moved = False
        self.setups = 0

    def solve(self, qp: QP, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> RawSolution:
        """Solve from the warm start (x, y, z)."""
        limited = np.flatnonzero(np.isfinite(qp.lb) | np.isfinite(qp.ub))
        upper = sp.triu(qp.H, format="csc")
        rows = sp.vstack([qp.A, sp.identity(x.size, format="csr")[limited]], format="csc")
        low, high = np.concatenate([qp.lo, qp.lb[limited]]), np.concatenate([qp.hi, qp.ub[limited]])
        dual = np.concatenate([y, z[limited]])
        try:
            self._load(upper, qp.g, rows, low, high, limited)
            result = self._run(rows, low, high, x, dual)
        except (osqp.OSQPException, ValueError):
            self.discard()
            return RawSolution(x, y, z, "failed", 0)
        return _unpack(result, limited, y.size, x.size)

    def discard(self) -> None:
        """Set up anew next time: after a failure OSQP's factorisation may be void."""
        self._solver = None

    def _load(
        self,
        upper: sp.csc_matrix,
        g: np.ndarray,
        rows: sp.csc_matrix,
        low: np.ndarray,
        high: np.ndarray,
        limited: np.ndarray,
    ) -> None:
        """Set up for a new pattern, else update; the penalty as at the start."""
        pattern = (upper.indptr, upper.indices, rows.indptr, rows.indices, limited)
        known = len(self._pattern) == len(pattern)
        if (
            self._solver is not None
            and known
            and all(np.array_equal(a, b) for a, b in zip(self._pattern, pattern))
        ):
            self._solver.update_settings(polishing=False)
            self._solver.update(q=g, l=low, u=high, Px=upper.data, Ax=rows.data)
            if self._rho_moved:  # costs a factorisation
                self._solver.update_settings(rho=_RHO)
                self._rho_moved = False
            return
        self._solver = osqp.OSQP()
        self._solver.setup(upper, g, rows, low, high, **self._settings)
        self._pattern, self._rho_moved = pattern, False
        self.setups += 1

    def _run(
        self,
        rows: sp.csc_matrix,
        low: np.ndarray,
        high: np.ndarray,
        x: np.ndarray,
        dual: np.ndarray,
    ) -> Any:
        """Iterate, then polish. Polishing is asked for only where a limit is active: OSQP prints a
        line otherwise."""
        self._solver.warm_start(x=x, y=dual)
        result = self._solver.solve(raise_error=False)
        self._rho_moved |= result.info.rho_updates > 0
        if result.info.status_val not in _SOLVED:
            return result
        value = np.clip(rows @ result.x, low, high)
        if not np.any((value - low < -result.y) | (high - value < result.y)):
            return result
        iterations = result.info.iter
        self._solver.update_settings(polishing=True)
        self._solver.warm_start(x=result.x, y=result.y)
        result = self._solver.solve(raise_error=False)
        self._rho_moved |= result.info.rho_updates > 0
        result.info.iter += iterations
        return result


def _unpack(result: Any, limited: np.ndarray, m: int, n: int) -> RawSolution:
    code = result.info.status_val
    status = "solved" if code in _SOLVED else "infeasible" if code in _INFEASIBLE else "failed"
    status = "unbounded" if code in _UNBOUNDED else status
    x = np.zeros(n) if result.x is None or status != "solved" else np.array(result.x)
    dual = (
        np.zeros(m + limited.size) if result.y is None or status != "solved" else np.array(result.y)
    )
    z = np.zeros(n)
    z[limited] = dual[m:]
    return RawSolution(x, dual[:m], z, status, int(result.info.iter))


def solve_piqp(qp: QP, eps: float, max_iterations: int) -> RawSolution:
    """PIQP, an interior-point method: accurate, in a dozen iterations, where a first-order method
    stalls. Where most of H is filled, its dense solver is seven times faster (492 unknowns)."""
    dense = qp.H.nnz > _FILLED * qp.g.size**2
    solver = piqp.DenseSolver() if dense else piqp.SparseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = eps
    solver.settings.eps_duality_gap_abs = solver.settings.eps_duality_gap_rel = eps
    solver.settings.max_iter = max_iterations
    fixed = qp.lo == qp.hi

    def as_taken(matrix: Any) -> Any:
        return matrix.toarray() if dense else sp.csc_matrix(matrix)

    equal = (as_taken(qp.A[fixed]), qp.lo[fixed]) if fixed.any() else (None, None)
    between = (
        (as_taken(qp.A[~fixed]), qp.lo[~fixed], qp.hi[~fixed])
        if (~fixed).any()
        else (None, None, None)
    )
    solver.setup(as_taken(qp.H), qp.g, *equal, *between, qp.lb, qp.ub)
    code = solver.solve()
    result = solver.result
    names = {
        piqp.PIQP_SOLVED: "solved",
        piqp.PIQP_PRIMAL_INFEASIBLE: "infeasible",
        piqp.PIQP_DUAL_INFEASIBLE: "unbounded",
    }
    y = np.zeros(qp.lo.size)
    if fixed.any():
        y[fixed] = result.y
    if (~fixed).any():
        y[~fixed] = np.array(result.z_u) - np.array(result.z_l)
    z = np.array(result.z_bu) - np.array(result.z_bl)
    return RawSolution(np.array(result.x), y, z, names.get(code, "failed"), int(result.info.iter))
