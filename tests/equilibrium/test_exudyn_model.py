"""Equilibria against Exudyn's static solver."""

from __future__ import annotations

import weakref
from dataclasses import replace

import numpy as np
import pytest
from support.moments import BodyMoments, SpatialMoments

from kop_exudyn.equilibrium.exudyn_confirm import confirm, model_of
from kop_exudyn.equilibrium.exudyn_model import ExudynModel
from kop_exudyn.equilibrium.newton import NewtonOptions, refine, solve
from kop_exudyn.equilibrium.system import System
from kop_exudyn.errors import SimulationFailure
from kop_exudyn.rods.rotations import exp_so3
from kop_exudyn.scene.actuators import LinearActuators
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.scene.loads import DeadForces
from kop_exudyn.scene.state import State


def confirmed(scene, q=np.zeros(0), opening=None):
    system = System(scene)
    eq = refine(system, solve(system, q, opening=opening))
    confirmation = confirm(scene, eq)
    assert confirmation.newton_steps <= 2
    assert confirmation.moved < 1e-8
    assert confirmation.residual < 1e-7
    return eq, confirmation


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"weight": False},
        {"terms": False},
        {"actuated": False},
        {"oblique": False},
        {"weight": False, "terms": False, "actuated": False},
    ],
)
def test_every_feature_is_confirmed(wheel, options, seed):
    """Offsets, frames, hinges free, driven and constant, straight and oblique, driven coordinates,
    all loads."""
    case = wheel(seed=seed, **options)
    eq, confirmation = confirmed(case.scene, case.q, case.opening)
    assert np.allclose(confirmation.state.angles, eq.state.angles, atol=1e-7)
    assert np.allclose(confirmation.state.rotations, eq.state.rotations, atol=1e-7)


def test_one_model_serves_all_states_of_an_opening(net):
    case = net(5)
    system, model = System(case.scene), ExudynModel(case.scene)
    eq = None
    for k in range(8):
        eq = solve(system, case.q * (1 + 0.01 * k), eq, case.opening - 0.1 * k)
        confirmation = confirm(case.scene, refine(system, eq), model=model)
        assert confirmation.newton_steps <= 2 and confirmation.moved < 1e-8


@pytest.mark.parametrize("kind", [SpatialMoments, BodyMoments])
def test_moments(strut, kind):
    confirmed(strut().with_terms(kind([8], [0.3, 1.0, 0.4]), DeadForces([4], [0, 0, 0.5])))


def test_actuators():
    scene = make_plates()
    eq, _ = confirmed(scene)
    assert 0.2 < scene.terms[0].spacings(eq.state)[0] < 0.4


def test_a_state_that_is_no_equilibrium_is_refused(wheel):
    case = wheel()
    system = System(case.scene)
    eq = solve(system, case.q, opening=case.opening)
    away = np.zeros(case.scene.n_dofs)
    away[system.sparsity.free] = 1e-3
    with pytest.raises(SimulationFailure, match="Exudyn"):
        confirm(case.scene, replace(eq, state=eq.state.moved(away)))


@pytest.fixture(scope="module")
def solved(wheel):
    """A wheel without loads in space, so that its states can be moved, and its equilibrium."""
    case = wheel(weight=False)
    system = System(case.scene)
    return case, refine(system, solve(system, case.q, opening=case.opening))


def test_a_prescribed_angle_that_is_not_the_parameters_is_refused(solved):
    case, _ = solved
    off = case.q.copy()
    off[12] += 0.2 / 1.5  # of a corner that turns by 1.5 times the parameter
    system = System(case.scene)
    other = refine(system, solve(system, off, opening=case.opening))
    confirm(case.scene, other)  # right for its own parameters
    with pytest.raises(SimulationFailure, match="prescribed angle is off by"):
        confirm(case.scene, other, q=case.q)


def test_a_wrong_opening_is_refused(solved):
    case, eq = solved
    system = System(case.scene)
    other = refine(system, solve(system, case.q, eq, case.opening - 0.3))
    confirm(case.scene, other)
    with pytest.raises(SimulationFailure, match=r"opening is off by 3\.00e-01"):
        confirm(case.scene, other, opening=case.opening)


def test_a_wrong_length_is_refused(solved):
    case, eq = solved
    off = case.q.copy()
    off[3] *= 1.001
    with pytest.raises(SimulationFailure, match="moved the state"):
        confirm(case.scene, eq, q=off)


