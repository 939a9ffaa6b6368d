"""Convex QPs by their dual, in the multipliers of the few limits that come into play: for
subproblems whose unknowns are the parameters of all designs, in dense blocks, which other methods
factorise again and again.

    min 1/2 x^T H x + g^T x + penalty sum_b (t_b + t_b^2 / 2)
    with   J x + c <= t (elastic rows, t >= 0 of each bound b),   lo <= A x <= hi,   lb <= x <= ub

With H^-1 at hand, multipliers y >= 0 of rows W x + d <= 0 minimise

    1/2 y^T W H^-1 W^T y + (W H^-1 g - d)^T y + sum_b s_b^2 / (2 penalty),   x = -H^-1 (g + W^T y)

with s_b >= 0 by how much a bound's multipliers are above the penalty together (Nocedal, Wright,
Numerical Optimization, 2006, section 16.8). Limits that x exceeds are taken in until it exceeds
none: then x solves the whole problem, whatever the other limits are.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import scipy.sparse as sp

from .problem import Inequalities
from .qp import QP, QPResult, QPSolver
from .qp_backends import factorise_positive

_ROUNDS = 40
_MET = 1e-9  # of a row's terms, or the largest unknown: what rounding leaves of a limit
_MOST = 0.5  # of the unknowns: with more limits the whole problem is as quick


def solve_by_dual(
    qp: QP, elastic: Inequalities | None, penalty: float, solver: QPSolver
) -> tuple[QPResult, np.ndarray] | None:
    """The solution, and the bounds' multipliers (k,) (empty where no elastic row pushes); None
    where H isn't positive definite, too many limits come into play, or the solution isn't good
    enough.

    qp : without the elastic rows
    elastic : their values at x = 0 and Jacobian, in the first of the unknowns; or None
    penalty : of their excess
    solver : of the dual problems, and judge of the solution
    """
    began = time.perf_counter()
    inverse = factorise_positive(qp.H, qp.border)
    if inverse is None:
        return None
    search = _Search(qp, elastic, penalty, inverse)
    for _ in range(_ROUNDS):
        if not search.take_in():
            break
        if len(search.d) > _MOST * qp.g.size or not search.solve(solver):
            return None
    else:
        return None
    x, y, z, pressure = search.solution()
    whole = elastic_qp(qp, elastic, penalty) if elastic is not None else qp
    t, y_elastic, z_slacks = search.slacks()
    residuals = solver.residuals(
        whole, np.append(x, t), np.append(y, y_elastic), np.append(z, z_slacks)
    )
    if not residuals.worst <= solver.options.accept:
        return None
    wall_s = time.perf_counter() - began
    return QPResult(x, y, z, "solved", residuals, "dual", search.iterations, wall_s), pressure


def elastic_qp(qp: QP, elastic: Inequalities, penalty: float) -> QP:
    """The whole problem, the slacks t of the bounds that have rows behind its unknowns.

    They come at the price penalty (t + t^2 / 2), so that a step exists wherever it starts from.
    """
    bounds, slack = np.unique(elastic.bound, return_inverse=True)
    m, b, size = elastic.rows, len(bounds), qp.g.size
    weight = np.full(b, penalty)
    slacks = sp.csr_matrix((-np.ones(m), (np.arange(m), slack)), shape=(m, b))
    wide = sp.csr_matrix((m, size - elastic.jacobian.shape[1]))
    A = sp.bmat(
        [
            [qp.A, sp.csr_matrix((qp.lo.size, b))],
            [sp.hstack([elastic.jacobian, wide]), slacks],
        ],
        format="csr",
    )
    return QP(
        sp.csc_matrix(sp.block_diag([qp.H, sp.diags(weight)])),
        np.append(qp.g, weight),
        A,
        np.append(qp.lo, np.full(m, -np.inf)),
        np.append(qp.hi, -elastic.value),
        np.append(qp.lb, np.zeros(b)),
        np.append(qp.ub, np.full(b, np.inf)),
        qp.border + b,
    )


class _Search:
    """Takes in limits, and solves the dual problem in their multipliers."""

    def __init__(
        self,
        qp: QP,
        elastic: Inequalities | None,
        penalty: float,
        inverse: Callable[[np.ndarray], np.ndarray],
    ):
        self.qp, self.elastic, self.penalty, self._inverse = qp, elastic, penalty, inverse
        self.free = inverse(-qp.g)
        self.x = self.free
        n = qp.g.size
        self.W, self.columns, self.d = np.zeros((0, n)), np.zeros((n, 0)), np.zeros(0)
        self.multipliers = np.zeros(0)
        self.iterations = 0
        # taken in so far: elastic rows, rows above hi and below lo, bounds above ub and below lb
        m = qp.lo.size
        sizes = (0 if elastic is None else elastic.rows, m, m, n, n)
        self._in = [np.zeros(size, bool) for size in sizes]
        self._of: list[tuple[int, int]] = []

    def take_in(self) -> bool:
        """Take in the limits that x exceeds; whether there were any."""
        found = [(kind, places) for kind, places in enumerate(self._exceeded()) if len(places)]
        for kind, places in found:
            self._in[kind][places] = True
            self._of += [(kind, int(place)) for place in places]
            W, d = self._rows(kind, places)
            self.W, self.d = np.vstack([self.W, W]), np.append(self.d, d)
            self.columns = np.hstack([self.columns, self._inverse(W.T)])
        return bool(found)

    def solve(self, solver: QPSolver) -> bool:
        """Find the multipliers and x; whether that could be done."""
        m, kinds = len(self.d), np.array([kind for kind, _ in self._of])
        soft = np.flatnonzero(kinds == 0)
        bounds, number = np.unique(self._bounds_of(soft), return_inverse=True)
        b = len(bounds)
        curvature = sp.block_diag(
            [self.W @ self.columns, np.eye(b) / self.penalty] if b else [self.W @ self.columns],
            format="csc",
        )
        sums = sp.csr_matrix((np.ones(len(soft)), (number, soft)), shape=(b, m))
        start = np.zeros(m + b), np.zeros(b), np.zeros(m + b)
        dual = solver.solve(
            QP(
                sp.csc_matrix(curvature),
                np.append(-(self.W @ self.free) - self.d, np.zeros(b)),
                sp.csr_matrix(sp.hstack([sums, -sp.identity(b)])) if b else sp.csr_matrix((0, m)),
                np.full(b, -np.inf),
                np.full(b, self.penalty),
                np.zeros(m + b),
                np.full(m + b, np.inf),
            ),
            start,
            interior_point=True,  # many rows of few parameters: OSQP takes longer, or stalls
        )
        if dual.status != "solved":
            return False
        self.iterations += dual.iterations
        self.multipliers = dual.x[:m]
        self.x = self.free - self.columns @ self.multipliers
        return True

    def solution(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """x, the multipliers y of the rows and z of the bounds, and the pressure of the elastic
        bounds."""
        y, z = np.zeros(self.qp.lo.size), np.zeros(self.qp.g.size)
        for (kind, place), value in zip(self._of, self.multipliers):
            if kind in (1, 2):
                y[place] += value if kind == 1 else -value
            elif kind in (3, 4):
                z[place] += value if kind == 3 else -value
        pressure = np.zeros(0)
        if self.elastic is not None and self._in[0].any():
            pressure = np.zeros(self.elastic.bound.max() + 1)
            np.add.at(pressure, self.elastic.bound, self._of_elastic())
        # what rounding leaves beyond a limit
        return np.clip(self.x, self.qp.lb, self.qp.ub), y, z, pressure

    def slacks(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The slacks (b,), the elastic rows' multipliers, and those of the slacks' bound."""
        if self.elastic is None:
            return np.zeros(0), np.zeros(0), np.zeros(0)
        bounds, number = np.unique(self.elastic.bound, return_inverse=True)
        t, pushed, own = np.zeros(len(bounds)), np.zeros(len(bounds)), self._of_elastic()
        np.maximum.at(t, number, self.elastic.value + self.elastic.jacobian @ self._inner(self.x))
        np.add.at(pushed, number, own)
        return t, own, np.minimum(pushed - self.penalty * (1 + t), 0.0)

    def _exceeded(self) -> list[np.ndarray]:
        """By kind of limit, the places of those that x exceeds and that aren't taken in."""
        qp, x = self.qp, self.x
        row, size = qp.A @ x, np.abs(x)
        over = [row - qp.hi, qp.lo - row, x - qp.ub, qp.lb - x]
        terms = abs(qp.A) @ size
        largest = np.full(x.size, size.max(initial=0.0))
        sizes = [terms, terms, largest, largest]
        if self.elastic is not None:
            over.insert(0, self._elastic_rows())
            sizes.insert(0, abs(self.elastic.jacobian) @ self._inner(size))
        else:
            over.insert(0, np.zeros(0))
            sizes.insert(0, np.zeros(0))
        return [
            np.flatnonzero((value > _MET * size) & ~taken)
            for value, size, taken in zip(over, sizes, self._in)
        ]

    def _elastic_rows(self) -> np.ndarray:
        assert self.elastic is not None
        return np.asarray(self.elastic.value + self.elastic.jacobian @ self._inner(self.x))

    def _inner(self, x: np.ndarray) -> np.ndarray:
        """The unknowns that elastic rows know."""
        assert self.elastic is not None
        return x[: self.elastic.jacobian.shape[1]]

    def _rows(self, kind: int, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """W (m, n) and d (m,) of some limits of a kind."""
        qp, W = self.qp, np.zeros((len(places), self.qp.g.size))
        if kind == 0:
            assert self.elastic is not None
            own = self.elastic.jacobian[places].toarray()
            W[:, : own.shape[1]] = own
            return W, self.elastic.value[places]
        sign = 1.0 if kind in (1, 3) else -1.0
        if kind in (1, 2):
            W[:] = sign * qp.A[places].toarray()
            return W, -sign * (qp.hi if kind == 1 else qp.lo)[places]
        W[np.arange(len(places)), places] = sign
        return W, -sign * (qp.ub if kind == 3 else qp.lb)[places]

    def _bounds_of(self, soft: np.ndarray) -> np.ndarray:
        """The bounds that elastic rows, numbered among those taken in, belong to."""
        if self.elastic is None:
            return np.zeros(0, int)
        return self.elastic.bound[[self._of[k][1] for k in soft]]

    def _of_elastic(self) -> np.ndarray:
        """(m,) multipliers of all elastic rows."""
        assert self.elastic is not None
        found = np.zeros(self.elastic.rows)
        for (kind, place), value in zip(self._of, self.multipliers):
            if kind == 0:
                found[place] = value
        return found
