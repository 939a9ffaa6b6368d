"""The convex quadratic model of one SQP step, in scaled variables, and its minimiser within the
trust radius."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from .constraints import LinearConstraints
from .dual import elastic_qp, solve_by_dual
from .problem import Derivatives, Inequalities, LiftedTerm
from .qp import QP, QPResult, QPSolver
from .qp_backends import factorise_positive

_FLOOR = 1e-8  # smallest eigenvalue left in a convexified block, relative to its largest
_RADIUS_LOW, _RADIUS_HIGH = 0.75, 1.05  # a step this close to the trust radius is taken
_MAX_DAMPINGS = 12


@dataclass(frozen=True)
class Region:
    """Where steps may go: the problem's bounds and constraints, and the scale of its variables."""

    lower: np.ndarray
    upper: np.ndarray
    constraints: LinearConstraints
    scale: np.ndarray

    @property
    def n(self) -> int:
        return self.lower.size


@dataclass(frozen=True)
class QuadraticModel:
    """f(x + s u) ~ f + g.u + 1/2 [u; w]^T H [u; w], minimised over the extra unknowns w; u = step /
    scale.

    H : (n + k, n + k) positive definite;  qp : the subproblem in (u, w);  convexified : H differs
        from the given one
    bounds : nonlinear bounds linearised in u, or None;  penalty : weight of their excess, see
        `penalty_of`
    """

    region: Region
    qp: QP
    convexified: bool
    bounds: Inequalities | None = None
    penalty: float = 0.0

    def predicted(self, solution: np.ndarray) -> float:
        """The reduction that the model promises for a solution (n + k,) of the subproblem."""
        reduction = -float(self.qp.g @ solution + 0.5 * solution @ (self.qp.H @ solution))
        if self.bounds is None:
            return reduction
        u = solution[: self.region.n]
        return reduction + self.penalty * (
            penalty_of(self.excess(np.zeros_like(u))) - penalty_of(self.excess(u))
        )

    def excess(self, u: np.ndarray) -> np.ndarray:
        """(k,) by how much the linearised bounds are exceeded after a step u (n,)."""
        assert self.bounds is not None
        out = np.zeros(self.bounds.bound.max(initial=-1) + 1)
        np.maximum.at(out, self.bounds.bound, self.bounds.value + self.bounds.jacobian @ u)
        return out


@dataclass(frozen=True)
class ModelStep:
    """A step of the model: u (n,) in scaled variables, its damping, prediction and the QP's result.

    pressure : (k,) multipliers of the nonlinear bounds, empty where none is met with
    """

    u: np.ndarray
    length: float
    damping: float
    predicted: float
    result: QPResult
    wall_s: float
    pressure: np.ndarray = field(default_factory=lambda: np.zeros(0))


def penalty_of(excess: np.ndarray) -> float:
    """What an excess (k,) of the nonlinear bounds counts, before its weight: sum e + e^2 / 2.

    The linear part makes the penalty exact (Fletcher 1987, section 14.3: a weight above the
    multipliers makes solutions meet the bounds); the quadratic one keeps the elastic subproblem
    strictly convex in its slacks.
    """
    return float(np.sum(excess + 0.5 * excess**2))


def build_model(
    x: np.ndarray,
    derivatives: Derivatives,
    hessian: sp.csc_matrix,
    region: Region,
    penalty: float = 0.0,
) -> QuadraticModel:
    """The model at x. An indefinite Hessian is made positive definite block by block, a definite
    one left alone."""
    scale = sp.diags(region.scale)
    scaled = sp.csc_matrix(scale @ hessian @ scale)
    scaled = sp.csc_matrix(0.5 * (scaled + scaled.T))
    extra = derivatives.extra
    whole = lift(scaled, extra, region.scale)
    k = whole.shape[0] - region.n
    convexified = factorise_positive(whole, k) is None
    if convexified:
        whole = lift(convexify(scaled), extra, region.scale)
    gradient = np.concatenate([region.scale * derivatives.gradient, np.zeros(k)])
    bounds = derivatives.inequalities
    if bounds is not None:
        bounds = (
            replace(bounds, jacobian=sp.csr_matrix(bounds.jacobian @ scale))
            if bounds.rows
            else None
        )
    return QuadraticModel(
        region, _subproblem(x, whole, gradient, region), convexified, bounds, penalty
    )


