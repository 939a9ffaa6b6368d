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
    qp: QP, elastic: Inequalities, penalty: float, solver: QPSolver
) -> tuple[QPResult, np.ndarray] | None:
    """The solution, and the bounds' multipliers (k,) (empty where no elastic row pushes); None
    where H isn't positive definite, too many limits come into play, or the solution isn't good
    enough.

    qp : without the elastic rows
    elastic : their values at x = 0 and Jacobian, in the first of the unknowns
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
        if len(search.taken) > _MOST * qp.g.size or not search.solve(solver):
            return None
    else:
        return None
    x, y, z, pushing = search.solution()
    t, y_t = search.slacks(pushing)
    residuals = solver.residuals(
        elastic_qp(qp, elastic, penalty), np.append(x, t), np.append(y, pushing), np.append(z, y_t)
    )
    if not residuals.worst <= solver.options.accept:
        return None
    pressure = np.bincount(elastic.bound, pushing) if search.met_elastic else np.zeros(0)
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
    """Takes in limits, and solves the dual problem in their multipliers.

    All limits are rows G x + d <= 0: elastic ones, those of `hi` and `lo`, of `ub` and `lb`.

    taken : numbers of those that were taken in
    """

    def __init__(
        self,
        qp: QP,
        elastic: Inequalities,
        penalty: float,
        inverse: Callable[[np.ndarray], np.ndarray],
    ):
        self.qp, self.elastic, self.penalty, self._inverse = qp, elastic, penalty, inverse
        n = qp.g.size
        rows = elastic.jacobian
        wide = sp.hstack([rows, sp.csr_matrix((elastic.rows, n - rows.shape[1]))])
        one = sp.identity(n)
        self._G = sp.csr_matrix(sp.vstack([wide, qp.A, -qp.A, one, -one]))
        self._d = np.concatenate([elastic.value, -qp.hi, qp.lo, -qp.ub, qp.lb])
        self._n_rows = len(self._d) - 2 * n
        self.free = inverse(-qp.g)
        self.x = self.free
        self.taken = np.zeros(0, int)
        self.W, self.columns = np.zeros((0, n)), np.zeros((n, 0))
        self.multipliers = np.zeros(0)
        self.iterations = 0

    @property
    def met_elastic(self) -> bool:
        """Whether an elastic row was taken in."""
        return bool((self.taken < self.elastic.rows).any())

    def take_in(self) -> bool:
        """Take in the limits that x exceeds; whether there were any."""
        size = np.abs(self.x)
        sizes = abs(self._G) @ size
        sizes[self._n_rows :] = size.max(initial=0.0)
        exceeded = self._G @ self.x + self._d > _MET * sizes
        exceeded[self.taken] = False
        more = np.flatnonzero(exceeded)
        W = self._G[more].toarray()
        self.taken, self.W = np.append(self.taken, more), np.vstack([self.W, W])
        self.columns = np.hstack([self.columns, self._inverse(W.T)])
        return len(more) > 0

    def solve(self, solver: QPSolver) -> bool:
        """Find the multipliers and x; whether that could be done."""
        m = len(self.taken)
        soft = np.flatnonzero(self.taken < self.elastic.rows)
        bounds, number = np.unique(self.elastic.bound[self.taken[soft]], return_inverse=True)
        b = len(bounds)
        sums = sp.csr_matrix((np.ones(len(soft)), (number, soft)), shape=(b, m))
        dual = solver.solve(
            QP(
                sp.csc_matrix(sp.block_diag([self.W @ self.columns, np.eye(b) / self.penalty])),
                np.append(-(self.W @ self.free) - self._d[self.taken], np.zeros(b)),
                sp.csr_matrix(sp.hstack([sums, -sp.identity(b)])),
                np.full(b, -np.inf),
                np.full(b, self.penalty),
                np.zeros(m + b),
                np.full(m + b, np.inf),
            ),
            interior_point=True,  # many rows of few parameters: OSQP takes longer, or stalls
        )
        if dual.status != "solved":
            return False
        self.iterations += dual.iterations
        self.multipliers = dual.x[:m]
        self.x = self.free - self.columns @ self.multipliers
        return True

    def solution(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """x, and the multipliers of the rows, of the bounds, and of the elastic rows."""
        n, m = self.qp.g.size, self.qp.lo.size
        whole = np.zeros(len(self._d))
        whole[self.taken] = self.multipliers
        pushing, above, below, upper, lower = np.split(
            whole, np.cumsum([self.elastic.rows, m, m, n])
        )
        # what rounding leaves beyond a limit
        return np.clip(self.x, self.qp.lb, self.qp.ub), above - below, upper - lower, pushing

    def slacks(self, pushing: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The slacks (b,), and the multipliers of their bound.

        pushing : multipliers of the elastic rows
        """
        bounds, number = np.unique(self.elastic.bound, return_inverse=True)
        t, pushed = np.zeros(len(bounds)), np.zeros(len(bounds))
        rows = self.elastic.rows
        np.maximum.at(t, number, self._G[:rows] @ self.x + self._d[:rows])
        np.add.at(pushed, number, pushing)
        return t, np.minimum(pushed - self.penalty * (1 + t), 0.0)
