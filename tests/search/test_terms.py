"""The objective's terms: exact gradients, honest models, and one that is added from outside."""

from dataclasses import replace

import numpy as np
import pytest
from support.grids import coarse_grid
from support.settings import FEW_STEPS, QUICK

from kop_exudyn.equilibrium.newton import NewtonOptions
from kop_exudyn.equilibrium.sensitivities import Sensitivities
from kop_exudyn.errors import InputError
from kop_exudyn.io.designs import load_design
from kop_exudyn.search.objective import DesignObjective
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings
from kop_exudyn.search.terms import base, stress
from kop_exudyn.search.weights import Weights
from kop_exudyn.structures.base import design_from_dict

TIGHT = NewtonOptions(max_iterations=80, tolerance=1e-13)


@pytest.fixture(params=["c_shell", "grid", "umbrella"])
def design(request, repository, c_shell_data):
    if request.param == "c_shell":
        return design_from_dict(c_shell_data, "grid")
    model = {"grid": "grids/01_dome.json", "umbrella": "umbrellas/hill.json"}[request.param]
    return load_design(repository / "models" / model)


@pytest.mark.parametrize(
    "weights",
    [
        Weights(fit=1e4, energy=0),
        Weights(fit=0, energy=1),
        Weights(fit=0, energy=0, others=(("stress", 1.0),)),
    ],
    ids=["fit", "energy", "stress"],
)
def test_gradient_by_taylor(design, weights):
    objective = DesignObjective(design, weights)
    rng = np.random.default_rng(1)
    q = design.parameters * (1 + 0.01 * rng.uniform(-1, 1, len(design.parameters)))
    at = objective.evaluate(q, options=TIGHT)
    found = objective.derivatives(at)
    direction = np.abs(design.parameters) * rng.uniform(-1, 1, len(q))
    steps = 2.0 ** -np.arange(7, 11)
    remainders = [
        abs(
            objective.evaluate(q + h * direction, at, TIGHT).value
            - at.value
            - h * (found.gradient @ direction)
        )
        for h in steps
    ]
    slopes = np.diff(np.log(remainders)) / np.diff(np.log(steps))
    assert slopes[-1] == pytest.approx(2, abs=0.25), remainders
    by_adjoint = objective.derivatives(at, hessian=False)
    assert by_adjoint.hessian is None
    np.testing.assert_allclose(
        by_adjoint.gradient, found.gradient, rtol=0, atol=1e-7 * np.abs(found.gradient).max()
    )
    assert (
        np.linalg.eigvalsh(found.model).min() >= -1e-9 * np.abs(found.model).max() or weights.energy
    )


def test_model_of_the_stress_is_gauss_newtons(design):
    """But for the rows that carry next to nothing: against all rows, summed up one by one."""
    objective = DesignObjective(design, Weights(fit=0, energy=0, others=(("stress", 1.0),)))
    rng = np.random.default_rng(2)
    q = design.parameters * (1 + 0.01 * rng.uniform(-1, 1, len(design.parameters)))
    at = objective.evaluate(q, options=TIGHT)
    found = objective.derivatives(at).model
    term = stress.Stress(design, objective.reference)
    whole = np.zeros_like(found)
    for role in design.roles:
        sensitivities = Sensitivities(design.systems[role.name], at.equilibria[role.name])
        rows = sensitivities.stresses
        slope, diagonal, along, less = term._by_stress(role, at.equilibria[role.name])
        by_q = np.einsum("er,erq->q", slope, rows)
        across = np.einsum("er,erq->eq", along, rows)
        whole += np.einsum("erq,er,erp->qp", rows, diagonal, rows, optimize=True)
        whole += across.T @ across - less * np.outer(by_q, by_q)
    off = np.linalg.norm(found - whole, 2) / np.linalg.norm(whole, 2)
    assert off < 5e-3
    assert np.linalg.eigvalsh(found).min() >= -1e-9 * np.abs(found).max()
    assert np.linalg.norm(0.97 * whole - whole, 2) / np.linalg.norm(whole, 2) > 5 * off  # control