def _subproblem(x: np.ndarray, H: sp.csc_matrix, g: np.ndarray, region: Region) -> QP:
    """The QP of steps from x; unknowns past the first n are free."""
    k = g.size - region.n
    free = np.full(k, np.inf)
    lb, ub = (
        np.minimum(region.lower - x, 0.0) / region.scale,
        np.maximum(region.upper - x, 0.0) / region.scale,
    )
    rows = region.constraints
    value = rows.A @ x
    A = sp.csr_matrix(sp.hstack([rows.A @ sp.diags(region.scale), sp.csr_matrix((rows.rows, k))]))
    return QP(
        H,
        g,
        A,
        rows.lower - value,
        rows.upper - value,
        np.append(lb, -free),
        np.append(ub, free),
        k,
    )


def lift(hessian: sp.csc_matrix, extra: LiftedTerm | None, scale: np.ndarray) -> sp.csc_matrix:
    """The Hessian (n, n) of scaled variables with a lifted term (in unscaled ones) added: (n + k, n
    + k)."""
    if extra is None:
        return hessian
    by = sp.diags(scale)
    coupling = by @ extra.qp
    matrix = sp.bmat(
        [[hessian + by @ extra.qq @ by, coupling], [coupling.T, extra.pp]], format="csc"
    )
    matrix.sort_indices()
    return matrix


def convexify(hessian: sp.csc_matrix) -> sp.csc_matrix:
    """Replace the eigenvalues of each indefinite diagonal block by their absolute values, with a
    floor.

    Blocks are the connected components of the pattern. The absolute value keeps the curvature's
    size, so that steps along negative curvature are neither huge nor lost (Dauphin et al. 2014).
    """
    count, label = connected_components(hessian, directed=False)
    order = np.argsort(label, kind="stable")
    result, kept = hessian.tocoo(), np.ones(count, dtype=bool)
    rows, columns, values = [], [], []
    for k, members in enumerate(
        np.split(order, np.cumsum(np.bincount(label, minlength=count))[:-1])
    ):
        fixed = _positive(hessian[members][:, members].toarray())
        if fixed is not None:
            kept[k] = False
            rows.append(np.repeat(members, members.size))
            columns.append(np.tile(members, members.size))
            values.append(fixed.ravel())
    old = kept[label[result.row]]
    places = np.concatenate([result.row[old], *rows]), np.concatenate([result.col[old], *columns])
    return sp.csc_matrix((np.concatenate([result.data[old], *values]), places), shape=hessian.shape)


def _positive(block: np.ndarray) -> np.ndarray | None:
    """A block with the absolute values of its eigenvalues, or None where it is positive definite
    already."""
    eigenvalues, vectors = np.linalg.eigh(block)
    floor = _FLOOR * (np.abs(eigenvalues).max() or 1.0)
    if eigenvalues.min() >= floor:
        return None
    fixed = (vectors * np.maximum(np.abs(eigenvalues), floor)) @ vectors.T
    return 0.5 * (fixed + fixed.T)


def minimise_model(
    model: QuadraticModel, radius: float, solver: QPSolver, start: tuple[np.ndarray, np.ndarray]
) -> ModelStep | None:
    """The step of about the least damping whose length is within the trust radius; None if no QP
    could be solved.

    The damping mu solves 1/|u(mu)| = 1/radius, nearly linear in mu (More & Sorensen 1983), by
    safeguarded secants. The model's decrease bounds |u(mu)| by |g| / mu, so that mu = |g| / radius
    is always enough.

    start : multipliers (y, z) for the QP's warm start
    """
    began = time.perf_counter()
    first = _damped(model, 0.0, solver, start)
    if first is not None and first.length <= _RADIUS_HIGH * radius:
        return replace(first, wall_s=time.perf_counter() - began)
    most = float(np.linalg.norm(model.qp.g[: model.region.n])) / radius
    if model.bounds is not None:
        most += _steepest_penalty(model) / radius
    least, damping = 0.0, 0.1 * most
    previous = None if first is None else (0.0, 1 / first.length)
    best = None
    for _ in range(_MAX_DAMPINGS):
        step = _damped(model, damping, solver, start)
        if step is None:
            break
        if step.length <= _RADIUS_HIGH * radius:
            best, most = step, damping
            if step.length >= _RADIUS_LOW * radius:
                break
        else:
            least = damping
        known = (damping, 1 / max(step.length, np.finfo(float).tiny))
        damping = _next_damping(previous, known, radius, least, most)
        previous = known
    best = best or _damped(model, most, solver, start)
    return None if best is None else replace(best, wall_s=time.perf_counter() - began)


