from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
from support.moments import SpatialMoments

from kop_exudyn.equilibrium.newton import NewtonOptions, refine, solve
from kop_exudyn.equilibrium.sensitivities import Sensitivities
from kop_exudyn.equilibrium.system import System
from kop_exudyn.errors import SimulationFailure
from kop_exudyn.rods.rotations import exp_so3
from kop_exudyn.scene.loads import DeadForces

EULER = np.pi**2 / 4  # of the strut, about y


def solve_fresh(case, **options):
    system = System(case.scene)
    return system, solve(system, case.q, opening=case.opening, **options)


@pytest.mark.parametrize("options", [{}, {"weight": False}, {"terms": False}, {"actuated": False}])
def test_result_is_a_stable_equilibrium(wheel, options):
    """Checked against the assembled gradient and a dense eigenvalue on the actuation's kernel."""
    case = wheel(**options)
    system, eq = solve_fresh(case)
    energy = system.assemble(eq.state)
    residual = system.gradient[: system.n_unknowns]
    H = system.sparsity.free_matrix(system.values).toarray()
    H = H + np.triu(H, 1).T
    if case.opening is not None:
        assert eq.state.angles[case.scene.actuated].mean() == pytest.approx(case.opening, abs=1e-11)
        residual = residual + eq.torque * system.constraint
        kernel = np.linalg.svd(system.constraint[None])[2][1:]
        H = kernel @ H @ kernel.T
    else:
        assert eq.torque == 0.0
    scale = np.abs(eq.stress[:, :3]).max()
    assert np.abs(residual).max() < 1e-7 * scale
    assert np.linalg.eigvalsh(H)[0] > 0 and eq.stable
    assert (eq.elastic_energy, eq.potential) == pytest.approx((energy.elastic, energy.potential))
    assert np.allclose(eq.stress, system.stress())


def test_plain_newton_and_the_mixed_iteration_agree(wheel):
    case = wheel()
    mixed, plain = (
        solve_fresh(case, options=NewtonOptions(mixed=m, tolerance=1e-11, max_iterations=2000))[1]
        for m in (True, False)
    )
    assert np.allclose(mixed.state.positions, plain.state.positions, atol=1e-8)
    assert mixed.torque == pytest.approx(plain.torque, rel=1e-6)


def test_opening_a_net_takes_few_iterations(net):
    """Steps of 0.1 rad, through the out-of-plane bifurcation."""
    case = net(9)
    system = System(case.scene)
    eq, iterations = solve(system, case.q, opening=case.opening), []
    for k in range(1, 9):
        eq = solve(system, case.q, eq, case.opening - 0.1 * k)
        iterations.append(eq.iterations)
    assert np.median(iterations) <= 5
    assert np.ptp(eq.state.positions[:, 2]) > 0.1  # it has left its plane


def test_small_changes_of_lengths_take_few_iterations(net):
    case = net(5)
    system = System(case.scene)
    eq = solve(system, case.q, opening=case.opening)
    for k in range(1, 7):
        eq = solve(system, case.q, eq, case.opening - 0.1 * k)
    rng = np.random.default_rng(1)
    few = [
        solve(system, case.q * (1 + 1e-3 * rng.normal(size=len(case.q))), eq, eq.opening).iterations
        for _ in range(5)
    ]
    assert np.median(few) <= 5


@pytest.mark.parametrize("load", [1.05, 1.5, 3.0, 12.0])
def test_a_straight_strut_above_its_euler_load_is_never_returned(strut, load):
    """Started exactly straight, an unstable equilibrium; 12 times the Euler load is above the
    second one too."""
    eq = solve(System(strut(force=load * EULER)), np.zeros(0))
    assert eq.escapes >= 1
    assert abs(eq.state.positions[-1, 2]) > 0.2
    assert np.abs(eq.state.positions[:, 1]).max() < 1e-6  # about the soft axis


def test_a_straight_strut_below_its_euler_load_stays(strut):
    eq = solve(System(strut(force=0.95 * EULER)), np.zeros(0))
    assert eq.escapes == 0 and np.abs(eq.state.positions[:, 1:]).max() < 1e-12


@pytest.mark.parametrize("sign", [1, -1])
def test_the_side_of_a_pitchfork_can_be_chosen(strut, sign):
    scene = strut(force=1.5 * EULER)
    system = System(scene)
    side = np.zeros(scene.n_dofs)
    side[6 * (scene.n_bodies - 1) + 2] = sign
    states = [
        solve(system, np.zeros(0), options=NewtonOptions(side=side[system.sparsity.free])).state
        for _ in range(2)
    ]
    assert np.sign(states[0].positions[-1, 2]) == sign
    assert np.array_equal(states[0].positions, states[1].positions)  # reproducibly


