"""The terms that make designs stiffer: against the check of a finished design, their
derivatives, and what they do to a kit."""

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
from kop_exudyn.structures.load_bound import LoadBound
from kop_exudyn.structures.loading import loaded_state, supports_of
from kop_exudyn.structures.strength import material_values, materials_of

TIGHT = NewtonOptions(max_iterations=80, tolerance=1e-13)
ONLY = Weights(fit=0, energy=0, others=(("deflection", 1.0),))
COMPLIANCE = Weights(fit=0, energy=0, others=(("compliance", 1.0),))
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
def design(request, repository):
    return loaded(repository, request.param, OWN_WEIGHT, PUSH)


@pytest.fixture(scope="module")
def objective(design):
    return DesignObjective(design, ONLY)


@pytest.fixture(scope="module")
def compliance(design):
    return DesignObjective(design, COMPLIANCE)


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


def test_the_works_gradient_is_exact_where_supports_move_along(compliance, monkeypatch):
    assert compliance.judge(
        compliance.design.parameters, dict(compliance.reference.equilibria)
    ).value == pytest.approx(1.0)
    slope, at, own = remainders(compliance)
    assert slope > 1.8
    model = compliance.derivatives(at)
    np.testing.assert_allclose(model.gradient, own, rtol=0, atol=1e-9 * np.abs(own).max())
    assert np.linalg.eigvalsh(model.model).min() >= -1e-9 * np.abs(model.model).max()
    # supports that are taken to stay where they are: the prediction is of first order only
    exact = LoadBound.work_adjoint
    monkeypatch.setattr(
        LoadBound,
        "work_adjoint",
        lambda self, own, *rest: exact(self, HeldInPlace(own, self._moved), *rest),
    )
    wrong, _, _ = remainders(compliance, lambda at: compliance.derivatives(at).gradient)
    assert wrong < 1.5


class HeldInPlace:
    """Sensitivities in which some unknowns don't follow the elements."""

    def __init__(self, own, held):
        self.equilibrium, self.held, self.own = own.equilibrium, held, own
        self.rows = own.rows

    def adjoint(self, dofs, load):
        found = self.own.adjoint(dofs, load)
        return 0 * found if np.array_equal(dofs, self.held) else found


def test_compliance_is_force_times_movement(compliance):
    """Force times movement, by what `kop simulate` uses."""
    design, q = compliance.design, compliance.design.parameters
    rng = np.random.default_rng(3)
    other = compliance.evaluate(q * (1 + 0.01 * rng.uniform(-1, 1, len(q))))
    unloaded = (compliance.reference.equilibria["deployed"], other.equilibria["deployed"])
    works = []
    for case in design.load_cases:
        held = replace(case, supports=supports_of(design, unloaded[0], case))
        works.append([work_of(design, state, held) for state in unloaded])
    ratios = [after / before for before, after in works]
    assert other.value == pytest.approx(np.mean(ratios), rel=1e-6)
    assert abs(other.value - 1) > 1e-4


def work_of(design, unloaded, case):
    """f.u of forces on joints, and of the rods' weight at the middles of their elements."""
    scene = design.scene("deployed")
    there = loaded_state(design, unloaded, case).equilibrium
    x0, x1 = (scene.node_poses(one.state)[0] for one in (unloaded, there))
    moved = (there.state.positions - unloaded.state.positions)[design.joints[case.joints]]
    found = float((case.forces * moved).sum())
    if case.gravity is not None:
        materials = materials_of(design)
        densities = material_values(scene, materials, "density")
        stiffest = max(materials, key=lambda material: material.young)
        lengths = scene.rest_lengths(unloaded.q)
        for chain in scene.chains:
            own, area = chain.elements, chain.section.area
            if len(own):
                middle = (x1 - x0)[scene.elements[own]].mean(axis=1)
                found += float(densities[own] * area * lengths[own] @ middle @ case.gravity)
            else:  # a piece that doesn't bend, which is of the stiffest material
                ends = chain.nodes[[0, -1]]
                mass = stiffest.density * area * np.linalg.norm(np.diff(x0[ends], axis=0))
                found += float(mass * (x1 - x0)[ends].mean(axis=0) @ case.gravity)
    return found


def test_designs_without_loads_have_none(repository):
    design = loaded(repository, "grids/05_free_form.json")
    objective = DesignObjective(design, Weights(others=(("deflection", 1.0),)))
    at = objective.judge(design.parameters, dict(objective.reference.equilibria))
    assert set(at.terms) == {"fit", "energy deployed"}


def test_an_input_that_gives_way_is_refused(repository):
    push = {"name": "crush", "points": [{"joint": 5, "force": [0, 0, -1e9]}]}
    design = loaded(repository, "grids/05_free_form.json", push)
    for weights in (ONLY, COMPLIANCE):
        name = weights.others[0][0]
        with pytest.raises(InputError, match=rf"weights\.{name}.*gives way under 'crush'"):
            DesignObjective(design, weights)


@pytest.mark.parametrize("term", ["deflection", "compliance"])
def test_its_weight_makes_kits_stiffer(repository, term):
    designs = [
        loaded(repository, f"grids/{name}.json", OWN_WEIGHT) for name in ("01_dome", "05_free_form")
    ]
    found = []
    for weight in (0.0, 2.0):
        settings = JobSettings(
            Weights(others=((term, weight),)),
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
