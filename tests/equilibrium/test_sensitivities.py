"""Derivatives of equilibria against equilibria solved again."""

from __future__ import annotations

import numpy as np
import pytest
from support.moments import SpatialMoments
from support.states import increment

from kop_exudyn.equilibrium.newton import NewtonOptions, refine, solve
from kop_exudyn.equilibrium.sensitivities import Sensitivities
from kop_exudyn.equilibrium.system import System

EXACT = NewtonOptions(tolerance=1e-12)
CASES = [
    {},
    {"weight": False},
    {"terms": False},
    {"actuated": False},
    {"weight": False, "terms": False},
]


class Solved:
    """A wheel's equilibrium and its neighbours."""

    def __init__(self, case):
        self.case = case
        self.system = System(case.scene)
        self.eq = refine(
            self.system, solve(self.system, case.q, opening=case.opening, options=EXACT)
        )
        self.sensitivities = Sensitivities(self.system, self.eq)

    def neighbour(self, dq, dopening=0.0):
        system = System(self.case.scene)
        opening = None if self.case.opening is None else self.case.opening + dopening
        return refine(system, solve(system, self.case.q + dq, self.eq, opening, EXACT))

    def slopes(self, value, first, second, direction, steps) -> tuple[float, float]:
        """Orders at which the Taylor remainders of a scalar of the equilibrium fall."""
        at = value(self.eq)
        changes = np.array([value(self.neighbour(h * direction)) - at for h in steps])
        remainders = np.abs(
            [changes - steps * first, changes - steps * first - 0.5 * steps**2 * second]
        )
        return tuple(np.polyfit(np.log(steps), np.log(r), 1)[0] for r in remainders)


@pytest.fixture(scope="module", params=CASES, ids=lambda c: "-".join(c) or "all")
def solved(request):
    return Solved(request.getfixturevalue("wheel")(**request.param))


def relative(found, expected) -> float:
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


def test_all_first_derivatives_against_central_differences(solved):
    """In every parameter: lengths, the driven corner, the driven height."""
    se, scene = solved.sensitivities, solved.case.scene
    bodies, hinges = np.arange(scene.n_bodies), np.arange(scene.n_hinges)
    X, A, E = se.positions(bodies), se.angles(hinges), se.energy_gradient
    h = 2e-5
    differences = []
    for k in range(scene.n_parameters):
        dq = np.zeros(scene.n_parameters)
        dq[k] = h
        a, b, c, d = (solved.neighbour(s * dq) for s in (2, 1, -1, -2))

        def fourth_order(value, a=a, b=b, c=c, d=d):
            return (8 * (value(b) - value(c)) - (value(a) - value(d))) / (12 * h)

        differences.append(
            [
                fourth_order(lambda e: e.state.positions.ravel()),
                fourth_order(lambda e: e.state.angles),
                fourth_order(lambda e: e.elastic_energy),
                fourth_order(lambda e: e.torque),
                fourth_order(lambda e: e.potential),
            ]
        )
    positions, angles, energies, torques, potentials = (
        np.array(column) for column in zip(*differences)
    )
    assert relative(X, positions.T) < 1e-6
    assert relative(A, angles.T) < 1e-6
    assert relative(E, energies) < 1e-6
    assert relative(se.potential_gradient, potentials) < 1e-6
    if solved.case.opening is not None:
        assert relative(se.torque_gradient, torques) < 1e-6


def test_adjoint_is_the_transposed_sensitivity(solved):
    se, scene = solved.sensitivities, solved.case.scene
    cotangent = np.random.default_rng(1).normal(size=scene.n_dofs)
    dofs = np.arange(scene.n_dofs)
    assert relative(se.adjoint(dofs, cotangent), se.rows(dofs).T @ cotangent) < 1e-8


def test_taylor_slopes_of_the_potential(solved):
    """Of the potential at equilibrium: exact gradient and Hessian whatever the loads."""
    se = solved.sensitivities
    steps = 2.0 ** -np.arange(2, 7)
    orders = []
    for seed in (2, 3):
        d = 0.02 * np.random.default_rng(seed).normal(size=len(solved.case.q))
        orders.append(
            solved.slopes(
                lambda e: e.potential,
                se.potential_gradient @ d,
                d @ se.potential_hessian @ d,
                d,
                steps,
            )
        )
    assert np.median(orders, axis=0) == pytest.approx([2, 3], abs=0.2)
    assert np.allclose(se.potential_hessian, se.potential_hessian.T)


def test_elastic_hessian_of_an_unloaded_scene(wheel):
    solved = Solved(wheel(weight=False, terms=False))
    se = solved.sensitivities
    assert np.array_equal(se.energy_hessian, se.potential_hessian)
    d = 0.02 * np.random.default_rng(4).normal(size=len(solved.case.q))
    orders = solved.slopes(
        lambda e: e.elastic_energy,
        se.energy_gradient @ d,
        d @ se.energy_hessian @ d,
        d,
        2.0 ** -np.arange(2, 7),
    )
    assert orders == pytest.approx((2, 3), abs=0.2)


def test_opening_derivative(wheel):
    solved = Solved(wheel())
    h = 1e-4
    predicted = solved.sensitivities.predict(0 * solved.case.q, h)
    ahead, back = (solved.neighbour(0, s * h) for s in (1, -1))
    change = increment(back.state, ahead.state) / 2
    assert relative(increment(solved.eq.state, predicted.state), change) < 1e-5
    assert predicted.torque - solved.eq.torque == pytest.approx(
        (ahead.torque - back.torque) / 2, rel=1e-5
    )


def test_prediction_is_of_first_order_and_saves_iterations(solved):
    d = 0.02 * np.random.default_rng(5).normal(size=len(solved.case.q))
    steps = 2.0 ** -np.arange(2, 7)
    errors, stresses = [], []
    for h in steps:
        start, reached = solved.sensitivities.predict(h * d), solved.neighbour(h * d)
        state = solved.case.scene.with_driven(start.state, reached.q)
        errors.append(np.abs(state.positions - reached.state.positions).max())
        stresses.append(np.abs(start.stress - reached.stress).max())
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2, abs=0.2)
    assert np.polyfit(np.log(steps), np.log(stresses), 1)[0] == pytest.approx(2, abs=0.2)
    start = solved.sensitivities.predict(1e-3 * d)
    assert (
        solve(
            System(solved.case.scene), solved.case.q + 1e-3 * d, start, solved.case.opening
        ).iterations
        <= 3
    )


def test_one_adjoint_costs_one_solve_and_no_assembly(solved):
    se, system = solved.sensitivities, solved.system
    before = (system.counters.hessians, system.counters.factorisations, system.counters.solves)
    se.adjoint(np.arange(6), np.ones(6))
    after = (system.counters.hessians, system.counters.factorisations, system.counters.solves)
    assert np.subtract(after, before).tolist() == [0, 0, 1]


def test_trusted_where_the_stiffness_is_well_conditioned(solved):
    assert solved.sensitivities.trusted


def test_not_trusted_under_moments_without_potential(strut):
    """Their tangent is not symmetric: derivatives would be wrong by some per cent."""
    scene = strut().with_terms(SpatialMoments([8], [0.1, 0.3, 0.2]))
    system = System(scene)
    assert not Sensitivities(system, solve(system, np.zeros(0))).trusted
