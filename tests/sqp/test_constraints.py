import cvxpy as cp
import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.errors import InputError
from kop_exudyn.sqp.constraints import (
    LinearConstraints,
    check_feasible,
    feasible_point,
    from_cvxpy,
    validate_bounds,
)


def test_bounds_name_the_first_offending_entry():
    with pytest.raises(
        InputError, match=r"bounds.lower\[2\] = 3.0: lies above its upper bound 1.0"
    ):
        validate_bounds([0, 0, 3, 4], 1.0, 4)
    with pytest.raises(InputError, match=r"bounds.upper\[1\] = nan"):
        validate_bounds(0.0, [1, np.nan, np.nan], 3)
    with pytest.raises(InputError, match=r"bounds.lower\[0\] = inf"):
        validate_bounds(np.inf, np.inf, 2)
    with pytest.raises(InputError, match="expected"):
        validate_bounds([0, 0], 1.0, 3)
    lower, upper = validate_bounds(-np.inf, [1, 2], 2)
    assert np.all(lower == -np.inf) and np.array_equal(upper, [1, 2])


def test_equations_and_inequalities_are_extracted_exactly():
    x = cp.Variable(4)
    M = np.arange(12.0).reshape(3, 4)
    factor = cp.Parameter(value=0.1)
    constraints = [
        cp.sum(x) == 1,
        M @ (2 * x - 1) <= np.array([1.0, 2.0, 3.0]),
        x[1:3] >= x[0] + 0.5,
        cp.sum(cp.reshape(x, (2, 2), order="F"), axis=0) <= factor * 7,
        x[3] / 3 - x[0] >= -4,
    ]
    rows = from_cvxpy(constraints, x)
    expected = np.vstack(
        [
            np.ones((1, 4)),
            2 * M,
            [[1, -1, 0, 0], [1, 0, -1, 0]],
            [[1, 1, 0, 0], [0, 0, 1, 1]],
            [[1, 0, 0, -1 / 3]],
        ]
    )
    assert np.array_equal(rows.A.toarray(), expected)
    limits = np.concatenate(
        [[1.0], np.array([1.0, 2.0, 3.0]) + M @ np.ones(4), [-0.5, -0.5], [0.1 * 7] * 2, [4.0]]
    )
    assert np.array_equal(rows.upper, limits)
    assert rows.lower[0] == 1 and np.all(rows.lower[1:] == -np.inf)
    assert rows.names[1] == "constraints[1] row 0" and rows.names[-1] == "constraints[4]"
    assert x.value is None


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6))
def test_extracted_rows_agree_with_cvxpy_on_random_points(seed):
    rng = np.random.default_rng(seed)
    n, k = rng.integers(1, 6, 2)
    x = cp.Variable(int(n))
    M, offset = rng.standard_normal((k, n)), rng.standard_normal(k)
    constraint = M @ cp.cumsum(x) - offset * cp.sum(x) + 2 <= offset
    rows = from_cvxpy([constraint], x)
    x.value = rng.standard_normal(n)
    assert np.allclose(rows.A @ x.value - rows.upper, constraint.expr.value, atol=1e-12)
    assert rows.violation(x.value) == pytest.approx(np.max(constraint.violation()), abs=1e-12)


def test_single_variable_and_no_constraint():
    x = cp.Variable(1)
    rows = from_cvxpy([2 * x <= 3], x)
    assert rows.A.toarray().tolist() == [[2.0]] and rows.upper.tolist() == [3.0]
    assert from_cvxpy([], x).rows == 0


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda x: cp.sum_squares(x) <= 1, r"constraints\[1\].*not affine"),
        (lambda x: cp.norm(x) <= 1, "not affine"),
        (lambda x: cp.SOC(x[0], x[1:]), "not a linear equation"),
        (lambda x: True, "not a linear equation"),
        (lambda x: x[0] + cp.Variable(name="other") <= 1, "unknown variable other"),
        (lambda x: x * cp.Parameter() <= 1, "without a value"),
        (lambda x: x[0] <= np.inf, "not finite"),
    ],
)
def test_unusable_constraints_are_named(make, message):
    x = cp.Variable(3)
    with pytest.raises(InputError, match=message):
        from_cvxpy([x[0] <= 1, make(x)], x)


def test_unusable_variables():
    with pytest.raises(InputError, match="nonneg"):
        from_cvxpy([], cp.Variable(3, nonneg=True))
    with pytest.raises(InputError, match="one axis"):
        from_cvxpy([], cp.Variable((2, 2)))


def test_infeasible_limits_are_named_and_only_those():
    rows = LinearConstraints(
        sp.csr_matrix([[1.0, 1, 0], [0, 0, 1]]), [5.0, 0], [np.inf, 1], ("total", "last")
    )
    with pytest.raises(InputError) as error:
        check_feasible(np.zeros(3), np.ones(3), rows)
    text = str(error.value)
    assert "total (>= 5)" in text and "x[0] <= 1" in text and "x[1] <= 1" in text
    assert "last" not in text and "x[2]" not in text


def test_constant_rows_that_cannot_hold():
    x = cp.Variable(2)
    with pytest.raises(InputError, match=r"constraints\[0\] \(<= -1\)"):
        check_feasible(np.zeros(2), np.ones(2), from_cvxpy([0 * x[0] + 1 <= 0], x))


def test_feasible_point_meets_everything():
    rng = np.random.default_rng(1)
    A = rng.standard_normal((5, 8))
    inside = rng.uniform(-1, 1, 8)
    limit = A @ inside
    rows = LinearConstraints(sp.csr_matrix(A), np.r_[limit[:2], [-np.inf] * 3], limit)
    x = feasible_point(-np.ones(8), np.ones(8), rows)
    assert rows.violation(x) < 1e-8 and np.all(np.abs(x) <= 1)


def test_malformed_constraints():
    with pytest.raises(InputError, match="constraints.A"):
        LinearConstraints(sp.csr_matrix([[np.nan]]), [0.0], [1.0])
    with pytest.raises(InputError, match=r"constraints.lower\[0\]"):
        LinearConstraints(sp.csr_matrix([[1.0]]), [2.0], [1.0])
    with pytest.raises(InputError, match="names"):
        LinearConstraints(sp.csr_matrix([[1.0]]), [0.0], [1.0], ("a", "b"))