def _next_damping(
    previous: tuple[float, float] | None,
    known: tuple[float, float],
    radius: float,
    least: float,
    most: float,
) -> float:
    """The secant for 1/|u| = 1/(0.9 radius), kept inside the bracket."""
    guess = np.nan
    if previous is not None and known[1] != previous[1]:
        slope = (known[1] - previous[1]) / (known[0] - previous[0])
        guess = known[0] + (1 / (0.9 * radius) - known[1]) / slope
    low, high = least + 1e-3 * (most - least), most - 1e-3 * (most - least)
    return float(guess) if low <= guess <= high else float(np.sqrt(max(least, 1e-3 * most) * most))


def _steepest_penalty(model: QuadraticModel) -> float:
    """A bound on the slope of the penalty."""
    assert model.bounds is not None
    rows = np.sqrt(
        np.asarray(model.bounds.jacobian.multiply(model.bounds.jacobian).sum(axis=1)).ravel()
    )
    steepest = np.zeros(model.bounds.bound.max(initial=-1) + 1)
    np.maximum.at(steepest, model.bounds.bound, rows)
    return model.penalty * float(steepest @ (1 + model.excess(np.zeros(model.region.n))))


def _damped(
    model: QuadraticModel, damping: float, solver: QPSolver, start: Any
) -> ModelStep | None:
    n, qp = model.region.n, model.qp
    if damping > 0:
        weights = np.zeros(qp.g.size)
        weights[:n] = damping
        qp = replace(qp, H=sp.csc_matrix(qp.H + sp.diags(weights)))
    y, z = start
    whole = np.zeros(qp.g.size), y, np.append(z, np.zeros(qp.g.size - n))
    pressure = np.zeros(0)
    if model.bounds is None:
        result = solver.solve(qp, whole)
    elif found := solve_by_dual(qp, model.bounds, model.penalty, solver):
        result, pressure = found
    else:
        result, pressure = _solved_elastic(model, qp, solver, whole)
    if result.status != "solved":
        return None
    u = result.x[:n]
    return ModelStep(
        u,
        float(np.linalg.norm(u)),
        damping,
        model.predicted(result.x[: qp.g.size]),
        result,
        result.wall_s,
        pressure,
    )


def _solved_elastic(
    model: QuadraticModel, qp: QP, solver: QPSolver, start: Any
) -> tuple[QPResult, np.ndarray]:
    """The whole subproblem's solution without its slacks, and the bounds' multipliers (k,), empty
    where none is met with."""
    rows = model.bounds
    assert rows is not None
    result = solver.solve(qp, start)
    if result.status != "solved" or model.excess(result.x[: model.region.n]).max(initial=0) <= 0:
        return result, np.zeros(0)
    elastic = elastic_qp(qp, rows, model.penalty)
    t = model.excess(result.x[: model.region.n])[np.unique(rows.bound)]
    m, free = rows.rows, elastic.g.size - qp.g.size
    wall_s, (_, y, z) = result.wall_s, start
    result = solver.solve(
        elastic,
        (np.append(result.x, t), np.append(y, np.zeros(m)), np.append(z, np.zeros(free))),
        interior_point=True,
    )
    if result.status != "solved":
        return result, np.zeros(0)
    pressure = np.zeros(rows.bound.max() + 1)
    np.add.at(pressure, rows.bound, result.y[qp.lo.size :])
    return replace(
        result,
        x=result.x[: qp.g.size],
        y=result.y[: qp.lo.size],
        z=result.z[: qp.g.size],
        wall_s=result.wall_s + wall_s,
    ), pressure


def projected_gradient(
    x: np.ndarray, gradient: np.ndarray, region: Region, solver: QPSolver
) -> float:
    """|P(u - g) - u| in scaled variables, P the projection onto bounds and constraints; zero at a
    stationary point.

    NaN when the projection, a QP of its own with linear constraints, can't be computed.
    """
    scaled = region.scale * gradient
    if not region.constraints.rows:
        lb, ub = (region.lower - x) / region.scale, (region.upper - x) / region.scale
        return float(np.linalg.norm(np.clip(-scaled, np.minimum(lb, 0.0), np.maximum(ub, 0.0))))
    result = solver.solve(_subproblem(x, sp.identity(region.n, format="csc"), scaled, region))
    return float(np.linalg.norm(result.x)) if result.status == "solved" else np.nan


def nearest_feasible(x: np.ndarray, region: Region, solver: QPSolver) -> np.ndarray | None:
    """The point within bounds and constraints that is nearest to x in scaled variables; None when
    the QP fails."""
    if not region.constraints.rows:
        return np.clip(x, region.lower, region.upper)
    inside = np.clip(x, region.lower, region.upper)
    result = solver.solve(
        _subproblem(
            inside, sp.identity(region.n, format="csc"), (inside - x) / region.scale, region
        )
    )
    if result.status != "solved":
        return None
    return np.clip(inside + region.scale * result.x, region.lower, region.upper)
