"""Thicker and thinner sections: their integrals, and the thickness that keeps the elastic limit,
against designs that are made with it from the start."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
import pytest
from support.grids import coarse_grid

from kop_exudyn.rods.sections import circle, drilled, general, half_lapped, rectangle, thickened
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.strength import design_strength, materials_of
from kop_exudyn.structures.thickness import board_of, keeping_limit, thickened_scene


def same(a, b) -> None:
    for (name, mine), theirs in zip(asdict(a).items(), asdict(b).values(), strict=True):
        if name != "cut":
            np.testing.assert_allclose(mine, theirs, rtol=1e-12, err_msg=name)


@pytest.mark.parametrize("make", [lambda s: s, half_lapped, lambda s: drilled(s, 0.003)])
def test_a_thicker_strip_is_the_strip_of_that_thickness(make):
    found = thickened(make(rectangle(0.012, 0.002)), 1.7)
    expected = make(rectangle(0.012, 1.7 * 0.002))
    same(found, expected)
    assert (found.cut is None) == (expected.cut is None)
    if expected.cut is not None:
        same(found.cut, expected.cut)


def test_on_edge_it_is_the_width_that_grows():
    same(thickened(rectangle(0.004, 0.03), 0.5), rectangle(0.002, 0.03))


def test_what_is_as_broad_as_thick_grows_both_ways():
    same(thickened(circle(0.003), 2.0), circle(0.006))
    same(thickened(rectangle(0.01, 0.01), 1.5), rectangle(0.015, 0.015))


def test_other_sections_keep_their_breadth():
    flat = general(2e-5, 1e-11, 2e-10, 4e-11, outline=[[6, 1], [-6, 1], [-5, -1], [5, -1]])
    found = thickened(flat, 2.0)
    ratios = [getattr(found, name) / getattr(flat, name) for name in ("area", "inertia_y")]
    assert ratios == pytest.approx([2, 8])
    assert found.inertia_z / flat.inertia_z == pytest.approx(2)
    assert np.ptp(found.outline, axis=0) == pytest.approx([12, 4])


@pytest.fixture
def data(repository):
    return coarse_grid(repository)


def with_limit(data, limit, thickness=None):
    own = {**data["section"], **({} if thickness is None else {"width": thickness})}
    return design_from_dict(
        {**data, "material": {**data["material"], "elastic_limit": limit}, "section": own}
    )


def states_of(design):
    return [(design.scene(role), state) for role, state in design.deploy().items()]


def largest(design):
    return max(s.largest for s in design_strength(design, design.deploy()).values())


def test_thickened_scenes_are_those_of_thicker_designs(data):
    thin, thick = with_limit(data, 4e7), with_limit(data, 4e7, 0.006)
    found = thickened_scene(thin.scene("deployed"), materials_of(thin), 1.5)
    expected = thick.scene("deployed")
    np.testing.assert_allclose(found.stiffness, expected.stiffness, rtol=1e-12)
    assert [chain.section is None for chain in found.chains] == [
        chain.section is None for chain in expected.chains
    ]


@pytest.mark.parametrize("over", [2.0, 0.7])
def test_the_thickness_that_keeps_the_limit_keeps_it(data, over):
    """A limit that is exceeded twice over, and one that has room: the design made anew with the
    thickness that is named uses just what is allowed."""
    limit = 4e7 * largest(with_limit(data, 4e7)) / over
    design = with_limit(data, limit)
    share = keeping_limit(states_of(design), materials_of(design))
    assert board_of(design) == pytest.approx(0.004)
    assert share is not None and (share < 1) == (over > 1)
    assert largest(with_limit(data, limit, share * 0.004)) == pytest.approx(0.99, abs=0.02)


def test_without_a_limit_no_thickness_is_named(data):
    del data["material"]["elastic_limit"]
    design = design_from_dict(data)
    assert keeping_limit(states_of(design), materials_of(design)) is None
