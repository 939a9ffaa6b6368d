"""Planar large deflections with closed forms: roll-up, elastica, order of convergence."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk
from support.moments import SpatialMoments

from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.equilibrium.sensitivities import Sensitivities
from kop_exudyn.equilibrium.system import System
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.scene.loads import DeadForces

EI, LENGTH = 2.0, 1.0
STIFF = 1e6  # stretch and shear: next to inextensible, as the classical elastica


def cantilever(rods, n: int, stretch: float = STIFF):
    builder = SceneBuilder()
    bodies = rods.add(
        builder, n, [0, 0, 0], np.eye(3), LENGTH, [stretch, stretch, stretch, 1.0, EI, 3 * EI]
    )
    builder.pin(0)
    rods.hold_plane(builder, bodies[1:], 1)
    return builder.build()


@pytest.mark.parametrize("turns, n", [(1, 4), (1, 8), (2, 8), (2, 16)])
def test_roll_up(rods, classical, turns, n):
    """Simo and Vu-Quoc, CMAME 58 (1986), ex. 7.1: an end moment 2 pi EI / L closes a cantilever to
    a circle.

    Exact for any number of elements (each bends by less than pi) and one load step.
    """
    moment = turns * 2 * np.pi * EI / LENGTH
    eq = rods.equilibrium(cantilever(rods, n).with_terms(SpatialMoments([n], [0, moment, 0])))
    assert np.abs(eq.state.positions[-1]).max() < 1e-8
    assert np.allclose(eq.state.rotations[-1], np.eye(3), atol=1e-7)
    radius = LENGTH / (2 * np.pi * turns)
    centre = np.array([0, 0, -radius])
    radii = np.linalg.norm(eq.state.positions - centre, axis=1)
    assert np.allclose(radii, radius, rtol=1e-8)
    classical(
        f"roll-up, {turns} full circle{'s' if turns > 1 else ''}: radius",
        "Simo, Vu-Quoc 1986, 7.1",
        n,
        radius,
        radii[np.argmax(np.abs(radii - radius))],
    )
    assert np.allclose(eq.stress, [0, 0, 0, 0, moment, 0], atol=1e-6)


# Mattiasson, IJNME 17 (1981), recomputed below: P L^2/EI, transverse and axial tip displacement /
# L, tip slope
ELASTICA = [
    (1, 0.30172, 0.05643, 0.46135),
    (2, 0.49346, 0.16064, 0.78175),
    (5, 0.71379, 0.38763, 1.21537),
    (10, 0.81061, 0.55500, 1.43029),
]


def elastica_by_quadrature(load: float) -> tuple[float, float, float]:
    """EI theta'' = -P cos theta: theta'^2 = 2 P/EI (sin a - sin theta), with a the tip slope."""

    def length(a):  # substituting sin theta = sin a - v^2 takes the singularity at the tip out
        return quad(
            lambda v: 2 / np.sqrt(2 * load * (1 - (np.sin(a) - v * v) ** 2)), 0, np.sqrt(np.sin(a))
        )[0]

    a = brentq(lambda a: length(a) - 1, 1e-3, np.pi / 2 - 1e-3, xtol=1e-13)
    w = quad(
        lambda v: 2 * (np.sin(a) - v * v) / np.sqrt(2 * load * (1 - (np.sin(a) - v * v) ** 2)),
        0,
        np.sqrt(np.sin(a)),
    )[0]
    return w, 1 - np.sqrt(2 * np.sin(a) / load), a


@pytest.mark.parametrize("load, w, u, slope", ELASTICA)
def test_elastica_under_a_tip_force(rods, classical, load, w, u, slope):
    assert elastica_by_quadrature(load) == pytest.approx((w, u, slope), abs=1e-5)
    n = 32
    eq = rods.equilibrium(
        cantilever(rods, n).with_terms(DeadForces([n], [0, 0, load * EI / LENGTH**2]))
    )
    x, _, z = eq.state.positions[-1]
    tip = eq.state.rotations[-1][:, 0]
    assert (z, LENGTH - x, np.arctan2(tip[2], tip[0])) == pytest.approx((w, u, slope), rel=1e-3)
    classical(f"elastica, tip force {load} EI/L²: deflection / L", "Mattiasson 1981", n, w, z)


def test_order_of_convergence(rods, classical):
    """The error of the tip falls with the second power of the element length; 8 elements are within
    0.3 %."""
    load = 5.0
    w, u, _ = elastica_by_quadrature(load)
    errors = []
    for n in (4, 8, 16, 32):
        scene = cantilever(rods, n, stretch=1e9).with_terms(
            DeadForces([n], [0, 0, load * EI / LENGTH**2])
        )
        x, _, z = rods.equilibrium(scene, confirm=False).state.positions[-1]
        errors.append(np.hypot(z - w, LENGTH - x - u))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([2, 2, 2], abs=0.1)
    assert errors[1] < 3e-3
    classical(
        "order of convergence, elastica with 16 to 32 elements", "theory", 32, 2.0, orders[-1]
    )


@pytest.mark.parametrize("shortening", [0.05, 0.2, 0.4])
def test_clamped_elastica_pushed_together(rods, classical, shortening):
    """Both ends clamped and pushed together: four quarter waves of the inflectional elastica (Love,
    art. 263).

    P L^2/EI = 16 K(k)^2, shortening/L = 2 (1 - E(k)/K(k)), rise/L = k/K(k).
    """
    k = brentq(lambda k: 2 * (1 - ellipe(k * k) / ellipk(k * k)) - shortening, 1e-6, 0.99)
    n = 32
    builder = SceneBuilder(1)
    bodies = rods.add(
        builder, n, [0, 0, 0], np.eye(3), LENGTH, [STIFF, STIFF, STIFF, 1.0, EI, 3 * EI]
    )
    builder.prescribe(n, 0, parameter=0, factor=-1.0, constant=LENGTH)
    builder.pin(0)
    builder.pin(n, (1, 2, 3, 4, 5))
    rods.hold_plane(builder, bodies[1:-1], 1)
    scene = builder.build()
    system = System(scene)
    eq = solve(system, np.array([shortening * LENGTH]))
    rise = np.abs(eq.state.positions[:, 2]).max()
    force = Sensitivities(system, eq).potential_gradient[0]  # energy / shortening
    assert rise == pytest.approx(k / ellipk(k * k) * LENGTH, rel=2e-3)
    classical(
        f"clamped elastica, shortened by {shortening:.0%}: rise / L",
        "Love, art. 263",
        n,
        k / ellipk(k * k),
        rise,
    )
    assert force == pytest.approx(16 * ellipk(k * k) ** 2 * EI / LENGTH**2, rel=5e-3)
