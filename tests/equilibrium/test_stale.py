"""What is derived from a system stays right after others have worked with the same system."""

from __future__ import annotations

import threading

import numpy as np
import pytest
import scipy.sparse as sp
from support.states import stiffness_matrix

from kop_exudyn.equilibrium.direction import border_of, bordered_solve
from kop_exudyn.equilibrium.factorisation import factorisation
from kop_exudyn.equilibrium.newton import refine, solve
from kop_exudyn.equilibrium.sensitivities import Sensitivities
from kop_exudyn.equilibrium.stability import softest_mode
from kop_exudyn.equilibrium.system import System
from kop_exudyn.errors import SimulationFailure

CASES = [{}, {"actuated": False}, {"weight": False, "terms": False}]


def elsewhere(system, case, eq):
    """Another equilibrium of the same system."""
    solve(system, case.q * 1.02, eq, case.opening)


def other_lengths(system, case, eq):
    system.set_parameters(case.q * 1.1)


def shifted(system, case, eq):
    softest_mode(system)


def mixed(system, case, eq):
    system.predicted_stress[:] = 3 * system.stress()
    system.assemble(eq.state, mixed=True)
    system.factorise()


def moved(system, case, eq):
    system.assemble(eq.state.moved(np.full(system.scene.n_dofs, 0.03)))


def refined(system, case, eq):
    refine(system, eq)


USES = [elsewhere, other_lengths, shifted, mixed, moved, refined]


def everything(s: Sensitivities) -> dict[str, np.ndarray]:
    """All that sensitivities offer, as arrays."""
    scene = s.system.scene
    q = s.equilibrium.q
    found = {
        "full": s.full,
        "torque": s.torque_gradient,
        "adjoint": s.adjoint(np.arange(12, 24), np.arange(12.0)),
        "stresses": s.stresses,
        "stress adjoint": s.stress_adjoint(np.ones((len(scene.elements), 6))),
        "potential gradient": s.potential_gradient,
        "energy gradient": s.energy_gradient,
        "Hessian": s.potential_hessian,
        "predicted": s.predict(0.01 * q).state.positions,
        "predicted stress": s.predict(0.01 * q).stress,
        "trusted": np.array([s.trusted]),
    }
    if scene.actuated is not None:
        found["opening"] = s.predict(0 * q, 0.01).state.positions
    return found


@pytest.mark.parametrize("options", CASES, ids=lambda c: "-".join(c) or "all")
@pytest.mark.parametrize("use", USES, ids=lambda use: use.__name__)
def test_sensitivities_are_those_of_their_equilibrium(wheel, options, use):
    """Whatever the system was used for in between, and before each single question."""
    case = wheel(**options)
    alone = System(case.scene)
    expected = everything(Sensitivities(alone, solve(alone, case.q, opening=case.opening)))
    system = System(case.scene)
    eq = solve(system, case.q, opening=case.opening)
    late = Sensitivities(system, eq)  # nothing of it is computed yet
    use(system, case, eq)
    for name, value in everything(late).items():
        assert np.array_equal(value, expected[name]), name
    early = Sensitivities(system, eq)
    use(system, case, eq)
    for name in expected:
        use(system, case, eq)
        assert np.array_equal(everything(early)[name], expected[name]), name


@pytest.mark.parametrize("use", USES, ids=lambda use: use.__name__)
def test_sensitivities_made_late_are_those_of_their_equilibrium(wheel, use):
    """A system that others used before they are made, even if only for its lengths."""
    case = wheel()
    system = System(case.scene)
    eq = solve(system, case.q, opening=case.opening)
    expected = everything(Sensitivities(system, eq))
    use(system, case, eq)
    for name, value in everything(Sensitivities(system, eq)).items():
        assert np.array_equal(value, expected[name]), name


def test_two_equilibria_in_turn(wheel):
    """Sensitivities of two states that share a system, asked by turns."""
    case = wheel()
    system = System(case.scene)
    first = solve(system, case.q, opening=case.opening)
    a = Sensitivities(system, first)
    second = solve(system, case.q * 1.02, first, case.opening)
    b = Sensitivities(system, second)
    for name in ("full", "energy_gradient", "potential_hessian", "stresses"):
        for s, eq in ((a, first), (b, second)):
            assert np.array_equal(
                getattr(s, name), getattr(Sensitivities(System(case.scene), eq), name)
            ), name


def test_nothing_is_made_again_while_the_system_stays(wheel):
    """The way of a search: all that is asked at one state costs one factorisation."""
    case = wheel()
    system = System(case.scene)
    eq = solve(system, case.q, opening=case.opening)
    sensitivities = Sensitivities(system, eq)
    before = (system.counters.factorisations, system.counters.hessians)
    everything(sensitivities)
    everything(Sensitivities(system, eq))
    assert (system.counters.factorisations, system.counters.hessians) == before


def test_softest_mode_and_stiffness_of_a_named_equilibrium(wheel):
    case = wheel()
    system = System(case.scene)
    eq = solve(system, case.q, opening=case.opening)
    value, K = softest_mode(system, eq).eigenvalue, stiffness_matrix(system, eq)
    solve(system, case.q * 1.02, eq, case.opening)
    assert softest_mode(system).eigenvalue != pytest.approx(value, rel=1e-6)
    assert softest_mode(system, eq).eigenvalue == pytest.approx(value, rel=1e-12)
    assert np.array_equal(stiffness_matrix(system, eq), K)


def test_a_border_serves_its_own_factorisation_only(wheel):
    case = wheel()
    system = System(case.scene)
    solve(system, case.q, opening=case.opening)
    border = border_of(system)
    rhs = np.ones(system.n_unknowns)
    bordered_solve(system, border, rhs)
    system.factorise(1e-3)
    with pytest.raises(RuntimeError, match="earlier factorisation"):
        bordered_solve(system, border, rhs)
    bordered_solve(system, border_of(system), rhs)


def test_a_singular_matrix_lends_no_earlier_factors():
    """Block solves went on with the factors of the matrix before."""
    factors = factorisation()
    factors.update(sp.csc_matrix(np.triu([[2.0, 1], [1, 2]])))
    singular = sp.csc_matrix(([1.0, 1.0, 1.0], ([0, 0, 1], [0, 1, 1])), shape=(2, 2))
    assert factors.update(singular) == 1
    with pytest.raises(SimulationFailure, match="singular"):
        factors.solve_columns(sp.identity(2, format="csc"))
    with pytest.raises(SimulationFailure, match="singular"):
        factors.solve(np.ones(2))


# -- threads -----------------------------------------------------------------------------------
def in_a_thread(work):
    """What a function returns, or raises, in another thread."""
    found = []

    def run():
        try:
            found.append((work(), None))
        except Exception as error:
            found.append((None, error))

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    value, error = found[0]
    if error is not None:
        raise error
    return value


def test_a_system_refuses_another_thread(wheel):
    case = wheel()
    system = System(case.scene)
    with pytest.raises(RuntimeError, match="thread"):
        in_a_thread(lambda: solve(system, case.q, opening=case.opening))
    with pytest.raises(RuntimeError, match="thread"):
        in_a_thread(system.factorise)
    solve(system, case.q, opening=case.opening)  # and still serves its own
