"""Equilibria against Exudyn's static solver."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kop_exudyn.equilibrium.exudyn_model import ExudynModel
from kop_exudyn.equilibrium.newton import NewtonOptions, refine, solve
from kop_exudyn.equilibrium.system import System
from kop_exudyn.errors import SimulationFailure
from kop_exudyn.scene.actuators import LinearActuators
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.scene.loads import BodyMoments, DeadForces, SpatialMoments


def confirmed(scene, q=np.zeros(0), opening=None):
    system = System(scene)
    eq = refine(system, solve(system, q, opening=opening))
    confirmation = ExudynModel(scene).confirm(eq)
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
        confirmation = model.confirm(refine(system, eq))
        assert confirmation.newton_steps <= 2 and confirmation.moved < 1e-8


@pytest.mark.parametrize("kind", [SpatialMoments, BodyMoments])
def test_moments(strut, kind):
    confirmed(strut().with_terms(kind([8], [0.3, 1.0, 0.4]), DeadForces([4], [0, 0, 0.5])))


def test_actuators():
    """A rod from one plate to another one, whose normals point away from each other, is pushed
    away."""
    builder = SceneBuilder()
    down = np.diag([1.0, -1, -1])
    bodies = builder.bodies(
        np.linspace([0, 0, 0], [1, 0, 0.1], 5), np.concatenate([down[None], [np.eye(3)] * 4])
    )
    frames = np.concatenate([down[None], [np.eye(3)] * 4])
    builder.rod(builder.nodes(bodies, frame=frames), [2e4, 1e4, 1e4, 1, 1, 2], length=1.0)
    builder.pin(bodies[0])
    actuators = LinearActuators(bodies[4:], bodies[:1], 0.4, weight=30.0, shear=0.0)
    builder.term(actuators)
    eq, _ = confirmed(builder.build())
    assert 0.2 < actuators.spacings(eq.state)[0] < 0.4


def test_a_state_that_is_no_equilibrium_is_refused(wheel):
    case = wheel()
    system = System(case.scene)
    eq = solve(system, case.q, opening=case.opening)
    away = np.zeros(case.scene.n_dofs)
    away[system.sparsity.free] = 1e-3
    with pytest.raises(SimulationFailure, match="Exudyn"):
        ExudynModel(case.scene).confirm(replace(eq, state=eq.state.moved(away)))


def test_forces_that_do_not_fit_are_refused(strut):
    """The state of one load, offered as that of another."""
    scene = strut().with_terms(DeadForces([8], [0, 0, 0.5]))
    eq = solve(System(scene), np.zeros(0), options=NewtonOptions(tolerance=1e-12))
    with pytest.raises(SimulationFailure, match="Exudyn"):
        ExudynModel(scene.with_terms(DeadForces([8], [0, 0, 0.51]))).confirm(eq)
