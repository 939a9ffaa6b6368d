"""Limit points: toggle, star dome, deep arch, Lee's frame."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.equilibrium.path import trace_path
from kop_exudyn.equilibrium.sensitivities import Sensitivities
from kop_exudyn.equilibrium.system import System
from kop_exudyn.rods.sections import Material, rectangle
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.scene.loads import DeadForces

RISE, SPAN = 0.386, 12.943  # of Williams' toggle, inches
SECTION, MATERIAL = rectangle(0.753, 0.243), Material(10.3e6, 0.3)


def star(rods, legs: int, n: int):
    """Toggle legs from an apex to clamped feet; two legs are Williams' toggle."""
    builder = SceneBuilder()
    apex = builder.bodies([[0, 0, RISE]])[0]
    for k in range(legs):
        turn = 2 * np.pi * k / legs
        leg = np.array([SPAN * np.cos(turn), SPAN * np.sin(turn), -RISE])
        bodies = rods.add(
            builder,
            n,
            [0, 0, RISE],
            rods.axes_along(leg, [0, 0, 1]),
            np.hypot(RISE, SPAN),
            SECTION.stiffness(MATERIAL),
            first=apex,
        )
        builder.pin(bodies[-1])
    return builder.build(), DeadForces([apex], [0, 0, -1.0])


def shallow_leg_load(sink: float) -> float:
    """Load of one leg at a sinking of the apex, by the theory of Williams (1964): a beam-column of
    shallow inclination, both ends kept from turning, under an axial force N and a sway of its ends.
    """
    EI, EA = MATERIAL.young * SECTION.inertia_y, MATERIAL.young * SECTION.area
    length = np.hypot(RISE, SPAN)
    x, weights = np.polynomial.legendre.leggauss(40)
    x, weights = 0.5 * length * (x + 1), 0.5 * length * weights

    def slope(N: float) -> np.ndarray:
        k = np.sqrt(N / EI)
        A, B = np.linalg.solve(
            [
                [np.sin(k * length), 1 - np.cos(k * length)],
                [1 - np.cos(k * length), k * length - np.sin(k * length)],
            ],
            [0, sink],
        )
        return k * (A * np.sin(k * x) + B * (1 - np.cos(k * x)))

    N = brentq(
        lambda N: N * length / EA - RISE * sink / length + 0.5 * weights @ slope(N) ** 2,
        1e-3,
        EI * (1.99 * np.pi / length) ** 2,
    )
    k = np.sqrt(N / EI)
    return sink * EI * k**3 / (2 * np.tan(k * length / 2) - k * length) + N * RISE / length


def shallow_limit() -> float:
    return -minimize_scalar(lambda d: -shallow_leg_load(d), bounds=(0.1, 0.3), method="bounded").fun


def test_williams_toggle(rods, classical):
    """Limit load by beam-column theory 33.85, within 0.2 % (32 elements a leg); 34.04 is often
    quoted (1 %)."""
    scene, load = star(rods, 2, 32)
    path = trace_path(scene, rods.none, load, stop=lambda p: p.displacement > 0.15)
    top, bottom = path.critical
    assert (top.kind, bottom.kind) == ("limit", "limit")
    assert top.point.factor == pytest.approx(2 * shallow_limit(), rel=2e-3)
    assert top.point.factor == pytest.approx(34.0392, rel=0.01)
    classical(
        "two-bar toggle: limit load",
        "Williams 1964, by quadrature",
        64,
        2 * shallow_limit(),
        top.point.factor,
    )
    # the whole curve, not only its extremes
    for point in path.points[1:]:
        sink = point.displacement + RISE
        if 0.02 < sink < 0.5:
            assert point.factor == pytest.approx(2 * shallow_leg_load(sink), rel=5e-3)
    assert bottom.point.factor < 32


def test_star_dome(rods, classical):
    """Six legs share the load of a symmetric path evenly: three toggles, and no earlier
    bifurcation."""
    scene, load = star(rods, 6, 16)
    dome = trace_path(scene, rods.none, load, stop=lambda p: p.displacement > 0.15)
    toggle = trace_path(*_toggle(rods, 16), stop=lambda p: p.displacement > 0.15)
    assert [c.kind for c in dome.critical] == ["limit", "limit"]
    assert [c.point.factor for c in dome.critical] == pytest.approx(
        [3 * c.point.factor for c in toggle.critical], rel=1e-5
    )
    assert dome.critical[0].point.factor == pytest.approx(6 * shallow_limit(), rel=4e-3)
    classical(
        "star dome of six legs: limit load",
        "Williams 1964, by quadrature",
        96,
        6 * shallow_limit(),
        dome.critical[0].point.factor,
    )


def _toggle(rods, n):
    scene, load = star(rods, 2, n)
    return scene, rods.none, load


