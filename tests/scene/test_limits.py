"""Soft limits of hinge angles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.equilibrium.stability import softest_mode
from kop_exudyn.equilibrium.system import System
from kop_exudyn.errors import InputError
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.scene.limits import MARGIN, REACH, HingeLimits
from kop_exudyn.scene.loads import HingeTorques
from kop_exudyn.scene.state import State

STIFFNESS = np.array([1e4, 1e3, 1e3, 1.0, 1.0, 1.0])


def at(*angles: float) -> State:
    return State(np.zeros((1, 3)), np.eye(3)[None], np.array(angles))


@settings(max_examples=50, deadline=None)
@given(angle=st.floats(-4, 5), lower=st.floats(-1, 0), width=st.floats(0.1, 3))
def test_derivatives_of_the_potential(angle, lower, width):
    """Against central differences of the energy and of the gradient; a wrong gradient fails."""
    limits = HingeLimits([0], lower, lower + width, 2.5, 1)
    h = 1e-5
    energy, g, H = limits.gradient_hessian(at(angle))
    ahead, behind = limits.gradient_hessian(at(angle + h)), limits.gradient_hessian(at(angle - h))
    assert limits.energy(at(angle)) == energy >= 0
    slope = (ahead[0] - behind[0]) / (2 * h)
    curve = (ahead[1] - behind[1])[0, 0] / (2 * h)
    assert g[0, 0] == pytest.approx(slope, rel=1e-4, abs=1e-9)
    assert H[0, 0, 0] == pytest.approx(curve, rel=1e-3, abs=1e-6)
    if abs(slope) > 1e-6:
        assert 1.01 * g[0, 0] != pytest.approx(slope, rel=1e-4, abs=1e-9)


def test_the_published_barrier():
    """Figures of (-ln((b - c) / (b - a)))^3 with a = -0.02, b = 10, worked out by hand."""
    limits = HingeLimits([0], 0.0, np.pi / 2, 1.0, 1)
    for c, energy in ((-0.03, 0.0), (-0.02, 0.0), (0.26, 2.277e-5), (1.0, 1.238e-3), (5.0, 0.3359)):
        assert limits.energy(at(np.pi / 2 + c)) == pytest.approx(energy, rel=1e-3, abs=1e-12)
        assert limits.energy(at(-c)) == pytest.approx(energy, rel=5e-3, abs=1e-12)
    assert limits.energy(at(np.pi / 2 + REACH)) == np.inf
    assert limits.touched(at(np.pi / 2 - 1.1 * MARGIN)).tolist() == [False]
    assert limits.touched(at(np.pi / 2 - 0.9 * MARGIN)).tolist() == [True]
    assert limits.beyond(at(-0.1)) == pytest.approx(0.1)


@pytest.mark.parametrize(
    "lower, upper, weight", [(1.0, 1.0, 1.0), (0.0, np.inf, 1.0), (0.0, 1.0, -1.0)]
)
def test_limits_that_make_no_sense(lower, upper, weight):
    with pytest.raises(InputError, match="limits"):
        HingeLimits([0], lower, upper, weight, 1)


def folded(torque: float):
    """Two rods on a hinge that nothing but its limits stops."""
    build = SceneBuilder()
    bodies = build.bodies([[0, 0, 0], [1, 0, 0], [2, 0, 0.0]])
    hinge = build.hinges([0.5])
    nodes = build.nodes(bodies)
    turned = build.nodes(bodies[1:2], hinge)
    build.rod([nodes[0], nodes[1]], STIFFNESS, length=1.0)
    build.rod([turned[0], nodes[2]], STIFFNESS, length=1.0)
    build.pin(bodies[0])
    build.term(HingeTorques(hinge, -torque, 3))
    build.term(HingeLimits(hinge, 0.0, np.pi / 2, 0.1, 3))
    return build.build()


@pytest.mark.parametrize("torque", [1e-4, -1e-4])
def test_a_free_hinge_stops_where_the_barrier_balances_the_torque(torque):
    """The balance of torques, and a stable state."""
    system = System(folded(torque))
    eq = solve(system, np.zeros(0))
    angle = eq.state.angles[0]
    c = angle - np.pi / 2 if angle > np.pi / 2 else -angle
    push = 0.1 * 3 * np.log((REACH - c) / (REACH + MARGIN)) ** 2 / (REACH - c)
    assert push == pytest.approx(1e-4, rel=1e-6)
    assert c > 0
    assert softest_mode(system, eq).eigenvalue > 0
