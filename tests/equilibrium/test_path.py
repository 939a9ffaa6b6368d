"""Paths through limit points and bifurcations."""

from __future__ import annotations

import numpy as np
import pytest

from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.equilibrium.path import PathOptions, trace_path
from kop_exudyn.equilibrium.stability import softest_mode
from kop_exudyn.equilibrium.system import System
from kop_exudyn.errors import SimulationFailure
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.scene.loads import DeadForces

EA = 100.0


def truss(rise: float, spring: float = 0.0):
    """Two bars to an apex that moves up and down only: planar, one unknown with a closed form."""
    builder = SceneBuilder()
    ends = builder.bodies([[-1.0, 0, 0], [0, 0, rise], [1, 0, 0]])
    tilt = np.arctan(rise)

    def frame(angle):
        return np.array(
            [[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]]
        )

    # next to no stiffness against anything but stretch
    K = [EA, 1e-9, 1e-9, 1e-9, 1e-9, 1e-9]
    builder.rod(
        [
            builder.nodes(ends[:1], frame=frame(tilt))[0],
            builder.nodes(ends[1:2], frame=frame(tilt))[0],
        ],
        K,
        length=np.hypot(1, rise),
    )
    builder.rod(
        [
            builder.nodes(ends[1:2], frame=frame(-tilt))[0],
            builder.nodes(ends[2:], frame=frame(-tilt))[0],
        ],
        K,
        length=np.hypot(1, rise),
    )
    builder.pin(ends[0])
    builder.pin(ends[2])
    builder.pin(ends[1], (0, 1, 3, 4, 5))
    return builder.build()


def column(imperfection: float = 0.0, n: int = 8):
    builder = SceneBuilder()
    x = np.linspace(0, 1, n + 1)
    bodies = builder.bodies(np.stack([x, 0 * x, 0 * x], axis=1))
    builder.rod(
        builder.nodes(bodies),
        [1e5, 1e4, 1e4, 0.8, 1.0, 2.0],
        length=1.0,
        curvature=[0, 2 * imperfection, 0],
    )
    builder.pin(0)
    for body in bodies[1:]:
        builder.pin(body, (1, 3, 5))
    return builder.build()


def test_two_bars_against_the_closed_form():
    """The element's axial strain with its ends' axes held: u = A p, whose x part is the chord along
    the rest axis."""
    rise = 0.1
    path = trace_path(
        truss(rise),
        np.zeros(0),
        DeadForces([1], [0, 0, -1.0]),
        stop=lambda p: p.displacement > 0.25 - rise,
    )
    w = path.displacements + rise  # downward from the start
    length = np.hypot(1, rise)
    # with fixed axes phi = 0, so e = R_0^T (x_1 - x_0) - (l, 0, 0): a linear spring along the rest
    # direction
    assert np.allclose(path.factors, 2 * EA / length * (rise / length) ** 2 * w, rtol=1e-5)
    assert path.critical == ()


def test_an_actuated_scene_is_traced_in_its_torque(net):
    """From the plane through the buckling that leaves it: the path stays in the plane and says that
    it is unstable."""
    case = net(5)
    system = System(case.scene)
    start = solve(system, case.q, opening=case.opening - 0.1)
    path = trace_path(
        case.scene,
        case.q,
        stop=lambda p: p.displacement < case.opening - 0.5,
        direction=-1,
        start=start,
    )
    first, last = path.points[0], path.points[-1]
    assert first.held and not last.held
    assert first.factor == pytest.approx(-start.torque) and first.displacement == pytest.approx(
        start.opening
    )
    for point in path.points[::3]:
        assert np.abs(point.state.positions[:, 2]).max() < 1e-9
        eq = solve(system, case.q, point.state, point.displacement)
        buckled = np.ptp(eq.state.positions[:, 2]) > 1e-6
        assert buckled != point.held
        if point.held:
            assert np.allclose(eq.state.positions, point.state.positions, atol=1e-7)
            assert eq.torque == pytest.approx(-point.factor, rel=1e-5)


def test_euler_load_is_found_as_a_bifurcation():
    path = trace_path(
        column(),
        np.zeros(0),
        DeadForces([8], [-1.0, 0, 0]),
        stop=lambda p: p.factor > 30,
        options=PathOptions(rotation=0.01),
    )
    kinds = [(c.kind, c.point.factor) for c in path.critical]
    loads = [load for kind, load in kinds if kind == "bifurcation"]
    assert loads[0] == pytest.approx(np.pi**2 / 4, rel=0.005)
    assert loads[1] == pytest.approx(9 * np.pi**2 / 4, rel=0.04)
    assert [c.point.negative for c in path.critical[:2]] == [1, 2]
    # the mode is the cosine, largest turn at the tip
    mode = path.critical[0].mode.reshape(8, 3)  # x, z, turn about y of each body
    x = np.arange(1, 9) / 8
    deflection = 1 - np.cos(np.pi * x / 2)
    assert np.allclose(mode[:, 1] / mode[-1, 1], deflection, atol=0.01)
    assert np.abs(mode[:, 0]).max() < 1e-6


