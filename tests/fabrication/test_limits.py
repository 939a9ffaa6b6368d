"""Bounds that the workshop sets to parts before they are sought: within them everything can be cut,
outside it can't."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from kop_exudyn.errors import SimulationFailure
from kop_exudyn.fabrication.blanks import Blanks, least_side
from kop_exudyn.fabrication.limits import (
    cutting_problems,
    part_bounds,
    short_sides,
    usual_options,
)
from kop_exudyn.fabrication.options import CutOptions
from kop_exudyn.fabrication.pieces import parts_list
from kop_exudyn.io.datasets import load_designs
from kop_exudyn.kit.cluster import cluster
from kop_exudyn.kit.parts import Kit
from kop_exudyn.search.objective import reference_of
from kop_exudyn.search.result import KitResult
from kop_exudyn.structures.base import design_from_dict


@pytest.fixture(scope="module")
def data(repository):
    path = repository / "models" / "small" / "03_exp.json"
    return json.loads(path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def design(data):
    return design_from_dict(data)


def test_the_joints_hole_is_the_sections_own(design, data):
    assert usual_options([design]).joint_hole == pytest.approx(3.0)
    plain = {key: value for key, value in data["section"].items() if key != "joint_hole"}
    assert usual_options([design_from_dict({**data, "section": plain})]) == CutOptions()


def test_inputs_keep_to_the_bounds_and_parts_outside_them_cannot_be_cut(design):
    bounds = part_bounds([design])
    shortest, sharpest = bounds["linear"][0][0], bounds["angular"][1]
    options = usual_options([design])
    found = cluster(design.groups, design.parameters, {"linear": 3, "angular": 2}, bounds=bounds)
    corner = np.full((2, 1), sharpest)
    for share, possible in ((1.001, True), (0.97, False)):
        sides = found.kit.parts["linear"].copy()
        sides[:, 0] = share * shortest
        kit = Kit({**found.kit.parts, "linear": sides, "angular": corner})
        blanks = Blanks(parts_list(kit, found.assignment, [design]), "m", options)
        assert (blanks.problems == ()) is possible
        if not possible:
            labels = {label for label, _ in blanks.problems_by_part}
            assert labels <= {"L1", "L2", "L3"} and "too short" in blanks.problems[0]


def test_what_a_side_needs_grows_with_corner_and_breadth():
    options = CutOptions()
    sides = [least_side(12.0, angle, 3.0, options) for angle in (0.0, 0.5, 1.0)]
    assert sides == sorted(sides) and sides[0] == pytest.approx(5 * options.bolt_hole + 1.5)
    assert least_side(30.0, 0.5, 3.0, options) > sides[1]
    assert least_side(30.0, 0.5, 3.0, CutOptions(corners=False)) == 1.5


def test_nothing_is_bounded_without_units_or_for_models_too_small(data):
    unnamed = {key: value for key, value in data.items() if key != "units"}
    assert part_bounds([design_from_dict(unnamed)]) == {}
    tiny = {**data, "units": {"length": "mm", "force": "N"}}
    assert set(part_bounds([design_from_dict(tiny)])) == {"angular"}


def test_problems_belong_to_the_designs_that_use_the_part(data, design):
    """One of two parts is too short: only the design that it serves is stopped."""
    other = design_from_dict({**data, "name": "other"})
    groups = [*design.groups, *(g.shifted(len(design.parameters)) for g in other.groups)]
    q = np.concatenate([design.parameters, other.parameters])
    found = cluster(groups, q, {"linear": 2, "angular": 1})
    sides = np.array([[0.005, 0.1], [0.1, 0.1]])
    own = [
        np.full(len(part), int(n >= len(design.groups)) if group.kind == "linear" else 0)
        for n, (group, part) in enumerate(zip(groups, found.assignment.part))
    ]
    chosen = replace(found.assignment, part=tuple(own))

    class Stage:
        kit, assignment = Kit({**found.kit.parts, "linear": sides}), chosen
        designs = (SimulationFailure("not looked for"),) * 2

    references = [reference_of(design), reference_of(other)]
    result = KitResult([design, other], references, {"assigned": Stage()})
    problems = cutting_problems(result)
    assert [bool(one) for one in problems] == [True, False]
    unknown = design_from_dict({key: value for key, value in data.items() if key != "units"})
    assert cutting_problems(KitResult([unknown], [], {"assigned": Stage()})) == [None]


def test_elements_that_no_part_can_be_as_short_as_are_counted(repository):
    """More parts don't help these: said before the search."""
    grids = load_designs(repository / "models" / "grids")
    bounds = part_bounds(grids)
    (text,) = short_sides(grids, bounds)
    least = bounds["linear"][0][0]
    sides = [
        design.parameters[group.indices].min(axis=1)
        for design in grids
        for group in design.groups
        if group.kind == "linear" and group.indices.shape[1] == 2
    ]
    share = np.mean(np.concatenate(sides) < least)
    assert text.startswith(f"{100 * share:.0f} % of the linear elements have a side shorter than")
    assert f"{1000 * least:.1f} mm" in text
    shells = load_designs(repository / "models" / "conformals", 3)
    assert short_sides(shells, part_bounds(shells)) == [] == short_sides(grids, {})
