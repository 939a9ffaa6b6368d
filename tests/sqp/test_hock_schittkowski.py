"""Published problems with bounds and linear constraints: Hock & Schittkowski, Test Examples for
Nonlinear Programming Codes (1981), by their numbers there, with the optima printed there (HS24 and
HS36 also follow by hand)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.optimize import Bounds, LinearConstraint, minimize

from kop_exudyn.sqp.constraints import LinearConstraints
from kop_exudyn.sqp.options import SQPOptions
from kop_exudyn.sqp.problem import Derivatives, Point
from kop_exudyn.sqp.solver import minimise

INF = np.inf
ROOT3 = np.sqrt(3.0)


@dataclass
class Function:
    """A problem with derivatives by hand."""

    start: list
    best: list | None  # None: the value alone, where the minimiser is not unique
    value: float
    f: Callable
    gradient: Callable
    hessian: Callable
    lower: list | float = -INF
    upper: list | float = INF
    A: list | None = None
    lo: list | float = -INF
    hi: list | float = INF

    def __post_init__(self):
        self.n = len(self.start)
        self.lower, self.upper = (
            np.broadcast_to(np.array(v, float), self.n) for v in (self.lower, self.upper)
        )
        rows = np.zeros((0, self.n)) if self.A is None else np.array(self.A, float)
        lo, hi = (np.broadcast_to(np.array(v, float), len(rows)) for v in (self.lo, self.hi))
        self.constraints = LinearConstraints(sp.csr_matrix(rows), lo, hi)

    def evaluate(self, x, previous):
        return Point(x, float(self.f(x)))

    def derivatives(self, point):
        gradient = np.array(self.gradient(point.x), float)
        return Derivatives(gradient, sp.csc_matrix(np.array(self.hessian(point.x), float)))


def quadratic(start, best, value, H, g, constant=0.0, **limits):
    H, g = np.array(H, float), np.array(g, float)
    f = lambda x: 0.5 * x @ H @ x + g @ x + constant  # noqa: E731
    return Function(start, best, value, f, lambda x: H @ x + g, lambda x: H, **limits)


def squares(start, best, value, J, r, **limits):
    """|J x - r|^2"""
    J, r = np.array(J, float), np.array(r, float)
    return quadratic(start, best, value, 2 * J.T @ J, -2 * J.T @ r, r @ r, **limits)


def rosenbrock(start, best, value, **limits):
    def f(x):
        return 100 * (x[1] - x[0] ** 2) ** 2 + (1 - x[0]) ** 2

    def gradient(x):
        return [-400 * x[0] * (x[1] - x[0] ** 2) - 2 * (1 - x[0]), 200 * (x[1] - x[0] ** 2)]

    def hessian(x):
        return [[1200 * x[0] ** 2 - 400 * x[1] + 2, -400 * x[0]], [-400 * x[0], 200]]

    return Function(start, best, value, f, gradient, hessian, **limits)


def product(start, best, value, **limits):
    """-x1 x2 x3, indefinite"""
    f = lambda x: -x[0] * x[1] * x[2]  # noqa: E731
    gradient = lambda x: [-x[1] * x[2], -x[0] * x[2], -x[0] * x[1]]  # noqa: E731
    hessian = lambda x: [[0, -x[2], -x[1]], [-x[2], 0, -x[0]], [-x[1], -x[0], 0]]  # noqa: E731
    return Function(start, best, value, f, gradient, hessian, **limits)


def hs24():
    c = 1 / (27 * ROOT3)
    f = lambda x: c * ((x[0] - 3) ** 2 - 9) * x[1] ** 3  # noqa: E731
    gradient = lambda x: [2 * c * (x[0] - 3) * x[1] ** 3, 3 * c * ((x[0] - 3) ** 2 - 9) * x[1] ** 2]  # noqa: E731

    def hessian(x):
        mixed = 6 * c * (x[0] - 3) * x[1] ** 2
        return [[2 * c * x[1] ** 3, mixed], [mixed, 6 * c * ((x[0] - 3) ** 2 - 9) * x[1]]]

    rows = [[1 / ROOT3, -1], [1, ROOT3], [-1, -ROOT3]]
    return Function([1, 0.5], [3, ROOT3], -1, f, gradient, hessian, lower=0, A=rows, lo=[0, 0, -6])


def hs44():
    J = np.zeros((4, 4))
    J[0, 2], J[0, 3], J[1, 2], J[1, 3] = -1, 1, 1, -1
    rows = [[1, 2, 0, 0], [4, 1, 0, 0], [3, 4, 0, 0], [0, 0, 2, 1], [0, 0, 1, 2], [0, 0, 1, 1]]
    return quadratic(
        [0] * 4,
        [0, 3, 0, 4],
        -15,
        J + J.T,
        [1, -1, -1, 0],
        lower=0,
        A=rows,
        hi=[8, 12, 12, 8, 8, 5],
    )


def hs76():
    H = np.diag([2.0, 1, 2, 1])
    H[0, 2] = H[2, 0] = -1
    H[2, 3] = H[3, 2] = 1
    rows = [[1, 2, 1, 1], [3, 1, 2, -1], [0, -1, -4, 0]]
    best = [0.2727273, 2.090909, 0, 0.5454545]
    return quadratic(
        [0.5] * 4, best, -4.681818181, H, [-1, -3, 1, -1], lower=0, A=rows, hi=[5, 4, -1.5]
    )


def hs35():
    H = [[4, 2, 2], [2, 4, 0], [2, 0, 2]]
    rows = [[1, 1, 2]]
    return quadratic(
        [0.5] * 3, [4 / 3, 7 / 9, 4 / 9], 1 / 9, H, [-8, -6, -4], 9, lower=0, A=rows, hi=3
    )


def hs28():
    return squares(
        [-4, 1, 1], [0.5, -0.5, 0.5], 0, [[1, 1, 0], [0, 1, 1]], [0, 0], A=[[1, 2, 3]], lo=1, hi=1
    )


def hs48():
    J = [[1, 0, 0, 0, 0], [0, 1, -1, 0, 0], [0, 0, 0, 1, -1]]
    rows = [[1, 1, 1, 1, 1], [0, 0, 1, -2, -2]]
    return squares([3, 5, -3, 2, -2], [1] * 5, 0, J, [1, 0, 0], A=rows, lo=[5, -3], hi=[5, -3])


def hs21():
    H, rows = np.diag([0.02, 2]), [[10, -1]]
    return quadratic(
        [2, -1], [2, 0], -99.96, H, [0, 0], -100, lower=[2, -50], upper=50, A=rows, lo=10
    )


BANK = {
    "rosenbrock": lambda: rosenbrock([-1.2, 1], [1, 1], 0),
    "HS1": lambda: rosenbrock([-2, 1], [1, 1], 0, lower=[-INF, -1.5]),
    "HS2": lambda: rosenbrock([2, 3], [1.2243707487, 1.5], 0.0504261879, lower=[-INF, 1.5]),
    "HS3": lambda: quadratic(
        [10, 1], [0, 0], 0, [[2e-5, -2e-5], [-2e-5, 2e-5]], [0, 1], lower=[-INF, 0]
    ),
    "rosenbrock, cut": lambda: rosenbrock([-1.2, 1], [0.5, 0.25], 0.25, upper=[0.5, 2]),
    "HS21": hs21,
    "HS24": hs24,
    "HS28": hs28,
    "HS35": hs35,
    "HS36": lambda: product(
        [10, 10, 10], [20, 11, 15], -3300, lower=0, upper=[20, 11, 42], A=[[1, 2, 2]], hi=72
    ),
    "HS37": lambda: product(
        [10, 10, 10], [24, 12, 12], -3456, lower=0, upper=42, A=[[1, 2, 2]], lo=0, hi=72
    ),
    "HS44": hs44,
    "HS48": hs48,
    "HS76": hs76,
    "all bounds active": lambda: quadratic(
        [0] * 4, [1, -1, 1, -1], -14, np.eye(4), [-4, 4, -4, 4], lower=-1, upper=1
    ),
    "one point": lambda: quadratic(
        [0, 0], [0.5, 0.25], -0.59375, np.eye(2), [-1, -1], lower=[0.5, 0.25], upper=[0.5, 0.25]
    ),
    "degenerate vertex": lambda: squares(
        [0, 0],
        [1, 1],
        2,
        np.eye(2),
        [2, 2],
        upper=1,
        A=[[1, 1], [2, 1], [1, 2], [1, 1]],
        hi=[2, 3, 3, 2],
    ),
    "flat valley": lambda: squares([3, 0], None, 0, [[1, 1]], [1], lower=-5, upper=5),
}
TIGHT = dict(gradient_tolerance=1e-9, decrease_tolerance=1e-14)


@pytest.mark.parametrize("hessian", ["exact", "bfgs"])
@pytest.mark.parametrize("name", BANK)
def test_published_optimum_is_found(name, hessian):
    problem = BANK[name]()
    result = minimise(problem, problem.start, SQPOptions(hessian=hessian, max_steps=300, **TIGHT))
    assert result.converged, result.status
    assert result.point.value == pytest.approx(problem.value, rel=1e-8, abs=1e-8)
    if problem.best is not None and name != "HS3":  # HS3 is flat along x1: its value alone is sharp
        assert np.allclose(result.x, problem.best, atol=2e-5)
    assert np.all((problem.lower <= result.x) & (result.x <= problem.upper))
    assert problem.constraints.violation(result.x) < 1e-7


@pytest.mark.parametrize("name", BANK)
def test_derivatives_by_hand_are_right(name):
    problem = BANK[name]()
    x, h = np.array(problem.start, float) + 0.1, 1e-5
    for step in h * np.eye(problem.n):
        slope = (problem.f(x + step) - problem.f(x - step)) / (2 * h)
        change = (np.array(problem.gradient(x + step)) - np.array(problem.gradient(x - step))) / (
            2 * h
        )
        assert slope == pytest.approx(np.array(problem.gradient(x)) @ step / h, rel=1e-6, abs=1e-6)
        assert np.allclose(change, np.array(problem.hessian(x)) @ step / h, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("seed", range(6))
def test_agrees_with_scipy_on_random_constrained_rosenbrock(seed):
    """Chained Rosenbrock functions with random rows, from the same start near the solution that
    scipy finds."""
    rng = np.random.default_rng(seed)
    n = 6
    rows = rng.standard_normal((2, n))

    def f(x):
        return float(np.sum(10 * (x[1:] - x[:-1] ** 2) ** 2 + (1 - x[:-1]) ** 2))

    def gradient(x):
        g, r = np.zeros(n), x[1:] - x[:-1] ** 2
        g[1:] += 20 * r
        g[:-1] += -40 * x[:-1] * r - 2 * (1 - x[:-1])
        return g

    def hessian(x):
        H, r = np.zeros((n, n)), x[1:] - x[:-1] ** 2
        i = np.arange(n - 1)
        H[i + 1, i + 1] += 20
        H[i, i] += -40 * r + 80 * x[:-1] ** 2 + 2
        H[i, i + 1] = H[i + 1, i] = -40 * x[:-1]
        return H

    hi = rows @ np.full(n, 0.5)
    reference = minimize(
        f,
        np.full(n, 0.3),
        jac=gradient,
        hess=hessian,
        method="trust-constr",
        bounds=Bounds(-2, np.full(n, 0.8)),
        constraints=LinearConstraint(rows, -INF, hi),
        options=dict(gtol=1e-10, xtol=1e-12, maxiter=3000),
    )
    problem = Function(
        list(reference.x + 0.01),
        None,
        0.0,
        f,
        gradient,
        hessian,
        lower=-2,
        upper=0.8,
        A=rows,
        hi=hi,
    )
    result = minimise(problem, problem.start, SQPOptions(**TIGHT))
    assert result.converged
    assert result.point.value <= reference.fun + 1e-7
    assert np.allclose(result.x, reference.x, atol=1e-3)
