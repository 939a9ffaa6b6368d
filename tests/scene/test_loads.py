from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.moments import BodyMoments, SpatialMoments

from kop_exudyn.errors import InputError
from kop_exudyn.rods.rotations import exp_so3
from kop_exudyn.rods.sections import rectangle
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.scene.loads import (
    DeadForces,
    HingeTorques,
    Scaled,
    with_self_weight,
)
from kop_exudyn.scene.state import State


def random_state(seed: int) -> State:
    rng = np.random.default_rng(seed)
    return State(rng.normal(size=(5, 3)), exp_so3(rng.normal(size=(5, 3))), rng.normal(size=4))


def assembled(term, state: State) -> tuple[float, np.ndarray, np.ndarray]:
    energy, g, H = term.gradient_hessian(state)
    gradient, hessian = np.zeros(34), np.zeros((34, 34))
    for rows, block, square in zip(term.dofs, g, H):
        np.add.at(gradient, rows, block)
        np.add.at(hessian, np.ix_(rows, rows), square)
    return energy, gradient, hessian


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_potentials_against_differences(seed):
    rng = np.random.default_rng(seed)
    state = random_state(seed)
    d = rng.normal(size=34)
    for term in (
        DeadForces([3, 0, 3], rng.normal(size=(3, 3)), rng.normal(size=(3, 3))),
        HingeTorques([1, 3], rng.normal(size=2), 5),
        Scaled(DeadForces([1], rng.normal(size=3), [1.0, 2, 3]), -2.5),
    ):
        energy, g, H = assembled(term, state)
        assert energy == pytest.approx(term.energy(state), rel=1e-13)
        h = 1e-4
        ahead, back = (term.energy(state.moved(sign * h * d)) for sign in (1, -1))
        assert (ahead - back) / (2 * h) == pytest.approx(g @ d, rel=1e-6, abs=1e-6)
        assert (ahead - 2 * energy + back) / h**2 == pytest.approx(d @ H @ d, rel=1e-5, abs=1e-5)
        assert np.allclose(H, H.T)


def test_dead_force_at_a_point_does_the_work_of_its_path():
    state = random_state(1)
    force, point = np.array([1.0, -2, 3]), np.array([0.3, 0.1, -0.2])
    term = DeadForces([2], force, point)
    moved = state.moved(np.arange(34) / 20)
    path = (moved.positions[2] + moved.rotations[2] @ point) - (
        state.positions[2] + state.rotations[2] @ point
    )
    assert term.energy(state) - term.energy(moved) == pytest.approx(force @ path)


def test_moments_do_the_work_of_small_turns():
    state = random_state(2)
    moment = np.array([0.5, 1.5, -1.0])
    w = np.array([0.2, -0.1, 0.4])
    d = np.zeros(34)
    d[6 * 4 + 3 : 6 * 4 + 6] = w
    fixed, space = BodyMoments([4], moment), SpatialMoments([4], moment)
    assert -assembled(fixed, state)[1] @ d == pytest.approx(moment @ w)
    assert -assembled(space, state)[1] @ d == pytest.approx(moment @ (state.rotations[4] @ w))
    assert not fixed.conservative and not space.conservative and not Scaled(space).conservative


@pytest.mark.parametrize("kind", [BodyMoments, SpatialMoments])
def test_the_symmetric_tangent_of_a_moment_vanishes(kind):
    """The work along R exp(t hat(w)) has no second derivative at t = 0; the skew rest of the
    tangent does."""
    state, moment = random_state(3), np.array([0.5, 1.5, -1.0])
    term = kind([4], moment)
    h = 1e-5
    columns = []
    for k in range(3):
        d = np.zeros(34)
        d[6 * 4 + 3 + k] = h
        ahead, back = (term.gradient_hessian(state.moved(s * d))[1][0] for s in (1, -1))
        columns.append((ahead - back) / (2 * h))
    tangent = np.array(columns).T
    assert np.allclose(tangent + tangent.T, 0, atol=1e-9)
    assert np.array_equal(term.gradient_hessian(state)[2], np.zeros((1, 3, 3)))
    assert np.abs(tangent).max() > 0.1 if kind is SpatialMoments else np.abs(tangent).max() < 1e-9


def beam(section=None):
    builder = SceneBuilder()
    nodes = builder.nodes(builder.bodies([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]))
    builder.rod(nodes, np.ones(6), length=2.0, section=section, weight=[0.0, 0, 1.0])
    return builder.build()


def test_self_weight_is_added_per_rest_length():
    section = rectangle(0.2, 0.5)
    scene = with_self_weight(beam(section), 3.0, [0, 0, -9.81])
    assert np.allclose(scene.weight, [0, 0, 1.0 - 3.0 * 0.1 * 9.81])
    again = with_self_weight(beam().with_weight(None), 3.0, [0, 0, -9.81], areas=[0.1, 0.2])
    assert np.allclose(again.weight[:, 2], [-2.943, -5.886])


@pytest.mark.parametrize(
    "make",
    [
        lambda: DeadForces([0, 1], np.zeros((3, 3))),
        lambda: DeadForces([0], [np.nan, 0, 0]),
        lambda: DeadForces([0], [0, 0, 1.0], points=[0.0, 1.0]),
        lambda: HingeTorques([0, 1], [1.0, 2.0, 3.0], 5),
        lambda: HingeTorques([0], np.inf, 5),
        lambda: with_self_weight(beam(), 1.0, [0, 0, -1]),
        lambda: with_self_weight(beam(), -1.0, [0, 0, -1], areas=1.0),
        lambda: with_self_weight(beam(), 1.0, [0, 0, -1], areas=[1.0, 0.0]),
        lambda: with_self_weight(beam(), 1.0, [0, 0, -1, 2], areas=1.0),
        lambda: with_self_weight(beam(), 1.0, [0, np.nan, -1], areas=1.0),
    ],
)
def test_bad_loads(make):
    with pytest.raises(InputError):
        make()
