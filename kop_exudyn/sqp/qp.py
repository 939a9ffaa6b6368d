"""Convex quadratic programmes: OSQP, checked by the solution's own residuals, with PIQP to hand
over to."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from .qp_backends import (
    QP,
    OsqpBackend,
    RawSolution,
    factorise_positive,
    is_indefinite,
    solve_direct,
    solve_piqp,
)

# of the largest; smaller diagonal entries of H do not set the scale of their variable
_SMALLEST_DIAGONAL = 1e-12
_INTERIOR = 1e-5  # of what is accepted: PIQP gains a digit with each of its last iterations


@dataclass(frozen=True)
class QPOptions:
    """Settings of QPSolver.

    eps : OSQP's tolerance, absolute and relative, on the scaled QP
    tight_eps : its tolerance in the second try
    accept : largest residual of an accepted solution
    max_iterations : of OSQP, in each try
    direct : take the unconstrained minimiser, by one factorisation, where no limit cuts it off
        (exact; OSQP otherwise)
    interior_point : try PIQP before OSQP: quicker where many rows push, as those of elements that
        are held in intervals
    """

    eps: float = 1e-8
    tight_eps: float = 1e-10
    accept: float = 1e-7
    max_iterations: int = 20_000
    direct: bool = True
    interior_point: bool = False


@dataclass(frozen=True)
class Residuals:
    """What is left of the optimality conditions, relative to the largest terms in each; NaN when
    nothing was solved.

    stationarity : H x + g + A^T y + z;  feasibility : A x and x outside their limits;
    complementarity : multiplier times distance to the limit it belongs to
    """

    stationarity: float
    feasibility: float
    complementarity: float

    @property
    def worst(self) -> float:
        return float(np.max([self.stationarity, self.feasibility, self.complementarity]))


@dataclass(frozen=True)
class QPResult:
    """A solution: x (n,), multipliers y (m,) of the rows and z (n,) of the bounds, positive at an
    upper limit.

    status : ``solved``; or ``infeasible``, ``unbounded``, ``indefinite`` (H) or ``failed``: x and
        multipliers are void
    solver : ``direct``, ``osqp``, ``osqp, tightened``, ``piqp`` or ``dual``
    """

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    status: str
    residuals: Residuals
    solver: str
    iterations: int
    wall_s: float

    @property
    def active(self) -> int:
        """The number of limits that push."""
        return int(np.count_nonzero(self.y) + np.count_nonzero(self.z))


class QPSolver:
    """Solves a sequence of QPs; those with the same sparsity pattern reuse OSQP's set-up."""

    def __init__(self, options: QPOptions | None = None):
        self.options = options or QPOptions()
        self._osqp = OsqpBackend(self.options.eps, self.options.max_iterations)
        self._tight = OsqpBackend(self.options.tight_eps, self.options.max_iterations)

    @property
    def setups(self) -> int:
        """How often OSQP was set up anew."""
        return self._osqp.setups + self._tight.setups

    def solve(
        self,
        qp: QP,
        start: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None,
        interior_point: bool | None = None,
    ) -> QPResult:
        """Solve, from the warm start (x, y, z) where given. A solution is ``solved`` only if its
        residuals say so.

        interior_point : for this QP in place of what the options say
        """
        began = time.perf_counter()
        scaling = _Scaling.of(qp)
        scaled = scaling.apply(qp)
        if start is None:
            start = (np.zeros(qp.g.size), np.zeros(qp.lo.size), np.zeros(qp.g.size))
        interior = self.options.interior_point if interior_point is None else interior_point
        raw, residuals, solver = self._attempts(scaled, scaling.into(*start), interior)
        x, y, z = scaling.back(raw.x, raw.y, raw.z)
        return QPResult(
            x, y, z, raw.status, residuals, solver, raw.iterations, time.perf_counter() - began
        )

    def residuals(self, qp: QP, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> Residuals:
        """What a solution that was found otherwise leaves of the optimality conditions."""
        scaling = _Scaling.of(qp)
        return residuals_of(scaling.apply(qp), *scaling.into(x, y, z))

    def _attempts(
        self,
        qp: QP,
        start: tuple[np.ndarray, np.ndarray, np.ndarray],
        interior_first: bool,
    ) -> tuple[RawSolution, Residuals, str]:
        nothing = Residuals(np.nan, np.nan, np.nan)
        inverse = factorise_positive(qp.H, qp.border)
        # OSQP would only print so, and only at set-up
        if inverse is None and is_indefinite(qp.H, qp.border):
            return RawSolution(start[0], start[1], start[2], "indefinite", 0), nothing, "direct"
        direct = solve_direct(qp, inverse) if inverse is not None and self.options.direct else None
        attempts = [("direct", lambda: direct)] if direct is not None else []
        interior = ("piqp", lambda: solve_piqp(qp, _INTERIOR * self.options.accept, 100))
        attempts += [interior] if interior_first else []
        attempts += [
            ("osqp", lambda: self._osqp.solve(qp, *start)),
            ("osqp, tightened", lambda: self._tight.solve(qp, *start)),
        ]
        attempts += [] if interior_first else [interior]
        for solver, attempt in attempts:
            raw = _without_void_multipliers(qp, attempt())
            residuals = residuals_of(qp, raw.x, raw.y, raw.z)
            # what PIQP ends with short of its own tolerance can be a solution all the same
            usable = raw.status == "solved" or (solver == "piqp" and raw.status == "failed")
            if usable and residuals.worst <= self.options.accept:
                return replace(raw, status="solved"), residuals, solver
            self._osqp.discard()
            self._tight.discard()
        status = "failed" if raw.status == "solved" else raw.status
        return RawSolution(raw.x, raw.y, raw.z, status, raw.iterations), nothing, solver


def residuals_of(qp: QP, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> Residuals:
    """The relative residuals of a solution. Meant for the scaled QP, where gradient and curvature
    are of order 1."""
    curvature, push, row = qp.H @ x, qp.A.T @ y, qp.A @ x
    size = max(_largest(qp.g), _largest(curvature), _largest(push), _largest(z)) or 1.0
    stationarity = _largest(curvature + qp.g + push + z) / size
    outside = max(_outside(row, qp.lo, qp.hi), _outside(x, qp.lb, qp.ub))
    feasibility = outside / max(1.0, _largest(x), _largest(row))
    gaps = max(_gap(row, qp.lo, qp.hi, y), _gap(x, qp.lb, qp.ub, z))
    complementarity = gaps / max(1.0, abs(float(x @ curvature)), abs(float(qp.g @ x)))
    return Residuals(stationarity, feasibility, complementarity)


def _without_void_multipliers(qp: QP, raw: RawSolution) -> RawSolution:
    """Multipliers of infinite limits set to zero: what rounding leaves there then shows up in the
    stationarity."""

    def clean(multiplier: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        return np.clip(
            multiplier,
            np.where(np.isfinite(low), -np.inf, 0.0),
            np.where(np.isfinite(high), np.inf, 0.0),
        )

    return RawSolution(
        raw.x, clean(raw.y, qp.lo, qp.hi), clean(raw.z, qp.lb, qp.ub), raw.status, raw.iterations
    )


def _largest(vector: np.ndarray) -> float:
    return float(np.max(np.abs(vector), initial=0.0))


def _outside(value: np.ndarray, low: np.ndarray, high: np.ndarray) -> float:
    return float(max(np.max(low - value, initial=0.0), np.max(value - high, initial=0.0)))


def _gap(value: np.ndarray, low: np.ndarray, high: np.ndarray, multiplier: np.ndarray) -> float:
    """Largest multiplier times the distance of its row from the limit that its sign belongs to."""
    limit = np.where(multiplier > 0, high, low)
    pushing = multiplier != 0
    return _largest(multiplier[pushing] * (limit - value)[pushing])


@dataclass(frozen=True)
class _Scaling:
    """x = length * variable * x', rows multiplied by ``row``: unit diagonal of H, unit rows,
    largest |g'| = 1."""

    variable: np.ndarray
    row: np.ndarray
    length: float

    @classmethod
    def of(cls, qp: QP) -> _Scaling:
        diagonal = np.asarray(qp.H.diagonal(), dtype=float)
        top = diagonal.max(initial=0.0)
        if top > 0:
            variable = 1 / np.sqrt(np.maximum(diagonal, _SMALLEST_DIAGONAL * top))
        else:
            variable = np.ones(qp.g.size)
        weighted = qp.A.multiply(variable).tocsr()
        row = np.sqrt(np.asarray(weighted.multiply(weighted).sum(axis=1)).ravel())
        row = 1 / np.where(row > 0, row, 1.0)
        return cls(variable, row, _largest(variable * qp.g) or 1.0)

    def apply(self, qp: QP) -> QP:
        unit = self.length * self.variable
        H, A = sp.csc_matrix(qp.H, copy=True), sp.csr_matrix(qp.A, copy=True)
        H.data *= self.variable[H.indices] * np.repeat(self.variable, np.diff(H.indptr))
        A.data *= np.repeat(self.row, np.diff(A.indptr)) * self.variable[A.indices]
        for matrix in (H, A):
            matrix.sort_indices()
        lo, hi = self.row * qp.lo / self.length, self.row * qp.hi / self.length
        return QP(H, unit * qp.g / self.length**2, A, lo, hi, qp.lb / unit, qp.ub / unit, qp.border)

    def into(
        self, x: np.ndarray, y: np.ndarray, z: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Variables and multipliers of the scaled QP."""
        return (
            x / (self.length * self.variable),
            y / (self.length * self.row),
            z * self.variable / self.length,
        )

    def back(
        self, x: np.ndarray, y: np.ndarray, z: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Variables and multipliers of the original QP."""
        return (
            self.length * self.variable * x,
            self.length * self.row * y,
            self.length * z / self.variable,
        )
