"""Equilibria found by Exudyn's steps, against those of the fast solver."""

from __future__ import annotations

import numpy as np
import pytest

from kop_exudyn.equilibrium import exudyn_solver
from kop_exudyn.equilibrium.engines import engine
from kop_exudyn.equilibrium.exudyn_confirm import confirm
from kop_exudyn.equilibrium.newton import NewtonOptions, solve
from kop_exudyn.equilibrium.system import System
from kop_exudyn.errors import InputError, SimulationFailure
from kop_exudyn.rods.rotations import exp_so3
from kop_exudyn.scene.loads import DeadForces


def both(scene, q=np.zeros(0), opening=None, options=NewtonOptions()):
    """Equilibria by Exudyn and by the fast solver, from the scene's own start; the first one is
    confirmed."""
    found = exudyn_solver.solve(System(scene), q, opening=opening, options=options)
    confirm(scene, found)
    return found, solve(System(scene), q, opening=opening, options=options)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("options", [{}, {"actuated": False}, {"terms": False, "weight": False}])
def test_every_feature(wheel, options, seed):
    case = wheel(seed=seed, **options)
    found, fast = both(case.scene, case.q, case.opening)
    scale = case.scene.size
    assert np.allclose(found.state.positions, fast.state.positions, rtol=0, atol=1e-8 * scale)
    assert np.allclose(found.state.angles, fast.state.angles, rtol=0, atol=1e-7)
    assert np.allclose(found.stress, fast.stress, rtol=0, atol=1e-6 * np.abs(fast.stress).max())
    assert found.torque == pytest.approx(fast.torque, rel=1e-6)
    assert found.elastic_energy == pytest.approx(fast.elastic_energy, rel=1e-8)
    assert found.stable and found.iterations > 0 and found.wall_s > 0


@pytest.mark.parametrize("force", [0.5, 5.0, 20.0])
def test_large_rotations(strut, force):
    """A cantilever that a force at its end turns by up to 90 degrees, at once."""
    found, fast = both(strut().with_terms(DeadForces([8], [0, 0, force])))
    assert np.allclose(found.state.positions, fast.state.positions, rtol=0, atol=1e-8)


def test_a_buckled_strut_is_left_for_its_stable_state(strut):
    """Straight, it is in equilibrium: that it isn't stable shows at the pivots."""
    found, fast = both(strut(force=4.0))
    assert found.escapes >= 1
    assert found.elastic_energy == pytest.approx(fast.elastic_energy, rel=1e-8)
    assert np.ptp(found.state.positions[:, 1:]) > 0.1


def test_the_side_that_is_asked_for(strut):
    scene = strut(force=4.0)
    system = System(scene)
    heights = np.zeros(scene.n_dofs)
    heights[: 6 * scene.n_bodies].reshape(-1, 6)[:, 2] = 1.0
    for sign in (1.0, -1.0):
        options = NewtonOptions(side=sign * heights[system.sparsity.free])
        found = exudyn_solver.solve(System(scene), np.zeros(0), options=options)
        assert sign * found.state.positions[-1, 2] > 0.1


def test_no_solution_is_a_failure(strut):
    """Within two iterations nothing is found."""
    scene = strut().with_terms(DeadForces([8], [0, 0, 20.0]))
    with pytest.raises(SimulationFailure, match="within 2 of Exudyn's"):
        exudyn_solver.solve(System(scene), np.zeros(0), options=NewtonOptions(max_iterations=1))


def test_an_opening_belongs_to_actuated_scenes(strut, wheel):
    with pytest.raises(ValueError, match="opening"):
        exudyn_solver.solve(System(strut()), np.zeros(0), opening=0.1)
    case = wheel()
    with pytest.raises(ValueError, match="opening"):
        exudyn_solver.solve(System(case.scene), case.q)


def test_unknown_engines_are_named():
    with pytest.raises(InputError, match=r"engine = 'exodyn': unknown engine .*fast, exudyn"):
        engine("exodyn")


@pytest.mark.parametrize("name", ["fast", "exudyn"])
def test_pins_are_where_the_scene_has_them(strut, name):
    """Wherever a start has them: what is reached is the scene's, and confirmed as such."""
    scene = strut().with_terms(DeadForces([8], [0, 0.1, 0.5]))
    there = scene.initial.transformed(exp_so3(np.array([0.3, 0.2, -0.4])), np.array([0.1, 0, 0.2]))
    found = engine(name)(System(scene), np.zeros(0), there)
    own = solve(System(scene), np.zeros(0))
    confirm(scene, found)
    assert np.allclose(found.state.positions, own.state.positions, rtol=0, atol=1e-7)
    assert np.array_equal(solve(System(scene), np.zeros(0), there).state.rotations[0], np.eye(3))
