"""At and beyond a bifurcation: the side is the one asked for, no saddle comes back, derivatives say
what they're worth.

The pitchfork is that of a straight column between fixed points, which two weak springs from either
side hold at its middle. Shortening one spring pulls the middle sideways by an amount that grows as
1 / (distance to the bifurcation).
"""

from __future__ import annotations

import json
from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

from kop_exudyn.equilibrium.newton import NewtonOptions, refine, solve
from kop_exudyn.equilibrium.sensitivities import Sensitivities
from kop_exudyn.equilibrium.stability import softest_mode
from kop_exudyn.equilibrium.system import System
from kop_exudyn.errors import SimulationFailure
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.structures.base import design_from_dict

COLUMN = np.array([1e5, 4e4, 4e4, 1.0, 4.0, 1.0])  # weakest for bending in the plane of the springs
ELEMENTS, SPRING = 10, 0.3


@cache
def column():
    """Workspace and middle body; parameters: length of the column, lengths of the springs."""
    builder = SceneBuilder(3)
    x = np.linspace(0, 1, ELEMENTS + 1)
    bodies = builder.bodies(np.stack([x, 0 * x, 0 * x], axis=1))
    middle = int(bodies[ELEMENTS // 2])
    builder.rod(builder.nodes(bodies), COLUMN, parameter=0)
    for end in bodies[[0, -1]]:
        builder.pin(end, (0, 1, 2, 3, 4))
    for parameter, sign in ((1, 1.0), (2, -1.0)):
        ground = builder.bodies([[0.5, sign * SPRING, 0.0]])[0]
        frame = np.array([[0.0, -sign, 0.0], [sign, 0.0, 0.0], [0.0, 0.0, 1.0]])
        builder.rod(builder.nodes([middle, ground], frame=frame), np.ones(6), parameter=parameter)
        builder.pin(ground, (0, 1, 2))
    return System(builder.build()), middle


def q_of(length: float) -> np.ndarray:
    return np.array([length, SPRING, SPRING])


@cache
def critical_length() -> float:
    """Where the straight state's softest eigenvalue vanishes."""
    system = System(column()[0].scene)

    def eigenvalue(length: float) -> float:
        system.set_parameters(q_of(length))
        system.assemble(system.scene.initial)
        return softest_mode(system).eigenvalue

    return brentq(eigenvalue, 1.0, 1.0003, xtol=1e-15)


def before(distance: float) -> np.ndarray:
    """Parameters short of the bifurcation by this share of the way from the unstressed column."""
    return q_of(1 + (critical_length() - 1) * (1 - distance))


def test_the_load_is_eulers():
    """The springs carry 1 / 0.3 each: of a column's P = pi^2 EI / L^2, (2 / 0.3) (2 L / pi^2) more,
    by Rayleigh."""
    shortening = 1 - 1 / critical_length()
    assert shortening * COLUMN[0] == pytest.approx(np.pi**2 + 2 / SPRING * 2 / np.pi**2, rel=0.01)


@pytest.mark.parametrize("distance", [0.5, 1e-1, 1e-2, 1e-3])
def test_taylor_up_to_the_bifurcation(distance):
    system, middle = column()
    q = before(distance)
    equilibrium = solve(system, q)
    sensitivities = Sensitivities(system, equilibrium)
    assert sensitivities.trusted
    slope = sensitivities.positions(np.array([middle]))[1, 1]
    step = np.array([0.0, 1e-5 * distance**1.5, 0.0])
    ahead, back = (
        refine(system, solve(system, q + s * step, equilibrium)).state.positions[middle, 1]
        for s in (1, -1)
    )
    assert slope == pytest.approx((ahead - back) / (2 * step[1]), rel=1e-5)


def test_slopes_grow_with_the_inverse_distance():
    system, middle = column()
    slopes = [
        Sensitivities(system, solve(system, before(d))).positions(np.array([middle]))[1, 1] * d
        for d in (1e-3, 1e-4, 1e-5)
    ]
    np.testing.assert_allclose(slopes, slopes[0], rtol=1e-2)


@pytest.mark.parametrize("distance", [1e-8, 1e-10, 1e-12])
def test_a_column_about_to_buckle_is_no_equilibrium_to_build_on(distance):
    """Its mode has no stiffness but rounding; no derivative there could be trusted."""
    system, _ = column()
    with pytest.raises(SimulationFailure, match="neutral equilibrium"):
        solve(system, before(distance))


def test_beyond_it_the_straight_state_never_comes_back():
    system, middle = column()
    for excess in (1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0):
        equilibrium = solve(system, q_of(1 + (critical_length() - 1) * (1 + excess)))
        assert equilibrium.escapes >= 1
        assert abs(equilibrium.state.positions[middle, 1]) > 1e-4
        system.assemble(equilibrium.state)
        assert softest_mode(system).eigenvalue > 0


def test_the_side_is_the_chosen_one():
    system, middle = column()
    q = q_of(1.01)
    side = np.zeros(system.scene.n_dofs)
    side[6 * middle + 1] = 1.0
    up, down = (
        solve(system, q, options=NewtonOptions(side=sign * side[system.sparsity.free]))
        for sign in (1, -1)
    )
    assert up.state.positions[middle, 1] > 0.05
    rod = slice(0, ELEMENTS + 1)
    np.testing.assert_allclose(
        up.state.positions[rod] * [1, -1, 1], down.state.positions[rod], atol=1e-8
    )
    again = solve(system, q, options=NewtonOptions(side=side[system.sparsity.free]))
    np.testing.assert_array_equal(again.state.positions, up.state.positions)


def test_c_shells_up_and_down_are_mirror_images(repository):
    data = json.loads(
        (repository / "models" / "conformals" / "01_sinh.json").read_text(encoding="utf-8")
    )
    states = {}
    for side in ("up", "down"):
        design = design_from_dict(data | {"opening": data["opening"] | {"side": side}})
        deployed = design.deploy()[design.fitted_role.name]
        assert deployed.stable
        states[side] = deployed.state.positions[design.joints]
    assert np.ptp(states["up"][:, 2]) > 0.05 * np.ptp(states["up"][:, 0])
    np.testing.assert_allclose(states["up"] * [1, 1, -1], states["down"], atol=1e-8)
