"""Lamellas of orthogonal grids laid out straight: corners, lengths and angles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.grids import CYLINDER, SADDLE, grid_data, isolines

from kop_exudyn.errors import InputError
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.grid.lamellas import corner_height


@pytest.fixture(scope="module")
def saddle():
    return design_from_dict(SADDLE)


@given(share=st.floats(0.25, 0.75), turn=st.floats(-1.4, 1.4))
def test_a_corner_over_its_chord_turns_by_its_angle(share, turn):
    h = corner_height(2.0, share, turn)
    assert -np.arctan(h / (2.0 * share)) - np.arctan(h / (2.0 * (1 - share))) == pytest.approx(
        turn, abs=1e-12
    )


def test_arcs_have_their_corners_where_the_tangents_meet():
    grid = design_from_dict(CYLINDER)
    arcs = [
        lamella
        for lamella in grid.straight.lamellas
        if np.ptp(grid.network.joints[lamella.strand.joints, 1]) < 1e-9
    ]
    assert len(arcs) == 3
    for lamella in arcs:
        # the normal points outwards
        np.testing.assert_allclose(lamella.spans.turns, -0.4, rtol=1e-7)
        np.testing.assert_allclose(lamella.spans.before, 0.8 * np.tan(0.2), rtol=1e-7)
        np.testing.assert_allclose(lamella.spans.after, 0.8 * np.tan(0.2), rtol=1e-7)


def test_straight_pieces_of_a_cylinder_are_laid_out_without_stress():
    grid = design_from_dict(CYLINDER)
    system = grid.systems["deployed"]
    system.set_parameters(grid.parameters)
    scene = grid.scene()
    energy = system.assemble(scene.with_driven(scene.initial, grid.parameters)).elastic
    bent = system.assemble(scene.with_driven(scene.initial, 0.99 * grid.parameters)).elastic
    assert energy < 1e-9 * bent


def test_asymptotic_lamellas_are_straight_and_halved():
    grid = design_from_dict(grid_data({"name": "hypar", "c": 0.8}, isolines(0.5, 3)))
    for lamella in grid.straight.lamellas:
        np.testing.assert_allclose(lamella.spans.turns, 0, atol=1e-14)
        np.testing.assert_allclose(lamella.spans.before, 0.5 * lamella.spans.lengths, rtol=1e-12)


@given(tilt=st.floats(-0.5, 0.5), cubic=st.floats(-3, 3))
@settings(max_examples=30, deadline=None)
def test_corners_stay_between_joints_and_move_continuously(tilt, cubic):
    """Through inflections too, and with the angle always the integral of the normal curvature."""

    def spans(c):
        surface = {"name": "polynomial", "coefficients": [[0, 0, 0.2], [0], [tilt], [c]]}
        grid = design_from_dict(grid_data(surface, isolines(0.4, 3)))
        return np.concatenate(
            [[s.shares, s.turns] for s in (lamella.spans for lamella in grid.straight.lamellas)],
            axis=1,
        )

    (shares, turns), (nearby, _) = spans(cubic), spans(cubic + 1e-6)
    assert (shares >= 0.25).all() and (shares <= 0.75).all()
    assert np.abs(shares - nearby).max() < 1e-4
    x = np.array([-0.4, 0.0, 0.4])
    # on v = 0 the curve u lies in a plane of symmetry: slope angles differ
    slope = 2 * tilt * x + 3 * cubic * x**2
    np.testing.assert_allclose(turns[6 + 2 : 6 + 4], np.diff(np.arctan(slope)), atol=1e-6)


def test_elements_cover_the_parameters_once(saddle):
    by_kind = {(group.kind, group.indices.shape[1]): group.indices for group in saddle.groups}
    assert {key: len(value) for key, value in by_kind.items()} == {
        ("linear", 2): 16,
        ("linear", 1): 16,
        ("angular", 1): 24,
    }
    used = np.concatenate([indices.ravel() for indices in by_kind.values()])
    np.testing.assert_array_equal(np.sort(used), np.arange(len(saddle.parameters)))
    assert not saddle.straight.numbering.is_length[by_kind["angular", 1]].any()
    assert (saddle.lower < saddle.parameters).all() and (saddle.parameters < saddle.upper).all()
    shares = np.concatenate([lamella.spans.shares for lamella in saddle.straight.lamellas])
    assert shares.min() > 0.4 and shares.max() < 0.6


def test_turns_too_large_for_one_corner_are_refused():
    with pytest.raises(InputError, match="more curves across"):
        design_from_dict(grid_data({"name": "cylinder", "radius": 0.3}, isolines(0.45, 2)))
