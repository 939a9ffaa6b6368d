"""Stress as a bound: the same stresses as reports have, with exact derivatives."""

from dataclasses import replace

import numpy as np
import pytest

from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.equilibrium.sensitivities import Sensitivities
from kop_exudyn.io.designs import load_design
from kop_exudyn.structures.strength import design_strength
from kop_exudyn.structures.stress_bound import NEAR, StressBound


@pytest.fixture(scope="module")
def shell(repository):
    return load_design(repository / "models" / "small" / "03_exp.json")


@pytest.fixture(scope="module")
def states(shell):
    generator = np.random.default_rng(1)
    q = shell.parameters * (1 + 0.01 * generator.standard_normal(len(shell.parameters)))
    return shell.deploy(q)


@pytest.mark.parametrize("role", ["deployed", "rest"])
def test_utilisation_is_that_of_reports(shell, states, role):
    bound = StressBound(shell, shell.scene(role))
    assert bound.known
    reported = design_strength(shell, states)[role].largest
    assert bound.utilisation(states[role]) == pytest.approx(reported, rel=1e-12)
    safe = StressBound(shell, shell.scene(role), safety=2.5)
    assert safe.utilisation(states[role]) == pytest.approx(2.5 * reported, rel=1e-12)


def test_cut_sections_and_grids_count_as_in_reports(repository):
    grid = load_design(repository / "models" / "grids" / "02_saddle.json")
    found = grid.deploy()
    bound = StressBound(grid, grid.scene("deployed"))
    reported = design_strength(grid, found)["deployed"].largest
    assert (reported or 0.0) == pytest.approx(bound.utilisation(found["deployed"]), rel=1e-12)


def remainders(shell, states, role, slope_error=0.0):
    """|u(q + h d) - u(q) - h u_q d| for halved h, of the largest utilisation."""
    safety = 1.1 / StressBound(shell, shell.scene(role)).utilisation(states[role])
    bound = StressBound(shell, shell.scene(role), safety)
    system, state = shell.systems[role], states[role]
    rows = bound.rows(Sensitivities(system, state))
    worst = int(np.argmax(rows.value))
    assert rows.value[worst] == pytest.approx(0.1, rel=1e-9)
    assert rows.value.min() > NEAR - 1
    direction = shell.parameters * np.random.default_rng(2).standard_normal(len(state.q))
    slope = (1 + slope_error) * float(rows.jacobian[worst] @ direction)
    out = []
    for h in 1e-4 * 0.5 ** np.arange(4):
        ahead = solve(system, state.q + h * direction, state, state.opening)
        out.append(abs(bound.utilisation(ahead) - bound.utilisation(state) - h * slope))
    return np.array(out)


@pytest.mark.parametrize("role", ["deployed", "rest"])
def test_rows_are_exact_to_first_order(shell, states, role):
    left = remainders(shell, states, role)
    assert np.log2(left[:-1] / left[1:]) == pytest.approx(2.0, abs=0.1)


def test_a_wrong_slope_is_seen(shell, states):
    left = remainders(shell, states, "deployed", slope_error=0.02)
    assert np.log2(left[:-1] / left[1:])[-1] < 1.5


def test_without_a_limit_nothing_is_bounded(repository):
    shell = load_design(repository / "models" / "small" / "01_sinh.json")
    shell.model = replace(shell.model, material=replace(shell.model.material, elastic_limit=None))
    bound = StressBound(shell, shell.scene("deployed"))
    assert not bound.known
