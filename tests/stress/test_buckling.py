"""Bifurcations with known critical loads, found on the path by the change of the pivots' signs."""

from __future__ import annotations

import numpy as np
import pytest

from kop_exudyn.equilibrium.newton import NewtonOptions, solve
from kop_exudyn.equilibrium.path import PathOptions, trace_path
from kop_exudyn.equilibrium.system import System
from kop_exudyn.rods.sections import Material, rectangle
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.scene.loads import DeadForces, HingeTorques

RIGID = 1e7


def first_bifurcation(path) -> float:
    assert path.points[0].stable
    return path.first("bifurcation").point.factor


# Euler's cases: what is held at the loaded end (the other one is clamped), effective length squared
# over length squared
EULER = {
    "free": ((), 4.0),
    "guided": ((1, 2, 3, 4, 5), 0.25),
    "pinned": ((1, 2), (np.pi / 4.493409) ** 2),
}


@pytest.mark.parametrize("held, effective", EULER.values(), ids=EULER.keys())
def test_euler_columns(rods, classical, held, effective):
    """32 elements: within 0.5 %. Bending about both axes alike, so two modes at once."""
    builder = SceneBuilder()
    bodies = rods.add(builder, 32, [0, 0, 0], np.eye(3), 1.0, [RIGID, RIGID, RIGID, 1.0, 1.0, 1.0])
    builder.pin(0)
    builder.pin(bodies[-1], held)
    path = trace_path(
        builder.build(),
        rods.none,
        DeadForces(bodies[-1:], [-1.0, 0, 0]),
        stop=lambda p: p.factor > 1.05 * np.pi**2 / effective,
        options=PathOptions(rotation=1e-7),
    )
    assert first_bifurcation(path) == pytest.approx(np.pi**2 / effective, rel=5e-3)
    classical(
        f"Euler column, effective length {np.sqrt(effective):.3g} L: P L²/EI",
        "Euler 1744",
        32,
        np.pi**2 / effective,
        first_bifurcation(path),
    )
    assert path.points[-1].negative == 2


def test_lateral_buckling_of_a_strip(rods, classical):
    """Cantilever strip bent in its plane by a force at its end (Michell and Prandtl 1899;
    Timoshenko and Gere, art. 6.3): P L^2 = 4.0126 sqrt(EI GJ), EI the small one. 24 elements:
    within 0.3 %.
    """
    EI, GJ = 1.0, 2.0
    builder = SceneBuilder()
    bodies = rods.add(builder, 24, [0, 0, 0], np.eye(3), 1.0, [1e9, 1e9, 1e9, GJ, 1e6, EI])
    builder.pin(0)
    path = trace_path(
        builder.build(),
        rods.none,
        DeadForces(bodies[-1:], [0, 0, -1.0]),
        stop=lambda p: p.factor > 8,
        options=PathOptions(rotation=1e-6),
    )
    assert first_bifurcation(path) == pytest.approx(4.0126 * np.sqrt(EI * GJ), rel=3e-3)
    classical(
        "lateral buckling of a strip: P L²/√(EI GJ)",
        "Michell, Prandtl 1899",
        24,
        4.0126,
        first_bifurcation(path) / np.sqrt(EI * GJ),
    )


def right_angle_frame(rods, n: int):
    """Two legs of 240, section 30 x 0.6 with the long side in the plane; clamped at the first leg's
    end."""
    builder = SceneBuilder()
    stiffness = rectangle(0.6, 30.0).stiffness(Material(71240.0, 0.31))
    first = rods.add(builder, n, [0, 0, 0], rods.axes_along([1, 0, 0], [0, 0, 1]), 240.0, stiffness)
    second = rods.add(
        builder,
        n,
        [240, 0, 0],
        rods.axes_along([0, 0, -1], [1, 0, 0]),
        240.0,
        stiffness,
        first=first[-1],
    )
    builder.pin(0)
    return builder.build(), second[-1]


def test_right_angle_frame(rods, classical):
    """Argyris et al., CMAME 20 (1979); Simo and Vu-Quoc (1986), ex. 7.6: an in-plane force at the
    free end, along the clamped leg and away from the clamp, buckles the frame sideways at 1.088 to
    1.09. 24 elements a leg: within 0.5 %.
    """
    scene, end = right_angle_frame(rods, 24)
    path = trace_path(
        scene,
        rods.none,
        DeadForces([end], [1.0, 0, 0]),
        stop=lambda p: p.factor > 1.5,
        options=PathOptions(rotation=1e-3),
    )
    assert first_bifurcation(path) == pytest.approx(1.088, rel=5e-3)
    classical(
        "right-angle frame: lateral buckling load",
        "Argyris et al. 1979",
        48,
        1.088,
        first_bifurcation(path),
    )


