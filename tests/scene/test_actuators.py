from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.errors import InputError
from kop_exudyn.rods.rotations import exp_so3
from kop_exudyn.scene.actuators import LinearActuators
from kop_exudyn.scene.state import State


def random_state(seed: int, n: int = 8) -> State:
    """Plates facing apart, tilted by up to about a radian."""
    rng = np.random.default_rng(seed)
    turn = rng.normal(scale=0.5, size=(n, 3))
    turn[1::2, 0] += np.pi
    return State(rng.normal(size=(n, 3)), exp_so3(turn), rng.normal(size=2))


pytestmark = pytest.mark.usefixtures("kernels")


def actuators(**options) -> LinearActuators:
    return LinearActuators([0, 2, 4], [1, 3, 5], 0.7, [0.5, 1.0, 2.0], **options)


def assembled(term, state: State) -> tuple[float, np.ndarray, np.ndarray]:
    n = 6 * len(state.positions) + len(state.angles)
    energy, g, H = term.gradient_hessian(state)
    gradient, hessian = np.zeros(n), np.zeros((n, n))
    for rows, block, square in zip(term.dofs, g, H):
        np.add.at(gradient, rows, block)
        hessian[np.ix_(rows, rows)] += square
    return energy, gradient, hessian


STIFFNESSES = [{}, {"alignment": 0.3, "extension": 2.0, "shear": 0.5}]


@pytest.mark.parametrize("options", STIFFNESSES)
@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_gradient_and_hessian_are_those_of_the_energy(options, seed):
    state, term = random_state(seed), actuators(**options)
    energy, gradient, hessian = assembled(term, state)
    assert energy == pytest.approx(term.energy(state), rel=1e-12)
    assert np.allclose(hessian, hessian.T, atol=1e-12)
    direction = np.random.default_rng(seed + 1).normal(size=len(gradient))
    remainders = []
    for step in (1e-2, 5e-3):
        change = term.energy(state.moved(step * direction)) - energy
        remainders.append(
            change - step * gradient @ direction - 0.5 * step**2 * direction @ hessian @ direction
        )
    third = 8 * abs(remainders[1])
    scale = np.sum(np.abs(term.energies(state)))
    assert abs(remainders[0]) < max(1.6 * third, 1e-4 * scale)
    assert abs(remainders[0]) < 1e-2 * scale + 1e-3


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_hessian_is_the_gradient_s_derivative_along_straight_translations(seed):
    state, term = random_state(seed), actuators()
    hessian = assembled(term, state)[2]
    direction = np.zeros(len(hessian))
    direction[:48].reshape(-1, 6)[:, :3] = np.random.default_rng(seed).normal(size=(8, 3))
    step = 1e-5
    ahead, behind = (assembled(term, state.moved(s * direction))[1] for s in (step, -step))
    assert np.allclose((ahead - behind) / (2 * step), hessian @ direction, atol=1e-7)


def test_energy_is_least_for_parallel_plates_at_the_target_spacing():
    R = np.stack([np.eye(3), exp_so3([np.pi, 0, 0])])
    state = State(np.array([[0, 0, 0.7], [0, 0, 0.0]]), R, np.zeros(0))
    term = LinearActuators([0], [1], 0.7, 2.0)
    energy, g, H = term.gradient_hessian(state)
    assert energy == pytest.approx(-2.0)
    assert np.abs(g).max() < 1e-14
    assert np.linalg.eigvalsh(H[0]).min() > -1e-12
    assert term.spacings(state) == pytest.approx([0.7])


@pytest.mark.parametrize("seed", range(3))
def test_energy_does_not_change_with_a_rigid_motion(seed):
    state, term = random_state(seed), actuators()
    turned = state.transformed(exp_so3([0.3, -1.0, 0.5]), np.array([1.0, 2.0, 3.0]))
    assert term.energy(turned) == pytest.approx(term.energy(state), rel=1e-12)


def test_weights_can_be_changed_and_are_checked():
    state, term = random_state(0), actuators()
    assert term.weighted(2 * term.weight).energy(state) == pytest.approx(2 * term.energy(state))
    with pytest.raises(InputError):
        term.weighted(-1.0)
    with pytest.raises(InputError):
        term.weighted(np.nan)
