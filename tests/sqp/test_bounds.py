"""Nonlinear bounds: kept by an exact penalty, with elastic rows in the subproblems."""

from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp

from kop_exudyn.errors import SimulationFailure
from kop_exudyn.sqp.constraints import LinearConstraints
from kop_exudyn.sqp.history import SQPState
from kop_exudyn.sqp.model import Region, build_model, minimise_model
from kop_exudyn.sqp.options import SQPOptions
from kop_exudyn.sqp.problem import Derivatives, Inequalities, Point
from kop_exudyn.sqp.qp import QPSolver
from kop_exudyn.sqp.solver import minimise


class Disc:
    """min |x - c|^2 within |x| <= 1 and x_0 <= top: two bounds, one of them with two rows."""

    n = 2
    lower, upper = np.full(2, -10.0), np.full(2, 10.0)

    def __init__(self, centre=(2.0, 1.0), top=0.5, broken=None):
        self.centre, self.top, self.broken = np.array(centre), top, broken
        self.constraints = LinearConstraints.none(2)
        self.completions = 0

    def bounds(self, x):
        return [[x @ x - 1, 0.5 * (x @ x - 1) - 0.1], [x[0] - self.top]]

    def evaluate(self, x, previous):
        excess = np.array([max(0.0, *rows) for rows in self.bounds(x)])
        return Point(x, float((x - self.centre) @ (x - self.centre)), None, excess)

    def completed(self, point, previous):
        self.completions += 1
        if self.broken is not None and self.broken(point.x):
            raise SimulationFailure("beyond what can be built")
        return point

    def derivatives(self, point):
        x = point.x
        jacobian = np.array([2 * x, x, [1.0, 0.0]])
        values = np.array([*self.bounds(x)[0], *self.bounds(x)[1]])
        rows = Inequalities(values, sp.csr_matrix(jacobian), np.array([0, 0, 1]))
        return Derivatives(2 * (x - self.centre), sp.csc_matrix(2 * np.eye(2)), inequalities=rows)


OPTIONS = SQPOptions(penalty=20.0, decrease_tolerance=1e-12)


def test_the_minimum_within_bounds_is_found_with_its_multipliers():
    """At (1/2, sqrt(3)/2) both bounds push: 2 (x - c) + 2 y_0 x + y_1 e_0 = 0."""
    result = minimise(Disc(), np.zeros(2), OPTIONS)
    x = np.array([0.5, np.sqrt(0.75)])
    assert result.converged and np.allclose(result.x, x, atol=1e-6)
    y0 = (1.0 - x[1]) / x[1]
    assert result.pressure[1] == pytest.approx(2 * (2.0 - x[0]) - 2 * y0 * x[0], rel=1e-4)
    assert result.pressure[0] == pytest.approx(y0, rel=1e-4)
    assert result.point.excess.max() < 1e-6


def test_a_start_beyond_the_bounds_comes_back():
    result = minimise(Disc(), np.array([4.0, -3.0]), OPTIONS)
    assert np.allclose(result.x, [0.5, np.sqrt(0.75)], atol=1e-6)
    assert result.history[0].excess > result.history[-1].excess


def test_bounds_that_exclude_each_other_end_in_the_least_excess():
    """|x| <= 1 and x_0 <= -3: between them the excess is least, and it is reported."""
    result = minimise(Disc(top=-3.0), np.zeros(2), OPTIONS)
    assert result.point.excess.max() > 0.5
    assert result.x[0] < -0.5 and np.isfinite(result.point.value)


def test_a_penalty_that_is_too_small_is_raised():
    weak = minimise(
        Disc(), np.zeros(2), SQPOptions(penalty=0.5, decrease_tolerance=1e-12, raises=2)
    )
    assert weak.point.excess.max() < 1e-3
    assert {record.penalty for record in weak.history} >= {0.5, 5.0}
    kept = minimise(
        Disc(), np.zeros(2), SQPOptions(penalty=0.5, decrease_tolerance=1e-12, raises=0)
    )
    assert kept.point.excess.max() > 0.1


def test_what_is_refused_on_completion_is_no_step():
    """Points beyond x_0 = 0.3 would be accepted by their values, but can't be completed."""
    problem = Disc(broken=lambda x: x[0] > 0.3)
    result = minimise(problem, np.zeros(2), OPTIONS)
    assert 0.2 < result.x[0] <= 0.3
    assert result.failures > 0 and problem.completions >= result.steps


def test_resumed_as_if_never_interrupted():
    states = []
    whole = minimise(
        Disc(), np.array([4.0, -3.0]), OPTIONS, checkpoint=lambda s, p: states.append(s)
    )
    middle = SQPState.from_arrays(states[len(states) // 2].to_arrays())
    again = minimise(Disc(), middle.x, OPTIONS, state=middle)
    assert np.array_equal(again.x, whole.x) and again.steps == whole.steps
    assert np.array_equal(again.pressure, whole.pressure)


def test_a_row_that_no_step_changes_spoils_no_scale():
    """|x| <= 1 seen from its centre: no slope. The other bound alone holds the step."""
    problem = Disc()
    derivatives = problem.derivatives(Point(np.zeros(2), 5.0))
    region = Region(problem.lower, problem.upper, problem.constraints, np.ones(2))
    model = build_model(np.zeros(2), derivatives, derivatives.hessian, region, 20.0)
    step = minimise_model(model, np.inf, QPSolver(), (np.zeros(0), np.zeros(2)))
    assert step.u == pytest.approx([0.5, 1.0], abs=1e-9)
    assert step.pressure == pytest.approx([0.0, 3.0], abs=1e-8)


def test_points_without_bounds_need_none():
    point = Point(np.zeros(1), 0.0)
    assert point.excess.shape == (0,)
    assert SimpleNamespace(**vars(point)).value == 0.0
