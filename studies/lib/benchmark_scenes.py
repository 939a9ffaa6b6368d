"""Scenes for measuring time against size and error: a cantilever under its weight, a gridshell of
any size."""

from __future__ import annotations

import numpy as np

from kop_exudyn.rods.rotations import rotation_z
from kop_exudyn.rods.sections import Material, rectangle
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.scene.scene import Scene

_TIMBER = Material(1e9, 0.3)
_SAG = 0.2  # of a gridshell's side: rise of its middle


def cantilever(elements: int, load: float = 3.0) -> tuple[Scene, np.ndarray]:
    """A clamped flat strip of length 1 under its weight w, with w L^3 / EI = load; and its empty
    parameters.

    Its joint is the free end, the last body. Starts straight and unstressed.
    """
    stiffness = rectangle(0.05, 0.01).stiffness(_TIMBER)
    weight = load * float(stiffness[4:].min())
    builder = SceneBuilder()
    bodies = builder.bodies(np.linspace([0.0, 0, 0], [1, 0, 0], elements + 1))
    builder.rod(builder.nodes(bodies).tolist(), stiffness, length=1.0, weight=[0, 0, -weight])
    builder.pin(0)
    return builder.build(), np.zeros(0)


def gridshell(
    joints: int, pieces: int = 3, shrink: float = 0.0, load: float = 0.0
) -> tuple[Scene, np.ndarray]:
    """joints x joints hubs on a low dome of side 1, held along its edges, with rods of `pieces`
    elements between them.

    The rods' rest lengths, one parameter each, are the distances of the hubs times 1 - shrink;
    returned with the scene.
    load : weight w of a rod by w L^3 / EI with L = 1 / joints
    """
    stiffness = rectangle(0.1 / joints, 0.03 / joints).stiffness(_TIMBER)
    weight = [0.0, 0.0, -load * float(stiffness[4:].min()) * joints**3] if load else None
    x, y = np.meshgrid(np.linspace(0, 1, joints), np.linspace(0, 1, joints), indexing="ij")
    places = np.stack([x, y, 16 * _SAG * x * (1 - x) * y * (1 - y)], axis=-1)
    number = np.arange(joints**2).reshape(joints, joints)
    pairs = np.concatenate(
        [
            np.stack([number[:-1].ravel(), number[1:].ravel()], axis=1),
            np.stack([number[:, :-1].ravel(), number[:, 1:].ravel()], axis=1),
        ]
    )
    places = places.reshape(-1, 3)
    lengths = np.linalg.norm(places[pairs[:, 1]] - places[pairs[:, 0]], axis=1)
    builder = SceneBuilder(len(pairs))
    hubs = builder.bodies(places)
    for k, (first, last) in enumerate(pairs):
        axes = _axes(places[last] - places[first])
        tail, head = builder.nodes([hubs[first], hubs[last]], frame=axes)
        shares = np.arange(1, pieces)[:, None] / pieces
        inner = builder.bodies(places[first] + shares * (places[last] - places[first]), axes)
        builder.rod([tail, *builder.nodes(inner), head], stiffness, parameter=k, weight=weight)
    edge = (x.ravel() % 1 == 0) | (y.ravel() % 1 == 0)
    for hub in hubs[edge]:
        builder.pin(int(hub))
    return builder.build(), (1 - shrink) * lengths


def _axes(direction: np.ndarray) -> np.ndarray:
    """Axes (3, 3) of a rod along a direction, its y axis level."""
    turn = rotation_z(np.arctan2(direction[1], direction[0]))
    slope = np.arctan2(direction[2], np.hypot(*direction[:2]))
    return turn @ np.array(
        [[np.cos(slope), 0, -np.sin(slope)], [0, 1, 0], [np.sin(slope), 0, np.cos(slope)]]
    )