def test_a_state_off_its_pins_is_refused(solved):
    """All else of it is in order: nothing but the pins says where it is."""
    case, eq = solved
    scene = case.scene.with_terms()  # no load, no attraction
    system = System(scene)
    eq = refine(system, solve(system, case.q, eq, case.opening))
    confirm(scene, eq)
    away = eq.state.transformed(np.eye(3), np.array([scene.size, 0.0, 0.0]))
    with pytest.raises(SimulationFailure, match="pin is off by 1"):
        confirm(scene, replace(eq, state=away))
    turned = eq.state.transformed(exp_so3(np.array([0.0, 0.3, 0.0])), np.zeros(3))
    with pytest.raises(SimulationFailure, match="pin is off by"):
        confirm(scene, replace(eq, state=turned))


@pytest.mark.parametrize("turn", [(np.pi, 0, 0), (0, np.pi, 0), (0, 0, np.pi), (0, 2.2, 2.2)])
def test_pins_turned_by_half_a_turn_are_refused(solved, turn):
    """Exudyn's equations of a held turn hold there as well: they are of right angles."""
    case, eq = solved
    scene = case.scene.with_terms()
    system = System(scene)
    eq = refine(system, solve(system, case.q, eq, case.opening))
    body = int(np.flatnonzero(scene.pinned[: 6 * scene.n_bodies])[0]) // 6
    turned = eq.state.transformed(exp_so3(np.array(turn)), np.zeros(3))
    turned = turned.transformed(np.eye(3), eq.state.positions[body] - turned.positions[body])
    with pytest.raises(SimulationFailure, match="pin is off by [23]"):
        confirm(scene, replace(eq, state=turned))


@pytest.mark.parametrize("turns", [1, -1, 3])
def test_prescribed_angles_count_full_turns(solved, turns):
    case, eq = solved
    scene = case.scene
    hinge = int(scene.driven.dofs[scene.driven.dofs >= 6 * scene.n_bodies][0]) - 6 * scene.n_bodies
    angles = eq.state.angles.copy()
    angles[hinge] += 2 * np.pi * turns
    with pytest.raises(SimulationFailure, match="prescribed angle is off by"):
        confirm(scene, replace(eq, state=replace(eq.state, angles=angles)))


@pytest.mark.parametrize("turn", [0.4, 3.0, np.pi, 4.5])
def test_supports_that_have_been_moved_are_the_scenes(strut, turn):
    """A rod whose end is held, wound on in steps about its axis, and led aside; its scene says
    where."""
    scene = strut()
    held = scene.pinned.copy()
    held[6 * 8 : 6 * 9] = True
    scene = scene.with_pins(held)
    state = scene.initial
    for share in np.linspace(0.1, 1, 10):
        positions, rotations = state.positions.copy(), state.rotations.copy()
        positions[8] = scene.initial.positions[8] + share * np.array([-0.02, 0.1, 0.0])
        rotations[8] = exp_so3(share * np.array([turn, 0.0, 0.0]))
        moved = replace(scene, initial=State(positions, rotations, state.angles))
        system = System(moved)
        eq = refine(system, solve(system, np.zeros(0)))
        state = eq.state
        assert confirm(moved, eq).moved < 1e-8
    assert np.allclose(state.rotations[8], moved.initial.rotations[8], rtol=0, atol=1e-15)
    with pytest.raises(SimulationFailure, match="pin is off by"):
        confirm(scene, eq)


@pytest.mark.parametrize("pinned", [(3, 4, 5), (0, 1, 2), (2,), (3, 4), (2,), (3, 4)])
def test_supports_at_another_place_are_refused(strut, pinned):
    """Of a cantilever whose end is held as well, in places, turns, or some of them."""
    scene = strut().with_terms(DeadForces([4], [0, 0.1, 0.5]))
    held = scene.pinned.copy()
    held[6 * 8 + np.array(pinned)] = True
    scene = scene.with_pins(held)
    system = System(scene)
    eq = refine(system, solve(system, np.zeros(0)))
    confirm(scene, eq)
    at = scene.initial
    positions, rotations = at.positions.copy(), at.rotations.copy()
    positions[8] += [0.0, 0.0, 0.02]
    rotations[8] = exp_so3(np.array([0.02, 0.03, 0.04]))
    moved = replace(scene, initial=State(positions, rotations, at.angles))
    with pytest.raises(SimulationFailure, match="pin is off by"):
        confirm(moved, eq)


def test_other_forces_are_refused(strut):
    """The state of one load, offered as that of another; with other residuals than 1e-12 too."""
    scene = strut().with_terms(DeadForces([8], [0, 0, 0.5]))
    eq = solve(System(scene), np.zeros(0), options=NewtonOptions(tolerance=1e-12))
    for share in (1.02, 1.00001):
        with pytest.raises(SimulationFailure, match="Exudyn"):
            confirm(scene.with_terms(DeadForces([8], [0, 0, 0.5 * share])), eq)