def test_the_imperfect_column_has_no_critical_point():
    path = trace_path(
        column(0.02), np.zeros(0), DeadForces([8], [-1.0, 0, 0]), stop=lambda p: p.factor > 3
    )
    assert path.critical == () and all(p.stable for p in path.points)


def test_points_are_equilibria_and_eigenvalues_agree():
    """A shallow arch: every point's stability is that of its softest eigenvalue."""
    scene, load = arch()
    path = trace_path(scene, np.zeros(0), load, stop=lambda p: p.displacement > 0.12)
    assert [c.kind for c in path.critical] == ["limit", "limit"]
    assert any(not p.stable for p in path.points)
    for point in path.points:
        system = System(scene.with_terms(DeadForces(load.bodies, point.factor * load.forces)))
        system.set_parameters(np.zeros(0))
        system.assemble(point.state)
        residual = np.abs(system.gradient[: system.n_unknowns]).max()
        assert residual <= 1e-7 * max(1.0, np.abs(system.stress()).max())
        if min(abs(point.factor - c.point.factor) for c in path.critical) > 1e-3:
            assert (softest_mode(system).eigenvalue > 0) == point.stable
    rates = np.diff(path.displacements)
    # no snap-back: held, the arch is always stable
    assert (rates > 0).all() and all(p.held for p in path.points)


def test_a_limit_point_is_where_the_factor_is_extreme():
    scene, load = arch()
    path = trace_path(scene, np.zeros(0), load, stop=lambda p: p.displacement > 0.12)
    top, bottom = path.critical
    assert top.point.factor >= path.factors[path.displacements < 0].max() - 1e-9
    finer = trace_path(
        scene,
        np.zeros(0),
        load,
        stop=lambda p: p.displacement > 0.12,
        options=PathOptions(rotation=0.01),
    )
    assert finer.first("limit").point.factor == pytest.approx(top.point.factor, rel=2e-7)
    assert abs(top.point.factor_rate) < 1e-3 * path.points[0].factor_rate
    stable = [p for p in path.points if p.stable]
    assert (
        stable[0].displacement
        < top.point.displacement
        < bottom.point.displacement
        < stable[-1].displacement
    )


def test_it_can_be_traced_backwards():
    scene, load = arch()
    there = trace_path(scene, np.zeros(0), load, stop=lambda p: p.displacement > 0.12)
    end = there.points[-1]
    back = trace_path(
        scene,
        np.zeros(0),
        load,
        stop=lambda p: p.displacement < -0.095,
        start=end.state,
        factor=end.factor,
        direction=-1,
    )
    factors = [c.point.factor for c in back.critical]
    assert factors == pytest.approx([c.point.factor for c in reversed(there.critical)], rel=1e-7)


def arch(n: int = 12):
    """A clamped shallow arch with a force on its crown, held in its plane and symmetric."""
    builder = SceneBuilder()
    x = np.linspace(-0.5, 0.5, n + 1)
    bodies = builder.bodies(np.stack([x, 0 * x, 0.1 * np.cos(np.pi * x) ** 2], axis=1))
    gap = np.diff(builder._positions[0], axis=0)
    tilt = np.arctan2(gap[:, 2], gap[:, 0])
    for k in range(n):
        frame = np.array(
            [
                [np.cos(tilt[k]), 0, -np.sin(tilt[k])],
                [0, 1, 0],
                [np.sin(tilt[k]), 0, np.cos(tilt[k])],
            ]
        )
        builder.rod(
            builder.nodes(bodies[k : k + 2], frame=frame),
            [3e3, 1e3, 1e3, 1, 1.0, 1],
            length=np.linalg.norm(gap[k]),
        )
    builder.pin(0)
    builder.pin(n)
    for body in bodies[1:-1]:
        builder.pin(body, (1, 3, 5) if body != n // 2 else (0, 1, 3, 4, 5))
    return builder.build(), DeadForces([n // 2], [0, 0, -1.0])


def test_misuse_and_dead_ends(net):
    scene, load = arch()
    with pytest.raises(ValueError):
        trace_path(scene, np.zeros(0), stop=lambda p: True)
    case = net(3)
    with pytest.raises(ValueError):
        trace_path(case.scene, case.q, load, stop=lambda p: True)
    with pytest.raises(SimulationFailure, match="doesn't end"):
        trace_path(
            scene, np.zeros(0), load, stop=lambda p: False, options=PathOptions(max_points=5)
        )
    with pytest.raises(SimulationFailure, match="no work"):
        trace_path(scene, np.zeros(0), DeadForces([0], [0, 0, 1.0]), stop=lambda p: False)
    with pytest.raises(SimulationFailure, match="no turning point"):
        trace_path(scene, np.zeros(0), load, stop=lambda p: p.displacement > 0.12).first("turning")
