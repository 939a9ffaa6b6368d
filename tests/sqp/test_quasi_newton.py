import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.sqp.quasi_newton import BlockBFGS, damped_bfgs


def positive(rng, n):
    M = rng.standard_normal((n, n))
    return M @ M.T + np.eye(n)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6))
def test_updates_stay_positive_definite_whatever_the_curvature(seed):
    rng = np.random.default_rng(seed)
    updated = damped_bfgs(positive(rng, 5), rng.standard_normal(5), rng.standard_normal(5))
    assert np.array_equal(updated, updated.T) and np.linalg.eigvalsh(updated).min() > 0


def test_secant_equation_holds_where_nothing_is_damped():
    rng = np.random.default_rng(0)
    step = rng.standard_normal(5)
    change = positive(rng, 5) @ step
    start = 0.1 * np.eye(5)
    assert np.allclose(damped_bfgs(start, step, change) @ step, change)


def test_damping_limits_the_curvature_that_is_removed():
    step = np.array([1.0, 0.0])
    updated = damped_bfgs(np.eye(2), step, -step)
    assert step @ updated @ step == pytest.approx(0.2)


def test_blocks_learn_a_block_diagonal_hessian():
    rng = np.random.default_rng(1)
    H = np.zeros((7, 7))
    H[:3, :3], H[3:, 3:] = positive(rng, 3), positive(rng, 4)
    model, x = BlockBFGS((3, 4), np.ones(7)), np.zeros(7)
    model.observe(x, H @ x)
    for _ in range(60):
        x = x + rng.standard_normal(7)
        model.observe(x, H @ x)
    matrix = model.matrix().toarray()
    assert np.all(matrix[:3, 3:] == 0)
    assert np.abs(matrix - H).max() < 0.05 * np.abs(H).max()


def test_first_step_has_the_length_of_the_scale():
    scale = np.array([1e-3, 10.0])
    gradient = np.array([5.0, -2.0])
    model = BlockBFGS((2,), scale)
    model.observe(np.zeros(2), gradient)
    step = np.linalg.solve(model.matrix().toarray(), -gradient)
    assert np.linalg.norm(step / scale) == pytest.approx(1.0)


def test_a_block_that_does_not_move_keeps_its_matrix():
    model = BlockBFGS((1, 1), np.ones(2))
    model.observe(np.zeros(2), np.ones(2))
    before = model.matrix().toarray()
    model.observe(np.array([1.0, 0.0]), np.array([4.0, 3.0]))
    after = model.matrix().toarray()
    assert after[1, 1] == before[1, 1] and after[0, 0] == pytest.approx(3.0)


def test_restored_model_is_the_same_bit_for_bit():
    rng = np.random.default_rng(2)
    one, scale = BlockBFGS((2, 3), np.ones(5)), np.ones(5)
    one.observe(np.zeros(5), np.ones(5))
    one.observe(rng.standard_normal(5), rng.standard_normal(5))
    other = BlockBFGS((2, 3), scale)
    other.restore(one.to_arrays())
    x, g = rng.standard_normal(5), rng.standard_normal(5)
    one.observe(x, g)
    other.observe(x, g)
    assert np.array_equal(one.matrix().toarray(), other.matrix().toarray())