def test_weights_by_name():
    weights = Weights.of({"energy": 0.1, "stress": 2.0})
    assert weights.to_dict() == {"fit": 1e4, "energy": 0.1, "share": 0.1, "stress": 2.0}
    assert Weights.of(weights.to_dict()) == weights
    with pytest.raises(
        InputError, match="weights = 'beauty'.*known: fit, energy, compliance, deflection, stress"
    ):
        Weights.of({"beauty": 1.0})
    with pytest.raises(InputError, match=r"weights\.stress.*nan"):
        Weights.of({"stress": float("nan")})


def coarse(repository, name):
    """Every second curve of a grid of models/grids, with one element a piece."""
    return design_from_dict(coarse_grid(repository, name) | {"elements_per_piece": 1})


def test_more_weight_on_stress_lowers_it(repository):
    """And the kit is found with that term as with the others."""
    designs = [coarse(repository, "03_enneper")]
    stresses = []
    for weight in (0.0, 0.3):
        settings = JobSettings(
            Weights(fit=1e4, energy=0.0, others=(("stress", weight),)),
            jobs=1,
            baselines=False,
            stages=FEW_STEPS,
        )
        outcome = optimize_kit(designs, {"linear": 3, "angular": 2}, settings=settings)
        judge = [
            DesignObjective(d, Weights(others=(("stress", 1.0),)), r)
            for d, r in zip(designs, outcome.references)
        ]
        found = [
            j.judge(e.q, dict(e.equilibria)).terms["stress deployed"]
            for j, e in zip(judge, outcome.stages["assigned"].designs)
        ]
        stresses.append(sum(found))
    assert stresses[1] < 0.97 * stresses[0]


def test_stress_needs_cross_sections(repository):
    design = load_design(repository / "models" / "grids" / "01_dome.json")
    scene = design.scene("deployed")
    bare = replace(scene, chains=tuple(replace(chain, section=None) for chain in scene.chains))
    design.scene = lambda role: bare
    with pytest.raises(
        InputError, match="dome: weights.stress: the rods' cross-sections aren't known"
    ):
        DesignObjective(design, Weights.of({"stress": 1.0}))


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_term_is_one_class(repository, monkeypatch, jobs):
    """A term from outside the package, in this process and in others: the sum of all rest lengths
    that a design needs, over the input's."""
    monkeypatch.setattr(base.TERMS, "items", dict(base.TERMS.items))

    @base.register_term
    class Material(base.Term):
        name = "material"

        def sees(self, role):
            return role.fitted

        def value(self, role, equilibrium, fit):
            return self._used(equilibrium.q) / self._used(self.design.parameters)

        def gradient(self, role, sensitivities, fit):
            indices = np.concatenate(
                [g.indices.ravel() for g in self.design.groups if g.kind == "linear"]
            )
            return np.isin(np.arange(len(self.design.parameters)), indices) / self._used(
                self.design.parameters
            )

        def model(self, role, sensitivities, fit):
            gradient = self.gradient(role, sensitivities, fit)
            return gradient, np.zeros((len(gradient),) * 2)

        def _used(self, q):
            return sum(q[g.indices].sum() for g in self.design.groups if g.kind == "linear")

    designs = [coarse(repository, "01_dome") for _ in range(jobs)]
    designs[-1].name = "the last one"
    settings = JobSettings(
        Weights.of({"material": 20.0}),
        jobs=jobs,
        baselines=False,
        stages=replace(
            QUICK,
            schedule=(1e3,),
            reassignments=0,
            relaxed_steps=3,
            assigned_steps=3,
            redeployments=0,
        ),
    )
    outcome = optimize_kit(designs, {"linear": 2, "angular": 2}, settings=settings)
    evaluation = outcome.stages["assigned"].designs[0]
    assert 0 < evaluation.terms["material deployed"] < 20.0  # what gives, shrinks
    assert evaluation.confirmations