def test_the_solver_snaps_beyond_the_limit_load(rods):
    """Just below the limit load the dome stands, just above it has snapped; both are stable
    equilibria."""
    scene, load = star(rods, 6, 8)
    limit = (
        trace_path(scene, rods.none, load, stop=lambda p: p.displacement > 0)
        .first("limit")
        .point.factor
    )
    heights = []
    for share in (0.98, 1.02):
        eq = rods.equilibrium(
            scene.with_terms(DeadForces(load.bodies, share * limit * load.forces))
        )
        heights.append(eq.state.positions[load.bodies[0], 2])
    assert heights[0] > 0.1 and heights[1] < 0


def test_driven_through_the_limit_point(rods):
    """With its apex led down the toggle is stable throughout, and its reaction is the path's load
    factor."""
    scene, load = star(rods, 2, 8)
    path = trace_path(scene, rods.none, load, stop=lambda p: p.displacement > 0.15)
    builder = SceneBuilder(1)
    apex = builder.bodies([[0, 0, RISE]])[0]
    for k in range(2):
        leg = np.array([SPAN * (-1) ** k, 0, -RISE])
        bodies = rods.add(
            builder,
            8,
            [0, 0, RISE],
            rods.axes_along(leg, [0, 0, 1]),
            np.hypot(RISE, SPAN),
            SECTION.stiffness(MATERIAL),
            first=apex,
        )
        builder.pin(bodies[-1])
    builder.prescribe(apex, 2, parameter=0, factor=-1.0)
    system = System(builder.build())
    eq = None
    for point in path.points:
        eq = solve(system, np.array([point.displacement]), eq)
        assert point.held
        assert Sensitivities(system, eq).potential_gradient[0] == pytest.approx(
            point.factor, rel=1e-5, abs=1e-5
        )


def test_deep_arch(rods, classical):
    """Clamped-hinged arch of 215 degrees, radius 100, EI 1e6, EA 1e8 (DaDeppo and Schmidt 1975;
    Simo and Vu-Quoc 1986, ex. 7.3): crown load 897 at the limit point. 80 elements: within 0.2 %;
    40 give 901.6 (Simo and Vu-Quoc: 905.28).
    """
    limits = {}
    for n in (40, 80):
        builder = SceneBuilder()
        half, radius = np.radians(215) / 2, 100.0
        curved = [1.0, 0, 0, 0, 1 / radius, 0]
        bodies = rods.add(
            builder,
            n,
            [-radius * np.sin(half), 0, radius * np.cos(half)],
            rods.axes_along([np.cos(half), 0, np.sin(half)], [-np.sin(half), 0, np.cos(half)]),
            2 * half * radius,
            [1e8, 5e7, 5e7, 1e9, 1e6, 1e9],
            strain=curved,
            rest_strain=curved,
        )
        builder.pin(bodies[0])
        builder.pin(bodies[-1], (0, 1, 2, 3, 5))
        rods.hold_plane(builder, bodies[1:-1], 1)
        crown = bodies[n // 2]
        path = trace_path(
            builder.build(),
            rods.none,
            DeadForces([crown], [0, 0, -1.0]),
            stop=lambda p: p.displacement > 18,
        )
        limits[n] = path.first("limit").point.factor
    assert limits[80] == pytest.approx(897, rel=2e-3)
    classical("deep clamped-hinged arch: limit load", "DaDeppo, Schmidt 1975", 80, 897, limits[80])
    assert 897 < limits[80] < limits[40] < 905.28


def test_lee_frame(rods, classical):
    """Hinged right-angle frame with legs of 120, loaded at a fifth of its beam (Lee et al. 1968;
    Simo and Vu-Quoc 1986, ex. 7.4): limit load 18,532, then a snap-back. 40 elements a leg: within
    0.2 %.
    """
    n, E = 40, 7.2e6
    stiffness = np.array([6.0, 6.0 * 5 / 6 / 2.6, 6.0 * 5 / 6 / 2.6, 1e3, 2.0, 1e3]) * E
    builder = SceneBuilder()
    along = rods.axes_along([1, 0, 0], [0, 0, 1])
    column = rods.add(
        builder, n, [0, 0, 0], rods.axes_along([0, 0, 1], [-1, 0, 0]), 120.0, stiffness
    )
    short = rods.add(builder, n // 5, [0, 0, 120], along, 24.0, stiffness, first=column[-1])
    rest = rods.add(builder, n - n // 5, [24, 0, 120], along, 96.0, stiffness, first=short[-1])
    for end in (column[0], rest[-1]):
        builder.pin(end, (0, 1, 2, 3, 5))
    rods.hold_plane(builder, [*column[1:], *short[1:], *rest[1:-1]], 1)
    path = trace_path(
        builder.build(),
        rods.none,
        DeadForces(short[-1:], [0, 0, -1.0]),
        stop=lambda p: p.displacement > -25,
    )
    assert [c.kind for c in path.critical] == ["limit", "turning", "turning", "limit"]
    assert path.critical[0].point.factor == pytest.approx(18532, rel=2e-3)
    classical(
        "Lee's frame: limit load",
        "Simo, Vu-Quoc 1986, 7.4",
        80,
        18532,
        path.critical[0].point.factor,
    )
    # between the turning points not even a displacement holds it
    held = [p.held for p in path.points]
    assert held[0] and held[-1] and not all(held)