def test_another_weight_is_refused(wheel):
    case = wheel()
    system = System(case.scene)
    eq = refine(system, solve(system, case.q, opening=case.opening))
    with pytest.raises(SimulationFailure, match="moved the state"):
        confirm(case.scene.with_weight(1.01 * case.scene.weight), eq)


def test_another_section_is_refused(solved):
    """Forces of a structure under loads, of rods that are a little stiffer in one bending."""
    case, eq = solved
    stiffness = case.scene.stiffness.copy()
    stiffness[:, 5] *= 1.01
    with pytest.raises(SimulationFailure, match="moved the state"):
        confirm(replace(case.scene, stiffness=stiffness), eq)


def make_plates(spacing: float = 0.4, extension: float = 1.0):
    """A rod from one plate to another one, whose normals point away from each other, is pushed
    away."""
    builder = SceneBuilder()
    down = np.diag([1.0, -1, -1])
    frames = np.concatenate([down[None], [np.eye(3)] * 4])
    bodies = builder.bodies(np.linspace([0, 0, 0], [1, 0, 0.1], 5), frames)
    builder.rod(builder.nodes(bodies, frame=frames), [2e4, 1e4, 1e4, 1, 1, 2], length=1.0)
    builder.pin(bodies[0])
    builder.term(
        LinearActuators(
            bodies[4:], bodies[:1], spacing, weight=30.0, shear=0.0, extension=extension
        )
    )
    return builder.build()


@pytest.mark.parametrize("other", [{"spacing": 0.401}, {"extension": 1.01}])
def test_another_actuator_is_refused(other):
    scene = make_plates()
    system = System(scene)
    eq = refine(system, solve(system, np.zeros(0)))
    confirm(scene, eq)
    with pytest.raises(SimulationFailure, match="moved the state"):
        confirm(make_plates(**other), eq)


def test_the_yardstick_is_exudyns_own(solved):
    """Whatever a caller says about stresses: what is small is told by Exudyn's forces."""
    case, eq = solved
    off = np.zeros(case.scene.n_dofs)
    off[6 * 2] = 2e-7 * case.scene.size  # less than a move that would be refused
    plain = replace(eq, state=eq.state.moved(off))
    inflated = replace(plain, stress=1e9 * eq.stress)
    assert confirm(case.scene, inflated).residual == confirm(case.scene, plain).residual
    assert confirm(case.scene, inflated).residual < 1e-7


def test_only_the_start_comes_from_the_state(solved):
    """Energies, stresses and torque of an equilibrium are not looked at."""
    case, eq = solved
    odd = replace(eq, stress=0 * eq.stress, torque=3.0, elastic_energy=-1.0, potential=np.nan)
    assert confirm(case.scene, odd).moved < 1e-8


def test_the_jacobian_is_exact(solved):
    """Exudyn's, with the stiffness of its joints' reactions, against differences of its residual.

    Negative control: without that stiffness it is far from them.
    """
    case, eq = solved
    model = ExudynModel(case.scene)
    model.set(case.scene, case.q, case.opening)
    point = model.step(model.point(eq.state, eq.torque))[0]
    n = point.total.size
    rng = np.random.default_rng(2)
    exact, without = [], []
    for _ in range(5):
        direction = rng.normal(size=point.total.shape)

        def residual(step, direction=direction):
            near = replace(point, total=point.total + step * direction)
            return model.residual(model.composed(point, near)).balance

        difference = (residual(1e-6) - residual(-1e-6)) / 2e-6
        for kept, reactions in ((exact, point.reactions), (without, 0 * point.reactions)):
            J = model.jacobian(replace(point, reactions=reactions))[:n, :n]
            missed = np.abs(J @ direction.ravel() - difference).max()
            kept.append(missed / np.abs(difference).max())
    assert max(exact) < 1e-6 < 1e-5 < min(without)


def test_models_serve_scenes_of_their_topology(wheel):
    case = wheel()
    model = model_of(case.scene)
    assert model_of(case.scene.with_weight(2 * case.scene.weight)) is model
    held = case.scene.pinned.copy()
    held[6 * 2] = True
    assert model_of(case.scene.with_pins(held)) is not model
    assert model_of(case.scene.with_terms()) is not model
    assert model_of(case.scene) is model


def test_models_that_are_let_go_are_freed(wheel):
    """Exudyn holds on to functions of Python: none of them may hold on to the model."""
    model = ExudynModel(wheel().scene)
    system = weakref.ref(model)
    del model
    assert system() is None
