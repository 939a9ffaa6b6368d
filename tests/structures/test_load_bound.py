"""Load cases as bounds: against the check of a finished design, and their derivatives."""

import json
from dataclasses import replace

import numpy as np
import pytest
from support.grids import coarse_grid

from kop_exudyn.analysis.load_check import check_load
from kop_exudyn.equilibrium.sensitivities import Sensitivities
from kop_exudyn.errors import InputError
from kop_exudyn.search.objective import DesignObjective
from kop_exudyn.structures import load_bound, stress_bound
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.load_bound import GIVES_WAY, LoadBound, Rows

CASE = {
    "name": "snow",
    "gravity": [0, 0, -9.81],
    "points": [{"joint": 5, "force": [0, 0, -1.0]}],
    "factor": 1.5,
    "deflection": {"span_over": 200},
}
SOFT = {**CASE, "points": [{"joint": 5, "force": [0, 0, -0.05]}]}


def design(repository, file, case):
    path = repository / "models" / file
    if path.parent.name == "grids":  # a coarser one is as good
        data = coarse_grid(repository, path.stem)
    else:
        data = json.loads(path.read_text(encoding="utf-8"))
    return design_from_dict({**data, "load_cases": [case]})


@pytest.fixture(
    scope="module",
    params=[
        ("grids/05_free_form.json", CASE),
        ("small/03_exp.json", SOFT),
        ("umbrellas/dome.json", CASE),
    ],
    ids=["grid", "c_shell", "umbrella"],
)
def loaded(request, repository):
    """A design, its evaluation as given, and its load case as a bound."""
    own = design(repository, *request.param)
    objective = DesignObjective(own)
    given = objective.judge(own.parameters, dict(objective.reference.equilibria))
    state = given.equilibria[own.fitted_role.name]
    return own, objective, given, state, LoadBound(own, own.load_cases[0], state)


def test_it_agrees_with_the_check_of_a_finished_design(loaded):
    own, _, _, state, bound = loaded
    check = check_load(own, state, own.load_cases[0])
    used = bound.utilisation(state, bound.loaded(state))
    assert set(used) == {"snow, stress", "snow, deflection"} == set(bound.states)
    assert used["snow, stress"] == pytest.approx(check.utilisation, rel=1e-6)
    assert used["snow, deflection"] == pytest.approx(check.deflection / check.allowed, rel=1e-3)


def test_derivatives_are_exact_where_supports_move_along(loaded, monkeypatch):
    """What is left of a first-order prediction falls with the square of the step; not so where the
    supports are taken to stay."""
    monkeypatch.setattr(load_bound, "NEAR", -1.0)  # far from the limit as well
    monkeypatch.setattr(stress_bound, "NEAR", -1.0)
    own, objective, given, state, bound = loaded
    role = own.fitted_role.name
    sensitivities = Sensitivities(own.systems[role], state)
    states = bound.loaded(state)
    rows = bound.rows(sensitivities, states)
    monkeypatch.setattr(
        load_bound, "_chained", lambda jacobian, places: jacobian[:, : places.shape[1]]
    )
    wrong = bound.rows(sensitivities, states)
    step = np.random.default_rng(0).standard_normal(len(state.q))
    step *= 1e-3 * np.median(np.abs(state.q)) / np.abs(step).max()
    ends = []
    for t in (1.0, 0.5, 0.25):
        moved = objective.evaluate(state.q + t * step, given).equilibria[role]
        ends.append((t, bound.utilisation(moved, bound.loaded(moved))))

    def slopes(found: dict[str, Rows], name: str) -> np.ndarray:
        top = int(np.argmax(found[name].value))
        value, slope = found[name].value[top], found[name].jacobian[top] @ step
        missed = np.array([abs(used[name] - 1 - value - t * slope) for t, used in ends])
        return np.log2(missed[:-1] / missed[1:])

    assert set(rows) == {"snow, stress", "snow, deflection"}
    for name in rows:
        assert (slopes(rows, name) > 1.8).all()
    assert min(slopes(wrong, name).min() for name in wrong) < 1.3


def test_a_load_that_makes_it_give_way(repository):
    case = {"name": "snow", "points": [{"joint": 12, "force": [0, 0, -10]}], "factor": 3.0}
    data = coarse_grid(repository, "01_dome", 0)
    own = design_from_dict({**data, "load_cases": [case]})
    state = DesignObjective(own).reference.equilibria["deployed"]
    bound = LoadBound(own, own.load_cases[0], state)
    assert not check_load(own, state, own.load_cases[0]).stable
    assert bound.loaded(state) == {}
    assert set(bound.utilisation(state, {}).values()) == {GIVES_WAY}
    assert bound.rows(Sensitivities(own.systems["deployed"], state), {}) == {}


def test_what_cannot_be_looked_at_is_named(repository):
    own = design(repository, "small/03_exp.json", CASE)
    state = DesignObjective(own).reference.equilibria["deployed"]
    with pytest.raises(InputError, match="supports"):
        LoadBound(own, replace(own.load_cases[0], supports=[0, 1]), state)
