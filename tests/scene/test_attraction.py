from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.errors import InputError
from kop_exudyn.geometry.triangles import TriangleSurface
from kop_exudyn.scene.attraction import Attraction
from kop_exudyn.scene.state import State

BODIES = np.array([[0, 1], [2, 3], [4, 1]])


def random_state(seed: int) -> State:
    rng = np.random.default_rng(seed)
    return State(rng.uniform(-1, 1, (6, 3)), np.tile(np.eye(3), (6, 1, 1)), np.zeros(0))


@pytest.fixture(scope="module")
def roof() -> TriangleSurface:
    """Two planes that meet in a ridge along y."""
    vertices = [[-3, -3, -1], [-3, 3, -1], [0, -3, 0.5], [0, 3, 0.5], [3, -3, -1], [3, 3, -1]]
    return TriangleSurface(vertices, [[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]])


def make(roof: TriangleSurface, **options) -> Attraction:
    fields = dict(
        shares=[0.25, 0.75],
        targets=np.arange(9.0).reshape(3, 3) / 9,
        target_weight=[1.0, 2.0, 0.0],
        surface=roof,
        surface_weight=[0.5, 1.0, 3.0],
    )
    return Attraction(BODIES, **{**fields, **options})


def assembled(term: Attraction, state: State) -> tuple[float, np.ndarray, np.ndarray]:
    energy, g, H = term.gradient_hessian(state)
    gradient, hessian = np.zeros(36), np.zeros((36, 36))
    for rows, block, square in zip(term.dofs, g, H):
        np.add.at(gradient, rows, block)
        hessian[np.ix_(rows, rows)] += square
    return energy, gradient, hessian


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), frozen=st.booleans())
def test_energy_is_quadratic_while_the_closest_feature_stays(roof, seed, frozen):
    state = random_state(seed)
    term = make(roof).frozen(random_state(seed + 1)) if frozen else make(roof)
    energy, gradient, hessian = assembled(term, state)
    assert energy == pytest.approx(term.energy(state), rel=1e-12)
    direction = np.random.default_rng(seed).normal(size=36)
    moved = state.moved(1e-6 * direction)
    same = np.array_equal(
        roof.closest(term.queries(state)).faces, roof.closest(term.queries(moved)).faces
    )
    if frozen or same:
        change = assembled(term, moved)[1] - gradient
        assert np.allclose(change / 1e-6, hessian @ direction, atol=1e-7)
        assert term.energy(moved) - energy == pytest.approx(
            1e-6 * gradient @ direction + 0.5e-12 * direction @ hessian @ direction,
            rel=1e-7,
            abs=1e-14,
        )


def test_frozen_and_live_agree_at_the_state_of_freezing(roof):
    state = random_state(3)
    live = make(roof)
    frozen = live.frozen(state)
    assert frozen.energy(state) == pytest.approx(live.energy(state))
    assert np.allclose(frozen.gradient_hessian(state)[1], live.gradient_hessian(state)[1])
    moved = state.moved(np.full(36, 0.1))
    assert frozen.energy(moved) > live.energy(moved)
    assert frozen.live().energy(moved) == pytest.approx(live.energy(moved))


def test_midpoints_of_body_pairs_are_queried(roof):
    state = random_state(1)
    term = Attraction(BODIES, targets=np.zeros((3, 3)), target_weight=2.0)
    middle = 0.5 * (state.positions[BODIES[:, 0]] + state.positions[BODIES[:, 1]])
    assert np.allclose(term.queries(state), middle)
    assert term.energy(state) == pytest.approx(np.sum(middle**2))
    assert term.scaled(0.5).energy(state) == pytest.approx(0.5 * np.sum(middle**2))


def test_single_bodies_and_no_surface_search_without_weight():
    state = random_state(2)
    term = Attraction([0, 5], targets=np.zeros((2, 3)), target_weight=1.0)
    assert term.dofs.tolist() == [[0, 1, 2], [30, 31, 32]]
    assert term.energy(state) == pytest.approx(0.5 * np.sum(state.positions[[0, 5]] ** 2))


@pytest.mark.parametrize(
    "options, field",
    [
        (dict(targets=None), "target_weight"),
        (dict(surface=None), "surface_weight"),
        (dict(target_weight=[1.0, -1.0, 0.0]), "target_weight"),
        (dict(surface_weight=[1.0, 2.0]), "surface_weight"),
        (dict(targets=[[0, 0, 0]]), "targets"),
        (dict(points=np.full((3, 3), np.nan)), "points"),
    ],
)
def test_wrong_input_is_named(roof, options, field):
    with pytest.raises(InputError, match=field):
        make(roof, **options)
