"""Subproblems by their dual: the solution of the whole problem, from the limits that come into
play."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.sqp import dual, model
from kop_exudyn.sqp.constraints import LinearConstraints
from kop_exudyn.sqp.dual import elastic_qp, solve_by_dual
from kop_exudyn.sqp.model import Region, build_model, minimise_model
from kop_exudyn.sqp.problem import Derivatives, Inequalities
from kop_exudyn.sqp.qp import QP, QPSolver


def problem(seed, width, rows=6, n=30, elastic=12):
    """A QP of two dense blocks within bounds of a width, with rows of which one is an equation, and
    elastic rows of four bounds."""
    rng = np.random.default_rng(seed)
    roots = [rng.standard_normal((n // 2, n // 2)) for _ in range(2)]
    H = sp.csc_matrix(sp.block_diag([root @ root.T + np.eye(n // 2) for root in roots]))
    A = sp.csr_matrix(rng.standard_normal((rows, n)))
    hi = rng.uniform(0.1, 1.0, rows)
    lo = np.where(np.arange(rows) == 0, hi, -hi)
    qp = QP(H, rng.standard_normal(n), A, lo, hi, np.full(n, -width), np.full(n, width))
    bounds = Inequalities(
        rng.uniform(-0.2, 0.5, elastic),
        sp.csr_matrix(rng.standard_normal((elastic, n))),
        np.repeat(np.arange(4), elastic // 4),
    )
    return qp, bounds


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([0.05, 0.2, 5.0]), st.sampled_from([0.3, 3.0]))
def test_it_has_the_solution_of_the_whole_problem(seed, width, penalty):
    """Against an interior-point method on the problem with all its limits and slacks."""
    qp, bounds = problem(seed, width, rows=3)
    whole = QPSolver().solve(elastic_qp(qp, bounds, penalty), interior_point=True)
    found = solve_by_dual(qp, bounds, penalty, QPSolver())
    if whole.status != "solved":  # the equation can't be met within narrow bounds
        assert found is None
        return
    if found is None:  # more than half of the unknowns at their limits
        assert whole.active > qp.g.size // 2
        return
    result, pressure = found
    n, m = qp.g.size, qp.lo.size
    np.testing.assert_allclose(result.x, whole.x[:n], atol=1e-6)
    np.testing.assert_allclose(result.y, whole.y[:m], atol=1e-4)
    np.testing.assert_allclose(result.z, whole.z[:n], atol=1e-4)
    summed = np.bincount(bounds.bound, whole.y[m:])
    np.testing.assert_allclose(pressure if len(pressure) else 0 * summed, summed, atol=1e-4)
    assert result.residuals.worst < 1e-7 and result.solver == "dual"


def test_limits_are_taken_in_until_none_is_exceeded():
    """The first ones alone would end beyond others: that isn't taken for a solution."""
    qp, bounds = problem(5, 0.4, rows=2)
    rounds = []
    search_solve = dual._Search.solve

    def counted(self, solver):
        rounds.append(len(self.taken))
        return search_solve(self, solver)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dual._Search, "solve", counted)
        result, _ = solve_by_dual(qp, bounds, 0.7, QPSolver())
        assert len(rounds) > 1 and rounds == sorted(rounds)
        assert np.all(result.x >= qp.lb) and np.all(result.x <= qp.ub)
        assert 0 < np.count_nonzero(result.z) < qp.g.size / 2
        patch.setattr(dual, "_ROUNDS", 1)
        assert solve_by_dual(qp, bounds, 0.7, QPSolver()) is None
    # a wrong solution doesn't pass for one
    with pytest.MonkeyPatch.context() as patch:
        own = dual._Search.take_in
        patch.setattr(dual._Search, "take_in", lambda self: not len(self.taken) and own(self))
        assert solve_by_dual(qp, bounds, 0.7, QPSolver()) is None


def test_an_indefinite_or_crowded_problem_is_left_to_others():
    qp, bounds = problem(1, 5.0)
    flat = QP(sp.csc_matrix((30, 30)), qp.g, qp.A, qp.lo, qp.hi, qp.lb, qp.ub)
    assert solve_by_dual(flat, bounds, 0.7, QPSolver()) is None
    narrow = QP(qp.H, qp.g, qp.A[:0], qp.lo[:0], qp.hi[:0], 1e-3 * qp.lb, 1e-3 * qp.ub)
    assert solve_by_dual(narrow, bounds, 0.7, QPSolver()) is None


@pytest.mark.parametrize("width", [0.4, 5.0])
def test_steps_are_those_of_the_whole_subproblem(monkeypatch, width):
    rng = np.random.default_rng(3)
    n, m = 30, 12
    root = rng.standard_normal((n, n))
    hessian = sp.csc_matrix(root @ root.T + np.eye(n))
    bounds = Inequalities(
        rng.uniform(-0.2, 0.5, m),
        sp.csr_matrix(rng.standard_normal((m, n))),
        np.repeat(np.arange(4), 3),
    )
    derivatives = Derivatives(rng.standard_normal(n), hessian, inequalities=bounds)
    region = Region(np.full(n, -width), np.full(n, width), LinearConstraints.none(n), np.ones(n))
    built = build_model(np.zeros(n), derivatives, hessian, region, 0.7)
    start = np.zeros(0), np.zeros(n)
    by_dual = minimise_model(built, np.inf, QPSolver(), start)
    assert by_dual.result.solver == "dual"
    monkeypatch.setattr(model, "solve_by_dual", lambda *arguments: None)
    whole = minimise_model(built, np.inf, QPSolver(), start)
    assert whole.result.solver != "dual"
    assert np.allclose(by_dual.u, whole.u, atol=1e-6)
    assert np.allclose(by_dual.pressure, whole.pressure, atol=1e-4)
    assert by_dual.predicted == pytest.approx(whole.predicted, rel=1e-6)
    assert built.excess(by_dual.u).max() > 0  # some of the bounds had to give way


@pytest.mark.parametrize("size", [1e-8, 1e8])
def test_its_accuracy_is_that_of_the_unknowns(size):
    """Near the end of a search steps are tiny: what a limit is exceeded by is seen against them."""
    found = []
    for by in (1.0, size):
        qp, bounds = problem(5, 0.4, rows=2)
        scaled = Inequalities(by * bounds.value, bounds.jacobian, bounds.bound)
        qp = QP(qp.H, by * qp.g, qp.A, by * qp.lo, by * qp.hi, by * qp.lb, by * qp.ub)
        # out of reach, so that the solution grows with the problem
        found.append(solve_by_dual(qp, scaled, 1e6 * max(by, 1.0), QPSolver()))
    assert all(one is not None and np.count_nonzero(one[0].z) > 2 for one in found)
    (first, _), (other, _) = found
    np.testing.assert_allclose(other.x / size, first.x, atol=1e-6)