def test_the_state_does_not_depend_on_units_or_placement(wheel):
    case = wheel(terms=False)
    _, eq = solve_fresh(case, options=NewtonOptions(tolerance=1e-12))
    scene, m, f = case.scene, 1e3, 1e-6  # millimetres, and forces in another unit
    per_q = np.concatenate([np.full(12, m), [1.0, m]])
    initial = replace(scene.initial, positions=m * scene.initial.positions)
    driven = replace(
        scene.driven,
        constants=scene.driven.constants * np.where(scene.driven.dofs < 6 * scene.n_bodies, m, 1),
    )
    scaled = replace(
        scene,
        initial=initial,
        node_offset=m * scene.node_offset,
        hinge_centre=m * scene.hinge_centre,
        length_constant=m * scene.length_constant,
        stiffness=f * scene.stiffness * np.array([1, 1, 1, m**2, m**2, m**2]),
        driven=driven,
        rest_strain=scene.rest_strain / np.array([1, 1, 1, m, m, m]),
        weight=scene.weight * f / m,
    )
    other = solve(
        System(scaled), case.q * per_q, opening=case.opening, options=NewtonOptions(tolerance=1e-12)
    )
    assert np.allclose(other.state.positions, m * eq.state.positions, atol=1e-9 * m)
    assert other.torque == pytest.approx(eq.torque * f * m, rel=1e-8)
    assert other.iterations == eq.iterations


def test_a_turned_scene_has_the_turned_state(net):
    case = net(3)
    Q, t = exp_so3(np.array([0.5, -1.0, 2.0])), np.array([100.0, -50, 20])
    turned = replace(case.scene, initial=case.scene.initial.transformed(Q, t))
    opening = case.opening - 0.2
    plain, moved = (solve(System(scene), case.q, opening=opening) for scene in (case.scene, turned))
    assert np.allclose(moved.state.positions, plain.state.transformed(Q, t).positions, atol=1e-8)


def test_refining_lowers_the_residual_and_keeps_the_state(wheel):
    case = wheel()
    system, eq = solve_fresh(case, options=NewtonOptions(tolerance=1e-2))
    finer = refine(system, eq)
    assert finer.residual < 1e-9 and finer.residual < eq.residual
    assert np.abs(finer.state.positions - eq.state.positions).max() < 1e-3
    assert finer.torque == pytest.approx(solve_fresh(case)[1].torque, rel=1e-8)


def test_moments_without_potential_roll_a_beam_up(strut):
    """From straight to a full circle in one solve, though no energy guides it."""
    scene = strut(planar=True).with_terms(SpatialMoments([8], [0, 2 * np.pi, 0]))
    eq = solve(System(scene), np.zeros(0))
    assert np.abs(eq.state.positions[-1]).max() < 1e-8


# -- what is computed --------------------------------------------------------------------------
def test_a_line_search_asks_for_energies_only(strut):
    system = System(strut(force=1.5 * EULER))
    eq = solve(system, np.zeros(0), options=NewtonOptions(mixed=False))
    c = system.counters
    assert c.energies > 0
    assert c.hessians <= eq.iterations + 4 * (1 + eq.escapes)
    assert c.gradients == 0


def test_a_warm_solve_without_changes_costs_one_check(wheel):
    """One assembly finds it converged at the stress it brought along, so that its factorisation
    tells whether it is stable."""
    case = wheel()
    system, eq = solve_fresh(case)
    before = replace(system.counters)
    again = solve(system, case.q, eq, case.opening)
    c = system.counters
    assert again.iterations == 0
    assert (
        c.hessians - before.hessians,
        c.factorisations - before.factorisations,
        c.energies - before.energies,
    ) == (1, 1, 0)


def test_the_system_holds_the_solutions_factorisation(wheel):
    case = wheel()
    system, eq = solve_fresh(case)
    d = np.random.default_rng(0).normal(size=system.n_unknowns)
    assert np.allclose(system.solve(system.multiply(d)), d, atol=1e-6)


@pytest.mark.parametrize("change", [0.0, 1e-7, 1e-3, 2e-2])
def test_derivatives_are_those_that_another_process_finds(wheel, change):
    """To the last bit: whoever solved the state, and from wherever. Optimisations magnify any
    difference."""
    case = wheel()
    system, eq = solve_fresh(case)
    q = eq.q * (1 + change * np.random.default_rng(0).uniform(-1, 1, len(eq.q)))
    found = solve(system, q, Sensitivities(system, eq).predict(q - eq.q), case.opening)
    here, there = (
        Sensitivities(system, found),
        Sensitivities(System(case.scene), pickle.loads(pickle.dumps(found))),
    )
    dq = 1e-3 * eq.q
    for a, b in ((here.predict(dq), there.predict(dq)), (here, there)):
        names = (
            ("torque", "stress") if a is not here else ("full", "energy_gradient", "energy_hessian")
        )
        for name in names:
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)


# -- failures ----------------------------------------------------------------------------------
def test_lengths_that_are_not_positive(wheel):
    case = wheel()
    q = case.q.copy()
    q[3] = -1.0
    with pytest.raises(SimulationFailure, match="not positive"):
        solve(System(case.scene), q, opening=case.opening)


def test_nothing_holds_a_loaded_beam(strut):
    scene = strut().with_terms(DeadForces([8], [0, 0, 1.0]))
    with pytest.raises(SimulationFailure):
        solve(System(scene.with_pins(np.zeros(scene.n_dofs, bool))), np.zeros(0))


def test_too_few_iterations(wheel):
    with pytest.raises(SimulationFailure, match="within 3"):
        solve_fresh(wheel(), options=NewtonOptions(max_iterations=3))


def test_nan_loads_fail_cleanly(strut):
    scene = strut().with_weight(np.full((8, 3), np.nan))
    with pytest.raises(SimulationFailure):
        solve(System(scene), np.zeros(0))


def test_an_opening_belongs_to_an_actuated_scene(wheel):
    for case, opening in ((wheel(), None), (wheel(actuated=False), 0.1)):
        with pytest.raises(ValueError):
            solve(System(case.scene), case.q, opening=opening)