@pytest.mark.parametrize("side", [1, -1])
def test_right_angle_frame_after_buckling(rods, side):
    """Above the critical load a planar start ends in the chosen side's buckled state, and the two
    are mirror images."""
    scene, end = right_angle_frame(rods, 8)
    scene = scene.with_terms(DeadForces([end], [1.3, 0, 0]))
    system = System(scene)
    preferred = np.zeros(scene.n_dofs)
    preferred[6 * end + 1] = side
    eq = solve(system, rods.none, options=NewtonOptions(side=preferred[system.sparsity.free]))
    assert eq.escapes >= 1 and side * eq.state.positions[end, 1] > 10
    mirrored = solve(
        System(scene), rods.none, options=NewtonOptions(side=-preferred[system.sparsity.free])
    )
    assert np.allclose(mirrored.state.positions * [1, -1, 1], eq.state.positions, atol=1e-4)


def test_twisted_straight_rod(rods, classical):
    """Greenhill 1883, for clamped ends of which one may turn about and slide along the axis: the
    torque at which a straight rod leaves its axis is 2 u EI/L with tan u = u, u = 4.493409. 24
    elements: within 0.1 %.
    """
    n, EI, GJ = 24, 1.0, 1.0
    K = [RIGID, RIGID, RIGID, GJ, EI, EI]
    builder = SceneBuilder()
    axes = rods.axes_along([0, 0, 1], [1, 0, 0])
    bodies = rods.add(builder, n - 1, [0, 0, 0], axes, 1 - 1 / n, K)
    end = builder.bodies([[0, 0, 1.0]])
    hinge = builder.hinges([0.0])
    builder.rod(
        [builder.nodes(bodies[-1:])[0], builder.nodes(end, hinge, axes)[0]], K, length=1 / n
    )
    builder.pin(bodies[0])
    builder.pin(end[0], (0, 1, 3, 4, 5))
    scene = builder.build()
    path = trace_path(
        scene,
        rods.none,
        HingeTorques(hinge, 1.0, scene.n_bodies),
        stop=lambda p: p.factor > 9.5,
        options=PathOptions(rotation=0.3),
    )
    critical = path.first("bifurcation").point
    assert critical.factor == pytest.approx(2 * 4.493409 * EI, rel=1e-3)
    classical(
        "twisted straight rod: torque L/EI", "Greenhill 1883", n, 2 * 4.493409, critical.factor / EI
    )
    # twisted by more than a turn
    assert critical.displacement == pytest.approx(critical.factor / GJ, rel=1e-6)


def test_twisted_ring(rods, classical):
    """Michell 1889 (Zajac 1962; Goriely 2006): a straight isotropic rod, bent to a ring of radius R
    and twisted before its ends are joined, leaves the plane at a twisting moment of sqrt(3) EI/R.
    48 elements: within 0.3 %.
    """
    n, EI = 48, 1.0
    K = [1e6, 1e6, 1e6, 1.0, EI, EI]
    turn = np.arange(n) * 2 * np.pi / n
    x = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    axes = np.array([rods.axes_along([-np.sin(a), np.cos(a), 0], [0, 0, 1]) for a in turn])
    builder = SceneBuilder()
    # its z along the ring: the ends turn against each other about it
    joint_axes = rods.axes_along([0, 0, 1], [0, 1, 0])
    joint = builder.bodies(x[:1], joint_axes[None])
    others = builder.bodies(x[1:], axes[1:])
    hinge = builder.hinges([0.0])
    begin, end = (builder.nodes(joint, h, joint_axes.T @ axes[0])[0] for h in (-1, hinge[0]))
    builder.rod([begin, *builder.nodes(others), end], K, length=2 * np.pi)
    builder.pin(joint[0])
    # the plane may turn about the tangent at the joint: a rigid motion, as a ring has no side
    builder.pin(n // 2, (2,))
    scene = builder.build()
    path = trace_path(
        scene,
        rods.none,
        HingeTorques(hinge, 1.0, scene.n_bodies),
        stop=lambda p: p.factor > 1.9,
        options=PathOptions(rotation=0.3),
    )
    assert first_bifurcation(path) == pytest.approx(np.sqrt(3) * EI, rel=3e-3)
    classical(
        "twisted ring: torque R/EI", "Michell 1889", n, np.sqrt(3), first_bifurcation(path) / EI
    )
    # twisted and bent elements are helices, which tilts the ring against the joint by O(h^2): no
    # further than that
    assert all(np.abs(p.state.positions[:, 2]).max() < 3e-3 for p in path.points if p.factor < 1.8)
