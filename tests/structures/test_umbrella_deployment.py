"""Umbrella meshes that are hard to open: within their joints' limits, along one path."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np
import pytest
from support.umbrellas import make

from kop_exudyn.analysis.simulation import simulate
from kop_exudyn.equilibrium.newton import refine, solve
from kop_exudyn.equilibrium.sensitivities import Sensitivities
from kop_exudyn.errors import SimulationFailure
from kop_exudyn.rods.rotations import exp_so3
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.fitting import best_placement
from kop_exudyn.structures.umbrella.deployment import Deployment, Stage, follow

PRESSED = np.radians(4)  # beyond a limit that a joint is pressed on, at most


def within_limits(design, state) -> bool:
    crossing = np.isin(np.flatnonzero(design.mesh.hinged), design.mesh.crossings)
    upper = np.where(crossing, np.pi, np.pi / 2)
    return bool(((state.angles > -PRESSED) & (state.angles < upper + PRESSED)).all())


@pytest.fixture(scope="module", params=["cap", "tight", "equal"])
def case(request):
    design = design_from_dict(make(request.param))
    return design, design.deploy()["deployed"]


def test_joints_stay_within_their_limits(case):
    """Without limits joints end between -293 and 146 degrees (cap), T joints at 115 (tight)."""
    design, eq = case
    assert eq.stable and eq.escapes == 0
    assert within_limits(design, eq.state)


def test_the_path_leads_to_the_same_state_in_smaller_steps(case):
    design, eq = case
    finer = design_from_dict(make(design.name))
    finer.deployment = replace(finer.deployment, stages=9)
    other = finer.deploy()["deployed"]
    moved = np.abs(other.state.positions - eq.state.positions).max()
    assert moved < 1e-6 * design.mesh.size


def test_gradients_with_limits_pressed():
    """Taylor remainders of the elastic energy fall with the second order; those of a gradient
    that is wrong by a tenth don't."""
    design = design_from_dict(make("tight"))
    eq = refine(design.systems["deployed"], design.deploy()["deployed"])
    system, q = design.systems["deployed"], design.parameters
    limits = design.model.limits
    assert limits.touched(eq.state).any()
    slope = Sensitivities(system, eq).energy_gradient
    rng = np.random.default_rng(1)
    direction = rng.normal(size=len(q))
    steps = 2.0 ** -np.arange(5, 9) * 0.01
    values = []
    for h in steps:
        near = solve(system, q + h * direction, eq)
        values.append(refine(system, near).elastic_energy - eq.elastic_energy)
    for factor, order in ((1.0, 2.0), (1.1, 1.0)):
        left = np.abs(np.array(values) - factor * steps * (slope @ direction))
        assert np.polyfit(np.log(steps), np.log(left), 1)[0] == pytest.approx(order, abs=0.3)


def test_a_target_that_lies_elsewhere_is_met_where_it_lies():
    """The compact mesh starts as near to its target as it can, turned and moved by any amount."""
    data = make("cap")
    design = design_from_dict(data)
    turn = exp_so3(np.array([[1.0, -2.0, 1.5]]))[0]
    for field in ("vertices", "crossings", "plates"):
        points = np.array(data["target"][field]) @ turn.T + [3000.0, -2000.0, 500.0]
        data["target"][field] = points.tolist()
    moved = design_from_dict(data)
    first, second = (d.deploy()["deployed"] for d in (design, moved))
    x, y = (d.report_positions(eq.state) for d, eq in ((design, first), (moved, second)))
    placed = best_placement(x, y, np.full(len(x), 1 / len(x)))
    assert np.abs(placed.apply(x) - y).max() < 1e-5 * design.mesh.size
    assert abs(second.iterations - first.iterations) < 0.5 * first.iterations


def test_what_touches_the_limits_is_reported():
    design = design_from_dict(make("tight"))
    found = simulate(design).to_dict()
    limits = found["hinge_limits"]
    assert limits["hinges"] == np.count_nonzero(design.mesh.hinged)
    assert 0 < limits["touched"] < limits["hinges"]
    assert 0 < limits["furthest"] < PRESSED
    assert found["escapes"] == 0


# -- the path itself, with states made up -----------------------------------------------------
class Made:
    """Equilibria of a made-up structure whose hinge turns as far as the stage is open."""

    def __init__(self, eq, fails=lambda a, b: False, branches=lambda a, b: False):
        self.eq, self.fails, self.branches, self.seen = eq, fails, branches, []

    def __call__(self, stage, start, iterations):
        before = getattr(start, "state", start).angles[0]
        after = stage.opening + np.log10(stage.actuators)
        self.seen.append(stage)
        if self.fails(before, after):
            raise SimulationFailure("too far")
        state = replace(self.eq.state, angles=np.full_like(self.eq.state.angles, after))
        return replace(self.eq, state=state, escapes=int(self.branches(before, after)))


@pytest.fixture(scope="module")
def some():
    return design_from_dict(make("equal")).deploy()["deployed"]


PATH = [Stage(0.5, 0.1, 1e-2), Stage(1.0, 0.1, 1e-2), Stage(1.0, 0.0, 1e-2, final=True)]


def compact(some):
    return replace(some.state, angles=np.full_like(some.state.angles, -2.0))


def test_stages_that_fail_or_turn_far_are_halved(some):
    made = Made(some, fails=lambda a, b: abs(b - a) > 0.3)
    found = follow(compact(some), PATH, made, Deployment(turn=0.2), "made")
    assert found[-1].state.angles[0] == pytest.approx(-1.0)
    turns = np.diff([-2.0, *(stage.opening - 2 for stage in made.seen)])
    assert turns.max() > 0.3 and made.seen[-1].final
    with pytest.raises(SimulationFailure, match="made: .*% open, actuator weight 0.01: too far"):
        follow(compact(some), PATH, Made(some, fails=lambda a, b: b > a), Deployment(), "made")


def test_a_branching_of_the_path_is_counted_and_said(some, caplog):
    """An unstable state that even short stages leave is a branching; one that they don't leave
    isn't."""
    crossing = Made(some, branches=lambda a, b: a < -1.7 < b)
    with caplog.at_level(logging.WARNING):
        found = follow(compact(some), PATH, crossing, Deployment(), "made")
    assert sum(eq.escapes for eq in found) == 1
    assert "branches" in caplog.text
    caplog.clear()
    far = Made(some, branches=lambda a, b: b - a > 0.2)
    with caplog.at_level(logging.WARNING):
        found = follow(compact(some), PATH, far, Deployment(), "made")
    assert sum(eq.escapes for eq in found) == 0 and not caplog.records
