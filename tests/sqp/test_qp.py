import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from kop_exudyn.sqp import qp as qp_module
from kop_exudyn.sqp.qp import QP, QPOptions, QPSolver, residuals_of
from kop_exudyn.sqp.qp_backends import factorise_positive


def random_qp(seed, n=12, m=4, rank=None, equations=1, reach=0.3):
    """A feasible QP with a positive (semi)definite H; rows and bounds that are partly active."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((rank or n, n))
    A = rng.standard_normal((m, n))
    inside = rng.uniform(-reach, reach, n)
    hi = A @ inside + np.r_[np.zeros(equations), rng.uniform(0, 0.2, m - equations)]
    lo = np.r_[hi[:equations], np.full(m - equations, -np.inf)]
    H = sp.csc_matrix(root.T @ root)
    return QP(
        H, rng.standard_normal(n), sp.csr_matrix(A), lo, hi, np.full(n, -reach), np.full(n, reach)
    )


def unlimited(H, g, bound=np.inf):
    n = g.size
    limit, none = np.full(n, bound), np.zeros(0)
    return QP(sp.csc_matrix(H), g, sp.csr_matrix((0, n)), none, none, -limit, limit)


def assert_optimal(qp, result, tolerance=1e-6):
    """Karush-Kuhn-Tucker conditions, in the original variables and written out."""
    x, y, z, size = result.x, result.y, result.z, 1 + np.abs(qp.g).max()
    assert result.status == "solved"
    assert np.abs(qp.H @ x + qp.g + qp.A.T @ y + z).max() <= tolerance * size
    row = qp.A @ x
    for value, low, high, multiplier in ((row, qp.lo, qp.hi, y), (x, qp.lb, qp.ub, z)):
        assert np.all(value >= low - tolerance) and np.all(value <= high + tolerance)
        assert np.all((multiplier <= tolerance * size) | (high - value <= tolerance))
        assert np.all((multiplier >= -tolerance * size) | (value - low <= tolerance))


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([None, 5]))
def test_random_qps_meet_the_optimality_conditions(seed, rank):
    qp = random_qp(seed, rank=rank)
    assert_optimal(qp, QPSolver().solve(qp))


@pytest.mark.parametrize("seed", range(4))
def test_bounded_least_squares_agree_with_scipy(seed):
    rng = np.random.default_rng(seed)
    M, b = rng.standard_normal((20, 10)), rng.standard_normal(20)
    reference = lsq_linear(M, b, (-0.1, 0.1), method="bvls").x
    result = QPSolver().solve(unlimited(M.T @ M, -M.T @ b, 0.1))
    assert result.solver == "osqp" and result.active > 0
    assert np.allclose(result.x, reference, atol=1e-9)


def test_direct_solution_equals_osqp_where_no_limit_is_active():
    rng = np.random.default_rng(3)
    M = rng.standard_normal((30, 15))
    qp = unlimited(M.T @ M, rng.standard_normal(15), 10.0)
    direct, osqp = QPSolver().solve(qp), QPSolver(QPOptions(direct=False)).solve(qp)
    assert direct.solver == "direct" and osqp.solver == "osqp"
    assert direct.residuals.worst < 1e-12
    assert np.allclose(direct.x, osqp.x, rtol=1e-6, atol=1e-8)


def test_direct_solution_is_not_taken_past_a_limit_or_without_a_unique_minimiser():
    H, g = np.diag([1.0, 2.0]), np.array([-1.0, -1.0])
    assert QPSolver().solve(unlimited(H, g, 0.7)).solver == "osqp"
    flat = QPSolver().solve(unlimited(np.ones((2, 2)), g, 5.0))
    assert flat.solver == "osqp" and flat.x.sum() == pytest.approx(1.0, abs=1e-6)


def test_units_do_not_matter():
    qp = random_qp(7)
    unit = np.logspace(-5, 5, 12)
    D = sp.diags(unit)
    other = QP(
        sp.csc_matrix(1e4 * D @ qp.H @ D),
        1e4 * unit * qp.g,
        sp.csr_matrix(qp.A @ D),
        qp.lo,
        qp.hi,
        qp.lb / unit,
        qp.ub / unit,
    )
    result, changed = QPSolver().solve(qp), QPSolver().solve(other)
    assert np.allclose(unit * changed.x, result.x, atol=1e-8)
    assert np.allclose(changed.y / 1e4, result.y, atol=1e-6)


def test_set_up_once_a_pattern_and_warm_started():
    solver = QPSolver()
    first = random_qp(1)
    for scale in (1.0, 1.5, 0.5):
        assert_optimal(first, solver.solve(first))
        changed = QP(
            scale * first.H,
            first.g,
            scale * first.A,
            scale * first.lo,
            scale * first.hi,
            first.lb,
            first.ub,
        )
        assert_optimal(changed, solver.solve(changed))
    assert solver.setups == 1
    assert_optimal(random_qp(2, n=9), solver.solve(random_qp(2, n=9)))
    assert solver.setups == 2


def test_a_result_depends_only_on_data_and_warm_start():
    qp, start = random_qp(5), (np.full(12, 0.1), np.ones(4), np.zeros(12))
    fresh = QPSolver().solve(qp, start)
    used = QPSolver()
    for seed in range(6):
        used.solve(random_qp(seed, reach=10.0 ** (seed - 3)))
    again = used.solve(qp, start)
    assert (
        np.array_equal(fresh.x, again.x)
        and np.array_equal(fresh.y, again.y)
        and np.array_equal(fresh.z, again.z)
    )


def test_all_bounds_active_and_fixed_variables():
    g = np.array([1.0, -2.0, 3.0])
    result = QPSolver().solve(unlimited(np.eye(3), g, 0.5))
    assert np.allclose(result.x, [-0.5, 0.5, -0.5]) and np.allclose(result.z, [-0.5, 1.5, -2.5])
    fixed = QPSolver().solve(unlimited(np.eye(3), g, 0.0))
    assert np.allclose(fixed.x, 0, atol=1e-12) and np.allclose(fixed.z, -g)


def test_redundant_rows():
    A = sp.csr_matrix([[1.0, 1.0], [2.0, 2.0], [1.0, 1.0]])
    lo, hi, free = np.array([1.0, 2.0, -np.inf]), np.array([1.0, 2.0, 1.0]), np.full(2, np.inf)
    qp = QP(sp.identity(2, format="csc"), np.array([-3.0, -1.0]), A, lo, hi, -free, free)
    assert np.allclose(QPSolver().solve(qp).x, [1.5, -0.5], atol=1e-7)


def test_infeasible_unbounded_and_indefinite():
    n = 3
    row, lo, hi = sp.csr_matrix(np.ones((1, n))), np.array([5.0]), np.array([np.inf])
    apart = QP(sp.identity(n, format="csc"), np.ones(n), row, lo, hi, np.zeros(n), np.ones(n))
    assert QPSolver().solve(apart).status == "infeasible"
    assert QPSolver().solve(unlimited(np.diag([1.0, 1.0, 0.0]), np.ones(n))).status == "unbounded"


def test_an_indefinite_hessian_is_refused_and_does_no_harm_afterwards(capfd):
    solver = QPSolver()
    assert solver.solve(unlimited(np.diag([1.0, -1.0]), np.ones(2), 0.5)).status == "indefinite"
    assert np.allclose(solver.solve(unlimited(np.eye(2), np.ones(2), 0.5)).x, -0.5)
    assert solver.solve(unlimited(np.diag([1.0, -9.0]), np.ones(2), 0.5)).status == "indefinite"
    assert np.allclose(solver.solve(unlimited(np.eye(2), np.ones(2), 0.5)).x, -0.5)
    assert capfd.readouterr() == ("", "")


def test_hands_over_when_osqp_misses(monkeypatch):
    qp = random_qp(4)
    good = QPSolver().solve(qp)
    result = QPSolver(QPOptions(max_iterations=1)).solve(qp)
    assert result.solver == "piqp" and np.allclose(result.x, good.x, atol=1e-6)
    assert np.allclose(result.y, good.y, atol=1e-5) and np.allclose(result.z, good.z, atol=1e-5)
    calls = []

    def off(self, scaled, *start, solve=qp_module.OsqpBackend.solve):
        calls.append(self)
        raw = solve(self, scaled, *start)
        return (
            raw
            if len(calls) > 1
            else qp_module.RawSolution(raw.x + 1e-3, raw.y, raw.z, raw.status, raw.iterations)
        )

    monkeypatch.setattr(qp_module.OsqpBackend, "solve", off)
    assert QPSolver().solve(qp).solver == "osqp, tightened" and len(calls) == 2


def test_nothing_is_printed(capfd):
    QPSolver(QPOptions(direct=False)).solve(unlimited(np.eye(3), np.ones(3), 9.0))
    QPSolver().solve(random_qp(0))
    assert capfd.readouterr() == ("", "")


def test_residuals_see_each_condition():
    qp = unlimited(np.eye(2), np.array([1.0, 1.0]), 0.5)
    x, z = np.full(2, -0.5), np.full(2, -0.5)
    assert residuals_of(qp, x, np.zeros(0), z).worst == 0
    assert residuals_of(qp, x, np.zeros(0), 0 * z).stationarity == pytest.approx(0.5)
    assert residuals_of(qp, x - 0.1, np.zeros(0), z + 0.1).feasibility == pytest.approx(0.1)
    assert residuals_of(qp, x, np.zeros(0), -z).complementarity == pytest.approx(0.5)


def test_factorisation_tells_definite_from_indefinite():
    rng = np.random.default_rng(0)
    M = rng.standard_normal((8, 8))
    positive = sp.csc_matrix(M @ M.T + np.eye(8))
    b = rng.standard_normal(8)
    assert np.allclose(positive @ factorise_positive(positive)(b), b)
    assert factorise_positive(sp.csc_matrix(positive - 5 * sp.identity(8))) is None
    assert factorise_positive(sp.csc_matrix(np.ones((3, 3)))) is None
    assert factorise_positive(sp.csc_matrix(np.array([[0.0, 1.0], [1.0, 0.0]]))) is None


def test_blocks_coupled_through_parts():
    """The shape of the real problem, smaller: dense blocks, coupled by a few free unknowns at the
    end."""
    rng = np.random.default_rng(0)
    blocks = [root @ root.T / 40 for root in rng.standard_normal((3, 40, 40))]
    assign = sp.csc_matrix(
        (np.ones(120), (np.arange(120), rng.integers(0, 6, 120))), shape=(120, 6)
    )
    diagonal = sp.block_diag(blocks) + 10 * sp.identity(120)
    H = sp.bmat([[diagonal, -10 * assign], [-10 * assign.T, 10 * assign.T @ assign]])
    limit = np.append(np.full(120, 0.3), np.full(6, np.inf))
    qp = QP(
        sp.csc_matrix(H),
        np.append(rng.standard_normal(120), np.zeros(6)),
        sp.csr_matrix((0, 126)),
        np.zeros(0),
        np.zeros(0),
        -limit,
        limit,
    )
    result = QPSolver().solve(qp)
    assert result.solver == "osqp" and 0 < result.active < 120 and result.residuals.worst < 1e-10
    assert_optimal(qp, result)
