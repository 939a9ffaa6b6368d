"""Grids whose joints are held in place."""

from __future__ import annotations

import numpy as np
import pytest
from support.grids import grid_data, isolines

from kop_exudyn.analysis.simulation import simulate
from kop_exudyn.equilibrium.newton import NewtonOptions
from kop_exudyn.errors import InputError, SimulationFailure
from kop_exudyn.search.objective import DesignObjective
from kop_exudyn.search.weights import Weights
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.loads import LoadCase

DOME = grid_data({"name": "paraboloid", "a": -0.2, "b": -0.2}, isolines(0.8, 5))


def test_a_dome_that_nothing_holds_closes_like_scissors_and_says_so(caplog):
    """Equal lines on a surface of equal curvatures shear without stretching."""
    result = simulate(design_from_dict(DOME))
    assert result.fit.max_percent < 1 and result.displaced_percent > 20
    assert "joints end up to" in caplog.text and "hardly resists that motion" in caplog.text


@pytest.mark.parametrize(
    "held, numbers", [("corners", [0, 4, 20, 24]), ([24, 0, 20], [0, 20, 24]), ("boundary", None)]
)
def test_held_joints_keep_a_dome_in_shape(held, numbers, caplog):
    design = design_from_dict(DOME | {"held": held})
    if numbers is None:
        outer = np.abs(design.network.joints).max(axis=1) > 0.79
        numbers = np.flatnonzero(outer)
        assert len(numbers) == 16
    np.testing.assert_array_equal(design.held, numbers)
    result = simulate(design)
    assert result.fit.max_percent < 0.01 and result.displaced_percent < 0.01 and not caplog.text
    places = result.deployed.state.positions[design.joints[design.held]]
    np.testing.assert_allclose(places, design.target.positions[design.held], rtol=0, atol=1e-12)
    sagging = simulate(design, LoadCase(joints=[12], forces=[[0, 0, -5.0]])).loaded
    np.testing.assert_array_equal(sagging.supports, numbers)


def test_sensitivities_of_a_held_grid():
    design = design_from_dict(DOME | {"held": "corners"})
    objective = DesignObjective(design, Weights(share=1.0))  # smooth, unlike facets
    rng = np.random.default_rng(2)
    q = design.parameters * (1 + 3e-3 * rng.uniform(-1, 1, len(design.parameters)))
    direction = design.parameters * rng.uniform(-1, 1, len(q))
    tight = NewtonOptions(max_iterations=100, tolerance=1e-13)
    at = objective.evaluate(q, options=tight)
    gradient = objective.derivatives(at).gradient
    h = 1e-6  # between held joints lengths act stiffly
    ahead, back = (objective.evaluate(q + s * h * direction, at, tight).value for s in (1, -1))
    assert (ahead - back) / (2 * h) == pytest.approx(gradient @ direction, rel=1e-5)


@pytest.mark.parametrize(
    "held, message",
    [
        ("edge", 'held = .edge.: must be "corners", "boundary" or a list'),
        ([0, 1, 25], "held = 25: names a joint that doesn't exist .joints 0 to 24"),
        ([0, 4], "held = .0, 4.: must have at least 3 entries"),
        ([-1, 4, 20], "held.0. = -1: must be at least 0"),
    ],
)
def test_joints_that_cant_be_held(held, message):
    with pytest.raises(InputError, match=message):
        design_from_dict(DOME | {"held": held})


def test_a_grid_that_finds_no_shape_is_told_of_held_joints():
    flat = grid_data({"name": "paraboloid", "a": -0.05, "b": -0.05}, isolines(0.8, 5))
    with pytest.raises(SimulationFailure, match='see the field "held"'):
        design_from_dict(flat).deploy()
