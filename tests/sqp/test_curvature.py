"""Secant corrections learn what a model Hessian leaves out."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from kop_exudyn.sqp.curvature import SecantCorrection

RNG = np.random.default_rng(5)
SIZES = (4, 3)
SCALE = np.array([1.0, 2.0, 0.5, 1.0, 10.0, 1.0, 3.0])


def problem() -> tuple[np.ndarray, sp.csc_matrix]:
    """A block-diagonal true Hessian (n, n), and a model that lacks an indefinite part of it."""
    blocks = [(h + h.T) for h in (RNG.normal(size=(n, n)) for n in SIZES)]
    true = sp.block_diag(blocks).toarray()
    return true, sp.csc_matrix(np.diag(np.diag(true)))


def test_after_enough_steps_a_quadratic_is_known_exactly():
    true, model = problem()
    secant = SecantCorrection(SIZES, SCALE)
    x = np.zeros(7)
    for step in [np.zeros(7), *RNG.normal(size=(4, 7))]:
        x = x + step
        secant.observe(x, true @ x, model)
    last = step  # the newest secant equation holds whatever the sizing did to the older ones
    np.testing.assert_allclose((model + secant.matrix()) @ last, true @ last, atol=1e-9)


def test_nothing_is_learned_where_the_model_is_right():
    true, _ = problem()
    secant = SecantCorrection(SIZES, SCALE)
    for x in RNG.normal(size=(5, 7)):
        secant.observe(x, true @ x, sp.csc_matrix(true))
    assert abs(secant.matrix()).max() < 1e-10


def test_restored_data_continue_identically():
    true, model = problem()
    points = RNG.normal(size=(6, 7))
    whole, first, second = (SecantCorrection(SIZES, SCALE, memory=3) for _ in range(3))
    for x in points:
        whole.observe(x, true @ x, model)
    for x in points[:3]:
        first.observe(x, true @ x, model)
    second.restore(first.to_arrays())
    for x in points[3:]:
        second.observe(x, true @ x, model)
    np.testing.assert_array_equal(whole.matrix().toarray(), second.matrix().toarray())
