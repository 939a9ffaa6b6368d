"""The term that makes designs stiffer: against the check of a finished design, its derivatives, and
what it does to a kit."""

import json
from dataclasses import replace

import numpy as np
import pytest
from support.grids import coarse_grid
from support.settings import FEW_STEPS

from kop_exudyn.analysis.load_check import check_load
from kop_exudyn.equilibrium.newton import NewtonOptions
from kop_exudyn.errors import InputError
from kop_exudyn.search.objective import DesignObjective
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings
from kop_exudyn.search.weights import Weights
from kop_exudyn.structures import load_bound
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.loading import loaded_state, supports_of

TIGHT = NewtonOptions(max_iterations=80, tolerance=1e-13)
ONLY = Weights(fit=0, energy=0, others=(("deflection", 1.0),))
OWN_WEIGHT = {"name": "own weight", "gravity": [0, 0, -9.81]}
PUSH = {"name": "push", "points": [{"joint": 5, "force": [0.02, 0, -0.05]}], "factor": 1.5}


def loaded(repository, file, *cases):
    path = repository / "models" / file
    if path.parent.name == "grids":
        data = coarse_grid(repository, path.stem)
    else:
        data = json.loads(path.read_text(encoding="utf-8"))
    return design_from_dict({**data, "load_cases": list(cases)})


@pytest.fixture(
    scope="module",
    params=["grids/05_free_form.json", "small/03_exp.json", "umbrellas/dome.json"],
    ids=["grid", "c_shell", "umbrella"],
)
def objective(request, repository):
    return DesignObjective(loaded(repository, request.param, OWN_WEIGHT, PUSH), ONLY)


def remainders(objective, gradient=None):
    """Of first-order predictions over halved steps, with the slope of the last halving."""
    q = objective.design.parameters
    rng = np.random.default_rng(2)
    at = objective.evaluate(q * (1 + 0.003 * rng.uniform(-1, 1, len(q))), options=TIGHT)
    own = objective.derivatives(at, hessian=False).gradient
    used = own if gradient is None else gradient(at)
    direction = 0.1 * np.abs(q) * rng.uniform(-1, 1, len(q))
    left = [
        abs(
            objective.evaluate(at.q + h * direction, at, TIGHT).value
            - at.value
            - h * (used @ direction)
        )
        for h in (2.0**-6, 2.0**-7, 2.0**-8)
    ]
    return np.log2(left[-2] / left[-1]), at, own


def test_the_input_design_is_the_measure(objective):
    start = objective.reference.equilibria
    at = objective.judge(objective.design.parameters, dict(start))
    assert at.value == pytest.approx(1.0) and set(at.terms) == {"deflection deployed"}


def test_its_gradient_is_exact_where_supports_move_along(objective, monkeypatch):
    slope, at, own = remainders(objective)
    assert slope > 1.8
    model = objective.derivatives(at)
    np.testing.assert_allclose(model.gradient, own, rtol=0, atol=1e-6 * np.abs(own).max())
    assert np.linalg.eigvalsh(model.model).min() >= -1e-9 * np.abs(model.model).max()
    # supports that are taken to stay where they are: the prediction is of first order only
    monkeypatch.setattr(
        load_bound, "_chained", lambda jacobian, places: jacobian[:, : places.shape[1]]
    )
    wrong, _, _ = remainders(objective, lambda at: objective.derivatives(at).gradient)
    assert wrong < 1.5


def test_it_is_what_a_finished_design_does_under_its_loads(objective):
    """Solved for from its supports on, by what `kop simulate` and the verdict use."""
    design, q = objective.design, objective.design.parameters
    rng = np.random.default_rng(3)
    other = objective.evaluate(q * (1 + 0.01 * rng.uniform(-1, 1, len(q))))
    unloaded = (objective.reference.equilibria["deployed"], other.equilibria["deployed"])
    bodies = np.unique(design.scene("deployed").node_body)
    ratios = []
    for case in design.load_cases:
        held = replace(case, supports=supports_of(design, unloaded[0], case))
        moved = [
            loaded_state(design, one, held).equilibrium.state.positions - one.state.positions
            for one in unloaded
        ]
        before, after = (float((m[bodies] ** 2).sum()) for m in moved)
        ratios.append(after / before)
    assert other.value == pytest.approx(np.mean(ratios), rel=1e-4)
    assert abs(other.value - 1) > 1e-3


def test_designs_without_loads_have_none(repository):
    design = loaded(repository, "grids/05_free_form.json")
    objective = DesignObjective(design, Weights(others=(("deflection", 1.0),)))
    at = objective.judge(design.parameters, dict(objective.reference.equilibria))
    assert set(at.terms) == {"fit", "energy deployed"}


def test_an_input_that_gives_way_is_refused(repository):
    push = {"name": "crush", "points": [{"joint": 5, "force": [0, 0, -1e9]}]}
    design = loaded(repository, "grids/05_free_form.json", push)
    with pytest.raises(InputError, match=r"weights\.deflection.*gives way under 'crush'"):
        DesignObjective(design, ONLY)


def test_its_weight_makes_kits_stiffer(repository):
    designs = [
        loaded(repository, f"grids/{name}.json", OWN_WEIGHT) for name in ("01_dome", "05_free_form")
    ]
    found = []
    for weight in (0.0, 2.0):
        settings = JobSettings(
            Weights(others=(("deflection", weight),)),
            jobs=1,
            baselines=False,
            stages=FEW_STEPS,
        )
        outcome = optimize_kit(designs, {"linear": 4, "angular": 3}, settings=settings)
        found.append(
            sum(
                check_load(d, e.equilibria["deployed"], d.load_cases[0]).deflection
                for d, e in zip(designs, outcome.stages["assigned"].designs)
            )
        )
    assert found[1] < 0.95 * found[0]
