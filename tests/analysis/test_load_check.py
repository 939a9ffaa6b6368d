"""Load cases: the critical factor against the arc-length path, limits on deflection, and the
thickness that carries a load."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from support.grids import coarse_grid

from kop_exudyn.analysis.load_check import carrying_thickness, check_load, critical_factor
from kop_exudyn.analysis.mending import about_loads
from kop_exudyn.equilibrium.path import PathOptions, trace_path
from kop_exudyn.errors import InputError
from kop_exudyn.scene.loads import DeadForces
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.loading import held_scene
from kop_exudyn.structures.loads import DeflectionLimit, LoadCase

CORNERS = [0, 4, 20, 24]
MIDDLE = 12


@pytest.fixture(scope="module")
def data(repository):
    """A dome of five lamellas each way."""
    return coarse_grid(repository, "01_dome", 0)


@pytest.fixture(scope="module")
def dome(data):
    return design_from_dict(data)


@pytest.fixture(scope="module")
def opened(dome):
    return dome.deploy()["deployed"]


def pushed(force: float, **more) -> LoadCase:
    return LoadCase(joints=[MIDDLE], forces=[[0, 0, -force]], supports=CORNERS, **more)


@pytest.fixture(scope="module")
def first_bifurcation(dome, opened):
    """The factor of a unit load at which the arc-length path first meets a singular stiffness."""
    _, held = held_scene(dome, opened, pushed(1.0))
    path = trace_path(
        held,
        opened.q,
        DeadForces(dome.joints[[MIDDLE]], [[0, 0, -1.0]]),
        start=opened,
        stop=lambda point: point.negative > 0,
        options=PathOptions(rotation=0.05),
    )
    return path.critical[0].point.factor


def test_the_critical_factor_is_that_of_the_path(dome, opened, first_bifurcation):
    """It is a lower bound, a sixty-fourth of itself below at most, however small."""
    asked = 10.0
    case = pushed(1.0, factor=asked)
    found = critical_factor(dome, opened, case, 4 * asked)
    assert (1 - 1 / 64) * first_bifurcation <= found <= first_bifurcation
    hardly = critical_factor(dome, opened, pushed(1e4, factor=asked), 4 * asked)
    assert 1e-4 * found * (1 - 1 / 32) <= hardly <= 1e-4 * first_bifurcation
    check = check_load(dome, opened, case)
    assert check.stable and not check.beyond and check.critical == pytest.approx(found)


def test_more_than_it_bears(dome, opened, first_bifurcation):
    check = check_load(dome, opened, pushed(1.0, factor=1.2 * first_bifurcation))
    assert not check.stable and not check.carried() and check.factored is None
    assert check.critical == pytest.approx(first_bifurcation, rel=0.03)
    # the load itself is borne, so its deflection is known
    assert check.loaded is not None and check.deflection > 0
    told = check.to_dict()
    assert told["stable"] is False and told["utilisation"] is None


def test_looking_no_further_than_twice_the_factor(dome, opened):
    check = check_load(dome, opened, pushed(1.0))
    assert check.carried() and check.beyond and check.critical == 2.0


def test_limits_on_the_deflection(dome, opened):
    check, given = check_load(dome, opened, pushed(1.0)), pushed(1.0)
    moved, span = check.deflection, check.span
    x = opened.state.positions[dome.joints]
    assert span == pytest.approx(np.linalg.norm(x[0] - x[24]))
    for limit, kept in (
        (DeflectionLimit(absolute=1.01 * moved), True),
        (DeflectionLimit(absolute=0.99 * moved), False),
        # a search that keeps to the limit may end on it, but for rounding
        (DeflectionLimit(absolute=moved * (1 - 2e-9)), True),
        (DeflectionLimit(absolute=moved * (1 - 1e-5)), False),
        (DeflectionLimit(span_over=0.99 * span / moved), True),
        (DeflectionLimit(span_over=1.01 * span / moved), False),
        (DeflectionLimit(absolute=1.01 * moved, span_over=1.01 * span / moved), False),
    ):
        limited = replace(check, case=replace(given, deflection=limit))
        assert limited.carried() is kept
    case = pushed(1.0, deflection=DeflectionLimit(absolute=0.99 * moved))
    assert not check_load(dome, opened, case).carried()


def test_stress_may_end_on_its_limit_but_for_rounding(dome, opened):
    """What the search brings to its bound is carried; what is a little beyond it is told so that
    the numbers differ."""
    check = check_load(dome, opened, pushed(1.0))
    safety = (1 + 3e-10) / check.utilisation
    assert check.carried(safety) and about_loads(dome, opened, [check], safety) == []
    safety = (1 + 1e-5) / check.utilisation
    (told,) = about_loads(dome, opened, [check], safety)
    assert not check.carried(safety) and "to 100.001 % of its elastic limit" in told.why


def test_a_deflection_just_beyond_its_limit_is_told_apart(dome, opened):
    check = check_load(dome, opened, pushed(1.0))
    limit = DeflectionLimit(absolute=check.deflection * (1 - 1e-4))
    check = check_load(dome, opened, pushed(1.0, deflection=limit))
    (stop,) = about_loads(dome, opened, [check])
    moved, allowed = re.search(r"deflects by (\S+) .*?\((\S+) ", stop.why).groups()
    assert moved != allowed


def test_the_thickness_that_carries_a_load_carries_it(data, dome, opened, first_bifurcation):
    case = pushed(1.0, factor=1.5 * first_bifurcation)
    found = carrying_thickness(dome, opened, case)
    assert found is not None
    share, used = found
    assert 1 < share < 3 and 0 < used < 1
    for thickness, carries in ((share, True), (0.8 * share, False)):
        section = {**data["section"], "width": thickness * data["section"]["width"]}
        other = design_from_dict({**data, "section": section})
        check = check_load(other, other.deploy()["deployed"], case)
        assert check.stable is carries


def test_no_thickness_carries_everything(dome, opened):
    limit = DeflectionLimit(absolute=1e-9)
    assert carrying_thickness(dome, opened, pushed(1.0, deflection=limit)) is None


class TestFiles:
    def test_cases_with_factors_limits_and_supports(self, data):
        cases = [
            {"name": "own weight", "gravity": [0, 0, -9.81], "factor": 1.35},
            {
                "points": [{"joint": 3, "force": [0, 0, -2]}],
                "supports": [1, 2, 20],
                "deflection": {"span_over": 200},
            },
        ]
        design = design_from_dict({**data, "supports": CORNERS, "load_cases": cases})
        first, second = design.load_cases
        assert (first.name, first.factor, first.supports.tolist()) == ("own weight", 1.35, CORNERS)
        assert second.name == "case 2" and second.supports.tolist() == [1, 2, 20]
        assert second.deflection.allowed(4.0) == pytest.approx(0.02)
        assert first.deflection.allowed(4.0) == np.inf
        assert first.times(2.0).gravity.tolist() == [0, 0, -19.62]

    def test_the_field_loads_is_a_case(self, data):
        design = design_from_dict({**data, "loads": {"gravity": [0, 0, -9.81], "factor": 2}})
        assert [(case.name, case.factor) for case in design.load_cases] == [("loads", 2.0)]

    def test_supports_alone_are_no_case(self, data):
        design = design_from_dict({**data, "supports": CORNERS})
        assert design.load_cases == () and design.loads.supports.tolist() == CORNERS

    @pytest.mark.parametrize(
        "cases, field",
        [
            ([{"gravity": [0, 0, -1], "name": "a"}] * 2, r"load_cases\[1\].name"),
            ([{"factor": 2.0}], r"load_cases\[0\]"),
            ([{"points": [{"joint": 25, "force": [0, 0, 1]}]}], "joint"),
        ],
    )
    def test_unusable_cases(self, data, cases, field):
        with pytest.raises(InputError, match=field):
            design_from_dict({**data, "load_cases": cases})

    @pytest.mark.parametrize("factor", [0.0, -1.0, np.nan])
    def test_factors_are_positive(self, factor):
        with pytest.raises(InputError, match="factor"):
            LoadCase(factor=factor)
        with pytest.raises(InputError, match="absolute"):
            DeflectionLimit(absolute=factor)
