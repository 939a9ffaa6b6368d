"""One design fitted to its target by its own parameters."""

from __future__ import annotations

import numpy as np
import pytest

from kop_exudyn.errors import InputError
from kop_exudyn.search.input_fit import OwnProblem, fit_input
from kop_exudyn.search.objective import DesignObjective
from kop_exudyn.search.weights import Weights
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.umbrella.generator import (
    design_on_surface,
    height_field,
    parallelogram_patch,
)
from kop_exudyn.structures.umbrella.layout import BaseMesh

EDGE = 30 + 3 * np.sqrt(3)


@pytest.fixture(scope="module")
def design():
    vertices, faces = height_field(lambda x, y: (x**2 - y**2) / 500, 700.0, 20)
    return design_from_dict(
        design_on_surface("saddle", BaseMesh(*parallelogram_patch(2, 3, EDGE)), vertices, faces)
    )


@pytest.fixture(scope="module")
def fitted(design):
    return fit_input(design, Weights(fit=1e4, energy=0.1), upper=1.1 * design.parameters.max())


def test_the_input_comes_nearer_to_its_target_and_stays_within_bounds(design, fitted):
    before = DesignObjective(design).redeploy(design.parameters)
    assert fitted.fit.max_percent < 0.5 * before.fit.max_percent
    assert (fitted.q >= design.lower).all() and fitted.q.max() <= 1.1 * design.parameters.max() * (
        1 + 1e-12
    )
    assert fitted.confirmations["deployed"].moved < 1e-6


def test_it_ends_at_a_minimum(design, fitted):
    objective = DesignObjective(design, Weights(fit=1e4, energy=0.1))
    problem = OwnProblem(objective, upper=1.1 * design.parameters.max())
    gradient = problem.derivatives(problem.point(fitted)).gradient
    inside = (fitted.q > problem.lower + 1e-6) & (fitted.q < problem.upper - 1e-6)
    assert np.abs((gradient * problem.scale)[inside]).max() < 0.1 * fitted.value
    assert (gradient[fitted.q <= problem.lower + 1e-6] >= -1e-3).all()


def test_the_fitted_lengths_deploy_to_the_fitted_shape(design, fitted):
    objective = DesignObjective(design)
    again = objective.placed(objective.redeploy(fitted.q))
    assert again.fit.max_percent == pytest.approx(fitted.fit.max_percent, rel=1e-3)


def test_bounds_that_exclude_each_other_are_refused(design):
    with pytest.raises(InputError, match="bound"):
        fit_input(design, lower=40.0, upper=35.0)
