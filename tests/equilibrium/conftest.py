"""Scenes to be solved: a wheel that uses every feature, a net that opens, and struts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from kop_exudyn.rods.rotations import exp_so3, rotation_z
from kop_exudyn.rods.sections import Material, rectangle
from kop_exudyn.scene.attraction import Attraction
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.scene.loads import DeadForces, HingeTorques
from kop_exudyn.scene.scene import Scene


@dataclass(frozen=True)
class Case:
    scene: Scene
    q: np.ndarray
    opening: float | None


def rod_axes(direction: np.ndarray) -> np.ndarray:
    """Axes (3, 3) with x along a direction and z as upright as possible."""
    x = direction / np.linalg.norm(direction)
    y = np.cross([0.0, 0, 1], x)
    y /= np.linalg.norm(y)
    return np.column_stack([x, y, np.cross(x, y)])


def make_wheel(
    weight: bool = True,
    terms: bool = True,
    actuated: bool = True,
    oblique: bool = True,
    seed: int = 0,
) -> Case:
    """A hub, six rim bodies, spokes and rim of pre-curved rods: a closed structure, all loops
    stressed.

    Parameters: 6 spoke lengths, 6 rim lengths, a driven corner, a driven height.
    oblique : one free hinge and the driven one stand off their bodies, with axes of their own;
        others are the body's z
    """
    rng = np.random.default_rng(seed)
    around = np.arange(6) * np.pi / 3
    places = np.concatenate(
        [
            [[0, 0, 0.3]],
            np.stack([np.cos(around), np.sin(around), 0.1 * np.cos(3 * around)], axis=1),
        ]
    )
    turns = exp_so3(0.3 * rng.normal(size=(7, 3)))
    builder = SceneBuilder(14)
    bodies = builder.bodies(places, turns)
    hinge_axes, centres = np.tile([0.0, 0, 1], (5, 1)), np.zeros((5, 3))
    if oblique:
        hinge_axes[[0, 3]] = [[0.48, -0.36, 0.8], [-0.36, 0.48, 0.8]]
        centres[[0, 3]] = [[0.02, 0.01, -0.03], [-0.02, 0.03, 0.01]]
    angles = np.append(0.2 * rng.normal(size=3), [0.05 + 1.5 * 0.1, -0.3])
    free = builder.hinges(angles[:3], axis=hinge_axes[:3], centre=centres[:3])
    driven = builder.hinges(
        [0.05], parameter=12, factor=1.5, prescribed=True, axis=hinge_axes[3], centre=centres[3]
    )[0]
    fixed = builder.hinges([-0.3], prescribed=True)[0]
    hinges = dict(zip(bodies[1:], (*free, driven, fixed)))
    K = rectangle(0.05, 0.02).stiffness(Material(1e7, 0.3))

    def rod(first: int, last: int, parameter: int, hinge: int = -1) -> None:
        gap = places[last] - places[first]
        axes = rod_axes(gap)
        offsets = 0.05 * rng.normal(size=(2, 3))
        turned = (
            turns[first] @ exp_so3(angles[hinge] * hinge_axes[hinge])
            if hinge >= 0
            else turns[first]
        )
        tail = builder.nodes([first], hinge, turned.T @ axes, offsets[0])[0]
        head = builder.nodes([last], -1, turns[last].T @ axes, offsets[1])[0]
        inner = builder.bodies(places[first] + gap / 2, axes[None])
        builder.rod(
            [tail, builder.nodes(inner)[0], head],
            K,
            length=0.02,
            parameter=parameter,
            curvature=[0.1, -0.2, 0.15],
            weight=[0.3, -0.2, -2.0] if weight else None,
        )

    for k in range(6):
        rod(0, 1 + k, k)
        rod(1 + k, 1 + (k + 1) % 6, 6 + k, hinges.get(1 + k, -1))
    builder.prescribe(4, 2, parameter=13, factor=-2.0, constant=0.1)
    builder.pin(1)
    builder.pin(3, (1, 2))
    if actuated:
        builder.mean_angle(free[:2])
    if terms:
        builder.term(
            DeadForces([0, 5], [[0.1, 0, -0.3], [0, 0.2, 0.1]], [[0.1, 0.05, 0], [0, 0, 0.2]])
        )
        builder.term(HingeTorques(free[2:], 0.02, 7 + 12))
        builder.term(Attraction([[2, 6]], targets=[[0.5, 0.1, 0.2]], target_weight=2.0))
    q = np.concatenate([np.full(6, 1.0), np.full(6, 0.97), [0.1, 0.1]]) + 0.01 * rng.normal(size=14)
    return Case(builder.build(), q, -0.05 if actuated else None)


def make_net(n: int, sub: int = 2, width: float = 0.03) -> Case:
    """n x n joints of a curved grid, opened by its mean angle: straight half pieces that meet in
    corners.

    The grid is the image of a square under z -> sinh(0.8 z)/0.8. Parameters: lengths of all half
    pieces.
    """
    places = np.linspace(-0.8, 0.8, n)
    square = 0.8 * (places[:, None] + 1j * places)
    points, slope = np.sinh(square) / 0.8, np.cosh(square)
    K = rectangle(width, 0.004).stiffness(Material(2.1e9, 0.35))
    rods = [(points[:, k], slope[:, k]) for k in range(n)] + [
        (points[k, :], 1j * slope[k, :]) for k in range(n)
    ]
    builder = SceneBuilder(2 * (n - 1) * len(rods))
    joints: dict[complex, tuple[int, float]] = {}
    lengths, free = [], []
    for rod, tangent in rods:
        path = np.insert(rod, np.arange(1, n), _corners(rod, tangent))
        steps = np.diff(path)
        angle = np.unwrap(np.angle(steps))
        before = None
        for k, place in enumerate(path):
            coming = angle[max(k - 1, 0)]
            if k % 2:
                body = builder.bodies(_point(place), rotation_z(coming))[0]
                bend = builder.hinges([angle[k] - coming], prescribed=True)[0]
                into, out = builder.nodes([body])[0], builder.nodes([body], bend)[0]
            elif place in joints:
                body, reference = joints[place]
                hinge = builder.hinges([coming - reference])[0]
                free.append(hinge)
                into = out = builder.nodes([body], hinge)[0]
            else:
                body = builder.bodies(_point(place), rotation_z(coming))[0]
                joints[place] = body, coming
                into = out = builder.nodes([body])[0]
            if before is not None:
                between = path[k - 1] + (place - path[k - 1]) * np.arange(1, sub) / sub
                inner = (
                    builder.nodes(builder.bodies(_point(between), rotation_z(coming)))
                    if sub > 1
                    else []
                )
                builder.rod([before, *inner, into], K, parameter=len(lengths))
                lengths.append(abs(steps[k - 1]))
            before = out
    builder.mean_angle(free)
    builder.pin(joints[points[n // 2, n // 2]][0])
    scene = builder.build()
    return Case(scene, np.array(lengths), float(scene.initial.angles[free].mean()))


def _corners(rod: np.ndarray, tangent: np.ndarray) -> np.ndarray:
    """Where the tangents at neighbouring joints meet; the middle where they are parallel."""
    a, b, gap = tangent[:-1], tangent[1:], rod[1:] - rod[:-1]
    across = (a.conjugate() * b).imag
    straight = np.abs(across) < 1e-9 * np.abs(a * b)
    along = (gap.conjugate() * b).imag / np.where(straight, 1.0, across)
    return np.where(straight, rod[:-1] + gap / 2, rod[:-1] + along * a)


def _point(place) -> np.ndarray:
    place = np.atleast_1d(place)
    return np.stack([place.real, place.imag, 0 * place.real], axis=1)


def make_strut(
    n: int = 8, force: float = 0.0, stiffness=(2e4, 1e4, 1e4, 0.8, 1.0, 2.0), planar: bool = False
) -> Scene:
    """A cantilever of length 1 along x, pressed at its free end; Euler load pi^2/4 about y."""
    builder = SceneBuilder()
    bodies = builder.bodies(np.linspace([0, 0, 0], [1, 0, 0], n + 1))
    builder.rod(builder.nodes(bodies), stiffness, length=1.0)
    builder.pin(0)
    if planar:
        for body in bodies[1:]:
            builder.pin(body, (1, 3, 5))
    if force:
        builder.term(DeadForces([n], [-force, 0, 0]))
    return builder.build()


@pytest.fixture(scope="session")
def wheel():
    return make_wheel


@pytest.fixture(scope="session")
def net():
    return make_net


@pytest.fixture(scope="session")
def strut():
    return make_strut
