"""What a scene, a trial or an objective doesn't need isn't done: calls are counted."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.equilibrium.sensitivities import Sensitivities
from kop_exudyn.equilibrium.system import System
from kop_exudyn.io.designs import load_design
from kop_exudyn.kit.cluster import cluster
from kop_exudyn.kit.projection import Projection
from kop_exudyn.search import objective
from kop_exudyn.search.dataset import Dataset
from kop_exudyn.search.objective import DesignObjective
from kop_exudyn.search.pool import DesignPool
from kop_exudyn.search.problems import RelaxedProblem
from kop_exudyn.search.weights import Weights
from kop_exudyn.sqp.options import SQPOptions
from kop_exudyn.sqp.solver import minimise
from kop_exudyn.structures.base import design_from_dict

COUNTED = [
    (System, "assemble"),
    (System, "factorise"),
    (System, "solve"),
    (System, "solve_columns"),
    (Sensitivities, "adjoint"),
    (Sensitivities, "rows"),
    (objective, "confirm"),
    (objective, "solve"),
]


@pytest.fixture
def calls(monkeypatch) -> Counter:
    """Calls of the functions that cost, by name; `equilibria` is a solve of a state."""
    count: Counter = Counter()

    def counted(name, function):
        def call(*arguments, **options):
            count[name] += 1
            return function(*arguments, **options)

        return call

    for owner, name in COUNTED:
        label = "equilibria" if (owner, name) == (objective, "solve") else name
        monkeypatch.setattr(owner, name, counted(label, getattr(owner, name)))
    return count


@pytest.fixture
def shell(c_shell_data):
    return design_from_dict(c_shell_data, "grid")


@pytest.fixture
def grid(repository):
    return load_design(repository / "models" / "grids" / "01_dome.json")


def changed(design, share=1e-3):
    return design.parameters * (
        1 + share * np.random.default_rng(0).uniform(-1, 1, len(design.parameters))
    )


def test_no_rest_state_without_actuation(grid, shell, calls):
    for design, states in ((grid, 1), (shell, 2)):
        problem = DesignObjective(design)
        calls.clear()
        assert set(problem.evaluate(changed(design)).equilibria) == {
            role.name for role in design.roles
        }
        assert calls["equilibria"] == states


def test_no_bordered_system_without_an_angle_constraint(grid, shell, calls):
    equilibrium = solve(System(grid.scene("deployed")), changed(grid))
    # one more looks for a mode without stiffness in the end
    assert calls["solve"] == equilibrium.iterations + 1
    calls.clear()
    rest = next(role for role in shell.roles if not role.fitted)
    equilibrium = solve(System(shell.scene(rest.name)), changed(shell), opening=rest.opening)
    assert calls["solve"] > equilibrium.iterations + 1  # the border is a second right-hand side


def test_no_sensitivities_and_no_exudyn_in_a_line_search(shell, calls):
    problem = DesignObjective(shell)
    calls.clear()
    problem.evaluate(changed(shell))
    assert calls["equilibria"] == 2
    assert calls["solve_columns"] == calls["rows"] == calls["adjoint"] == calls["confirm"] == 0


def test_no_solve_of_an_unchanged_design(shell, calls):
    problem = DesignObjective(shell)
    before = problem.evaluate(changed(shell))
    calls.clear()
    again = problem.evaluate(before.q, before)
    assert not calls and again.value == before.value and again.iterations == 0


def test_no_terms_of_weight_zero(shell, calls):
    for weights, expected in ((Weights(fit=0.0), 0), (Weights(energy=0.0), 1)):
        problem = DesignObjective(shell, weights)
        evaluation = problem.confirm(problem.evaluate(changed(shell)))
        calls.clear()
        problem.derivatives(evaluation)
        # joints' derivatives for the fit; both states' columns for the energies, the fitted state's
        # for the fit
        assert calls["rows"] == expected and calls["solve_columns"] == 2 - expected
        assert calls["factorise"] <= 2 - expected
        assert set(evaluation.terms) == (
            {"fit"} if weights.fit else {"energy deployed", "energy rest"}
        )


def test_no_second_order_terms_where_only_a_gradient_is_asked(shell, calls):
    problem = DesignObjective(shell)
    evaluation = problem.confirm(problem.evaluate(changed(shell)))
    calls.clear()
    first = problem.derivatives(evaluation, hessian=False)
    assert (
        first.hessian is None
        and calls["solve_columns"] == calls["rows"] == 0
        and calls["adjoint"] == 1
    )
    full = problem.derivatives(evaluation)
    np.testing.assert_allclose(
        first.gradient, full.gradient, rtol=1e-6, atol=1e-9 * np.abs(full.gradient).max()
    )
    assert calls["solve_columns"] == 2


@pytest.mark.parametrize("hessian", ["exact", "bfgs"])
def test_derivatives_at_accepted_points_only(shell, calls, hessian):
    """Rejected trials aren't differentiated; BFGS asks for gradients alone. Exudyn confirms what an
    optimisation leaves, not its steps."""
    with DesignPool([shell], 1) as pool:
        pool.prepare()
        dataset = Dataset.of_pool(pool, Weights())
        kit = cluster(dataset.groups, dataset.parameters, {"linear": 2, "angular": 1}).kit
        projection = Projection.of_inputs(dataset.groups, dataset.parameters).with_weight(1e4)
        problem = RelaxedProblem(dataset, projection, kit)
        start = problem.evaluate(changed(shell, 0.05), None)
        calls.clear()
        # hardly any trial gains what is asked for here, so that some are refused
        result = minimise(
            problem, start.x, SQPOptions(hessian=hessian, max_steps=3, accept=0.9), start=start
        )
    kept = 1 + result.steps
    assert result.evaluations > result.steps
    assert calls["confirm"] == 0
    assert calls["solve_columns"] == (2 * kept if hessian == "exact" else 0)
    assert calls["adjoint"] == (0 if hessian == "exact" else kept)
