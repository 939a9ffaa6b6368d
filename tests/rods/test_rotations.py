from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.special import bernoulli, factorial

from kop_exudyn.rods.rotations import (
    axes_along_z,
    bend_coefficients,
    compose_increments,
    exp_se3,
    exp_so3,
    hat,
    log_so3,
    rotation_z,
)

pytestmark = pytest.mark.usefixtures("kernels")


def unit_vectors(seed: int, n: int) -> np.ndarray:
    v = np.random.default_rng(seed).normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


ANGLES = [0.0, 1e-300, 1e-12, 1e-8, 0.9e-6, 1.1e-6, 1e-3, 0.5, 1.0, 2.0, 3.0, np.pi - 1e-4]


@pytest.mark.parametrize("angle", ANGLES)
def test_exponential_is_scipys(angle):
    w = angle * unit_vectors(1, 20)
    assert np.allclose(exp_so3(w), Rotation.from_rotvec(w).as_matrix(), atol=2e-15, rtol=0)


@pytest.mark.parametrize("angle", ANGLES)
def test_logarithm_undoes_the_exponential(angle):
    w = angle * np.concatenate([unit_vectors(2, 50), np.eye(3), -np.eye(3)])
    assert np.allclose(log_so3(exp_so3(w)), w, rtol=0, atol=1e-15 + 3e-15 * angle)


def test_logarithm_of_half_turns_has_length_pi():
    axes = np.concatenate([unit_vectors(3, 50), np.eye(3)])
    R = 2 * axes[:, :, None] * axes[:, None, :] - np.eye(3)
    w = log_so3(R)
    assert np.allclose(np.linalg.norm(w, axis=1), np.pi)
    assert np.allclose(np.abs(np.einsum("ni,ni->n", w, axes)), np.pi)


@settings(max_examples=60, deadline=None)
@given(t=st.one_of(st.floats(0, 1e-3), st.floats(0.4, 0.6), st.floats(0, 3.1)))
def test_bend_coefficient_and_derivatives_against_the_full_series(t):
    """c = sum |B_2k| s^(k-1)/(2k)!: only positive terms, sixty of them, so nothing is lost below t
    = pi."""
    s = t * t
    k = np.arange(1, 61)
    b = np.abs(bernoulli(120)[2 * k]) / factorial(2 * k)
    exact = (
        np.sum(b * s ** (k - 1.0)),
        np.sum((b * (k - 1))[1:] * s ** (k[1:] - 2.0)),
        np.sum((b * (k - 1) * (k - 2))[2:] * s ** (k[2:] - 3.0)),
    )
    c = [float(v[0]) for v in bend_coefficients(np.array([s]))]
    assert c[0] == pytest.approx(exact[0], rel=1e-14)
    assert c[1] == pytest.approx(exact[1], rel=1e-12)
    assert c[2] == pytest.approx(exact[2], rel=1e-9)


def test_rigid_motion_exponential_inverts_the_relative_motion():
    """u = A(phi) p, with A from its definition: the inverse of the left Jacobian, a power series of
    matrices."""
    rng = np.random.default_rng(4)
    h = rng.normal(size=(20, 6))
    p, R = exp_se3(h)
    assert np.allclose(R, exp_so3(h[:, 3:]))
    for (u, phi), translation in zip(h.reshape(-1, 2, 3), p):
        term, V = np.eye(3), np.eye(3)
        for k in range(2, 40):
            term = term @ hat(phi) / k
            V = V + term
        assert np.allclose(V @ u, translation, atol=1e-13)


def test_composition_stays_orthonormal_after_many_products():
    R = np.eye(3)[None].copy()
    w = 0.3 * unit_vectors(5, 1)
    for _ in range(20000):
        R = compose_increments(R, w)
    assert np.abs(R[0].T @ R[0] - np.eye(3)).max() < 1e-15
    turns = 20000 * 0.3
    assert np.allclose(R[0], exp_so3(np.remainder(turns, 2 * np.pi) * w[0] / 0.3), atol=1e-10)


def test_axes_along_z_are_a_rotation_onto_the_axis():
    assert np.array_equal(axes_along_z(np.array([0.0, 0, 1])), np.eye(3))
    for axis in np.random.default_rng(0).normal(size=(5, 3)):
        axis /= np.linalg.norm(axis)
        R = axes_along_z(axis)
        assert np.allclose(R.T @ R, np.eye(3)) and np.linalg.det(R) == pytest.approx(1)
        assert np.allclose(R[:, 2], axis)


def test_turn_about_z_and_cross_product_matrix():
    assert np.allclose(rotation_z(0.3) @ [1, 0, 0], [np.cos(0.3), np.sin(0.3), 0])
    assert rotation_z(np.zeros((4, 2))).shape == (4, 2, 3, 3)
    a, b = unit_vectors(6, 2)
    assert np.allclose(hat(a) @ b, np.cross(a, b))
