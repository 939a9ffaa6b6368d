"""Large spatial deflections: the 45-degree bend, the Princeton beam, a helix."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kop_exudyn.rods.rotations import exp_se3, exp_so3
from kop_exudyn.rods.sections import Material, rectangle
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.scene.loads import DeadForces
from kop_exudyn.scene.state import State

# Bathe and Bolourchi, IJNME 14 (1979); NAFEMS 3DNLG-5. Tip displacements of Abaqus' B32: radial,
# along the clamp's tangent, along the load
BEND = [
    (300, (-7.173, -12.17, 40.47)),
    (450, (-10.92, -18.74, 48.70)),
    (600, (-13.73, -23.81, 53.60)),
    (3000, (-25.06, -47.70, 68.46)),
]


def bend(rods, n: int):
    """An eighth of a circle of radius 100, section 1 x 1, clamped at one end; unstressed as it is
    curved."""
    builder = SceneBuilder()
    curved = [1.0, 0, 0, 0, 0, -0.01]
    bodies = rods.add(
        builder,
        n,
        [0, 0, 0],
        rods.axes_along([0, 1, 0], [0, 0, 1]),
        100 * np.pi / 4,
        rectangle(1, 1).stiffness(Material(1e7, 0.0)),
        strain=curved,
        rest_strain=curved,
    )
    builder.pin(0)
    return builder.build(), bodies[-1]


@pytest.mark.parametrize("load, tip", BEND)
def test_45_degree_bend(rods, classical, load, tip):
    """32 elements, each load at once from the unstressed bend: within 0.1 % of the load's
    deflection."""
    scene, end = bend(rods, 32)
    eq = rods.equilibrium(scene.with_terms(DeadForces([end], [0, 0, load])))
    moved = eq.state.positions[end] - scene.initial.positions[end]
    # the bend curves towards +x, so that radial is x
    assert moved == pytest.approx(np.array(tip), abs=1e-3 * np.linalg.norm(tip))
    classical(
        f"45-degree bend, load {load}: deflection along the load",
        "NAFEMS 3DNLG-5",
        32,
        tip[2],
        moved[2],
    )


# Simo and Vu-Quoc, CMAME 58 (1986), ex. 7.5: tip position (along the clamp's tangent, radial,
# load), 8 straight elements
BEND_SIMO = [
    (300, (58.84, 22.33, 40.08)),
    (450, (52.32, 18.62, 48.39)),
    (600, (47.23, 15.79, 53.37)),
]


@pytest.mark.parametrize("load, tip", BEND_SIMO)
def test_45_degree_bend_with_eight_elements(rods, load, tip):
    """Theirs are straight chords, ours are curved: 1 % of the deflection."""
    scene, end = bend(rods, 8)
    x, y, z = rods.equilibrium(scene.with_terms(DeadForces([end], [0, 0, load]))).state.positions[
        end
    ]
    assert np.array([y, x, z]) == pytest.approx(np.array(tip), abs=0.01 * 55)


# Princeton beam experiment, the beam elements of ANSYS as quoted in Exudyn's test suite: load, flap
# displacements (m) at loading angles 0, 15, ... 90 degrees
PRINCETON = [
    (8.896, (0, 0.04208, 0.07939, 0.10899, 0.12989, 0.14219, 0.14625)),
    (13.345, (0, 0.06436, 0.11774, 0.15647, 0.18186, 0.19610, 0.20068)),
]


@pytest.mark.parametrize("load, flaps", PRINCETON)
def test_princeton_beam(rods, classical, load, flaps):
    """20 elements; flap within 0.2 %."""
    stiffness = rectangle(12.3777e-3, 3.2024e-3).stiffness(Material(71.7e9, 0.31))
    builder = SceneBuilder()
    bodies = rods.add(builder, 20, [0, 0, 0], np.eye(3), 0.508, stiffness)
    builder.pin(0)
    scene = builder.build()
    for angle, flap in zip(np.radians(np.arange(0, 91, 15)), flaps):
        force = load * np.array([0, np.cos(angle), np.sin(angle)])
        eq = rods.equilibrium(scene.with_terms(DeadForces(bodies[-1:], force)))
        assert eq.state.positions[-1, 2] == pytest.approx(flap, rel=2e-3, abs=1e-9)
    classical(
        f"Princeton beam, {load} N across: flap, m",
        "Exudyn's test suite",
        20,
        flaps[-1],
        eq.state.positions[-1, 2],
    )


@pytest.mark.parametrize("n", [3, 6, 12])
def test_a_straight_rod_wound_to_a_helix(rods, classical, n):
    """Ends led to the poses of a helix of 0.9 turns: with GJ = EI the rod is one, exact with any
    number of elements."""
    K = [1e5, 1e5, 1e5, 1.0, 1.0, 1.0]
    twist, curvature = 3.0, 4.0
    length = 0.9 * 2 * np.pi / np.hypot(twist, curvature)
    builder = SceneBuilder()
    bodies = rods.add(builder, n, [0, 0, 0], np.eye(3), length, K)
    builder.pin(bodies[0])
    builder.pin(bodies[-1])
    scene = builder.build()
    state = scene.initial
    s = np.linspace(0, length, n + 1)
    for share in np.linspace(0.125, 1, 8):
        p, R = exp_se3(s[:, None] * np.array([1, 0, 0, share * twist, 0, share * curvature]))
        x, Q = state.positions.copy(), state.rotations.copy()
        x[-1], Q[-1] = p[-1], R[-1]
        eq = rods.equilibrium(replace(scene, initial=State(x, Q, state.angles)))
        state = eq.state
        assert np.abs(state.positions - p).max() < 1e-9
        assert np.allclose(eq.stress[:, 3:], share * np.array([twist, 0, curvature]), atol=1e-7)
        assert np.abs(eq.stress[:, :3]).max() < 1e-5
    classical(
        "helix of 0.9 turns from a straight rod: curvature",
        "closed form",
        n,
        curvature,
        eq.stress[0, 5],
    )


def test_placement_and_load_steps_do_not_matter(rods):
    """The bend at 600, turned in space and loaded in two steps."""
    scene, end = bend(rods, 8)
    Q = exp_so3(np.array([1.0, -2.0, 0.5]))
    direct = rods.equilibrium(scene.with_terms(DeadForces([end], [0, 0, 600])))
    half = rods.equilibrium(scene.with_terms(DeadForces([end], [0, 0, 300])))
    stepped = rods.equilibrium(scene.with_terms(DeadForces([end], [0, 0, 600])), half)
    assert np.allclose(stepped.state.positions, direct.state.positions, atol=1e-6)
    turned = scene.with_terms(DeadForces([end], Q @ [0, 0, 600]))
    eq = rods.equilibrium(replace(turned, initial=scene.initial.transformed(Q, np.zeros(3))))
    assert np.allclose(eq.state.positions, direct.state.positions @ Q.T, atol=1e-6)
