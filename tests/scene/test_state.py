from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from support.states import increment

from kop_exudyn.rods.rotations import exp_so3
from kop_exudyn.scene.state import State


def random_state(rng, bodies=4, hinges=3) -> State:
    return State(
        rng.normal(size=(bodies, 3)), exp_so3(rng.normal(size=(bodies, 3))), rng.normal(size=hinges)
    )


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6), size=st.floats(1e-9, 1.5))
def test_the_increment_between_states_undoes_moved(seed, size):
    rng = np.random.default_rng(seed)
    state = random_state(rng)
    d = size * rng.uniform(-1, 1, 27)
    assert np.allclose(increment(state, state.moved(d)), d, atol=1e-14 + 1e-13 * size)


def test_increments_are_global_for_places_and_of_the_body_for_turns():
    R = exp_so3(np.array([[0.0, 0.0, np.pi / 2]]))
    state = State(np.zeros((1, 3)), R, np.array([0.5]))
    moved = state.moved(np.array([1.0, 2.0, 3.0, 0.1, 0.0, 0.0, 0.25]))
    assert np.array_equal(moved.positions, [[1.0, 2.0, 3.0]])
    assert np.allclose(moved.rotations, R @ exp_so3(np.array([0.1, 0, 0])))
    assert moved.angles == 0.75
    assert np.array_equal(state.positions, np.zeros((1, 3)))  # the old state stays


def test_rigid_motion_and_arrays():
    rng = np.random.default_rng(1)
    state = random_state(rng)
    Q, t = exp_so3(rng.normal(size=3)), rng.normal(size=3)
    there = state.transformed(Q, t)
    assert np.allclose(there.transformed(Q.T, -Q.T @ t).positions, state.positions)
    assert np.allclose(
        np.linalg.norm(there.positions[0] - there.positions[1]),
        np.linalg.norm(state.positions[0] - state.positions[1]),
    )
    assert np.array_equal(State(**state.to_arrays()).rotations, state.rotations)
