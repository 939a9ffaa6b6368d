"""Inertia, softest modes, factorisation."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from support.states import stiffness_matrix

from kop_exudyn.equilibrium.direction import Border, bordered_solve, factorise_convex, is_convex
from kop_exudyn.equilibrium.factorisation import factorisation
from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.equilibrium.stability import softest_mode
from kop_exudyn.equilibrium.system import System
from kop_exudyn.scene.loads import DeadForces


def symmetric(rng, n: int, negative: int) -> np.ndarray:
    """A matrix with given numbers of positive and negative eigenvalues."""
    Q = np.linalg.qr(rng.normal(size=(n, n)))[0]
    values = rng.uniform(0.5, 2.0, n) * np.where(np.arange(n) < negative, -1, 1)
    return Q * values @ Q.T


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    n=st.integers(2, 30),
    negative=st.integers(0, 3),
    columns=st.integers(1, 40),
)
def test_pivots_are_the_inertia_and_solves_are_solves(seed, n, negative, columns):
    rng = np.random.default_rng(seed)
    K = symmetric(rng, n, min(negative, n))
    factors = factorisation()
    for _ in range(2):  # the second time through the numeric refactorisation
        assert factors.update(sp.csc_matrix(np.triu(K))) == min(negative, n)
        rhs = rng.normal(size=(n, columns)) * (rng.random((n, columns)) < 0.3)
        assert np.allclose(K @ factors.solve(rhs), rhs, atol=1e-7)
        assert np.allclose(factors.solve(rhs)[:, 0], factors.solve(rhs[:, 0]), atol=1e-8)
        K = K + 0.0


def test_a_singular_matrix_is_counted_as_not_positive():
    factors = factorisation()
    singular = sp.csc_matrix(([1.0, 0.0], ([0, 1], [0, 1])), shape=(2, 2))
    assert factors.update(singular) >= 1
    assert factors.update(sp.csc_matrix(np.triu([[2.0, 1], [1, 2]]))) == 0
    assert np.allclose(factors.solve(np.array([3.0, 3.0])), 1)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), n=st.integers(2, 12), negative=st.integers(0, 2))
def test_convexity_on_the_kernel_of_the_constraint(seed, n, negative):
    """Haynsworth's count against the eigenvalues on the kernel itself."""
    rng = np.random.default_rng(seed)
    K, c = symmetric(rng, n, negative), rng.normal(size=n)
    column = np.linalg.solve(K, c)
    kernel = scipy.linalg.null_space(c[None])
    lowest = np.linalg.eigvalsh(kernel.T @ K @ kernel)[0]
    if abs(lowest) > 1e-9:
        assert is_convex(negative, Border(column, float(c @ column))) == (lowest > 0)


def test_bordered_solves(wheel):
    case = wheel()
    system = System(case.scene)
    solve(system, case.q, opening=case.opening)
    K, c = stiffness_matrix(system), system.constraint
    shift, border = factorise_convex(system)
    assert shift == 0.0
    rng = np.random.default_rng(0)
    rhs, gap = rng.normal(size=(len(c), 5)), rng.normal(size=5)
    d, t = bordered_solve(system, border, rhs, gap)
    assert np.allclose(K @ d + np.outer(c, t), rhs, atol=1e-6) and np.allclose(c @ d, gap)
    one, multiplier = bordered_solve(system, border, rhs[:, 0], gap[0])
    assert np.allclose(one, d[:, 0]) and multiplier == pytest.approx(t[0])


def dense_lowest(system) -> tuple[float, np.ndarray]:
    """Lowest eigenpair of K v = lambda M v on the constraint's kernel."""
    K, M = stiffness_matrix(system), np.diag(system.metric)
    if system.constraint is not None:
        Z = scipy.linalg.null_space(system.constraint[None])
        values, vectors = scipy.linalg.eigh(Z.T @ K @ Z, Z.T @ M @ Z)
        return values[0], Z @ vectors[:, 0]
    values, vectors = scipy.linalg.eigh(K, M)
    return values[0], vectors[:, 0]


@pytest.mark.parametrize("actuated", [True, False])
def test_softest_mode_against_dense_eigenvalues(wheel, actuated):
    case = wheel(actuated=actuated)
    system = System(case.scene)
    solve(system, case.q, opening=case.opening)
    eigenvalue, vector = dense_lowest(system)
    mode = softest_mode(system)
    assert mode.eigenvalue == pytest.approx(eigenvalue, rel=1e-5)
    cosine = abs(mode.vector @ vector) / (np.linalg.norm(mode.vector) * np.linalg.norm(vector))
    assert cosine == pytest.approx(1, abs=1e-4)
    assert np.abs(mode.vector[system.is_rotation]).max() == pytest.approx(1)


def test_softest_mode_of_an_unstable_state_is_the_negative_one(strut):
    """A straight column at 1.2 and at 0.9 times its Euler load."""
    euler = np.pi**2 / 4
    found = []
    for share in (0.9, 1.2):
        scene = strut(planar=True, n=12).with_terms(DeadForces([12], [-share * euler, 0, 0]))
        system = System(scene)
        system.set_parameters(np.zeros(0))
        eq = solve(System(scene.with_terms(DeadForces([12], [-0.5 * euler, 0, 0]))), np.zeros(0))
        squeezed = eq.state.positions.copy()
        squeezed[:, 0] = np.linspace(0, 1 - share * euler / 2e4, 13)
        system.assemble(type(eq.state)(squeezed, eq.state.rotations, eq.state.angles))
        assert np.abs(system.gradient).max() < 1e-8
        found.append(softest_mode(system).eigenvalue)
        assert found[-1] == pytest.approx(dense_lowest(system)[0], rel=1e-5)
    assert found[0] > 0 > found[1]
