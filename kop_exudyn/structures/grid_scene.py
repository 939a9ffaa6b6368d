"""The scene of an orthogonal grid: straight pieces between joints on the surface and corners that a parameter drives.

Rod axes: x along the lamella, y across it in the tangent plane, z along the surface normal. A joint's body has z along
the normal; the first lamella is fixed to it, the second one turns with a free hinge. A corner's body has z along the
lamella's y, about which its hinge turns; the hinge angle is minus the corner parameter, as a turn about y leads
from the normal's side away.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..rods.sections import Material, Section
from ..scene.builder import SceneBuilder
from ..scene.scene import Scene
from .curve_network import CurveNetwork
from .lamellas import Lamella, Lamellas
from .surfaces import Surface

# Rod axes (columns) in the axes of a corner's body: z_body = y_rod, y_body = -z_rod.
_CORNER_FRAME = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


@dataclass(frozen=True)
class GridScene:
    """scene; joints (J,) bodies; hinges (J,) free hinges."""

    scene: Scene
    joints: np.ndarray
    hinges: np.ndarray


def grid_scene(surface: Surface, network: CurveNetwork, straight: Lamellas, section: Section, material: Material,
               elements_per_piece: int) -> GridScene:
    """Joints on the surface, corners over the chords, everything rigidly held by the joint nearest to the middle."""
    builder = SceneBuilder(len(straight.parameters))
    places = surface.at(network.positions)
    tangents = _tangents(straight, network)
    first, second = (np.array([tangents[int(c), j] for j, c in enumerate(column)]) for column in network.pairs.T)
    joints = builder.bodies(places.points, _frames(first, places.normals))
    across = np.cross(places.normals, first)
    hinges = builder.hinges(np.arctan2(np.sum(second * across, axis=1), np.sum(second * first, axis=1)))
    stiffness = section.stiffness(material)
    for lamella in straight.lamellas:
        nodes = _joint_nodes(builder, network, lamella, joints, hinges)
        for k in range(len(lamella.corners)):
            _add_span(builder, lamella, k, places.points, nodes, stiffness, section, elements_per_piece)
    middle = np.linalg.norm(places.points - places.points.mean(axis=0), axis=1)
    builder.pin(int(joints[np.argmin(middle)]))
    return GridScene(builder.build(), joints, hinges)


def _tangents(straight: Lamellas, network: CurveNetwork) -> dict[tuple[int, int], np.ndarray]:
    """Unit tangents by (curve, joint)."""
    return {(lamella.run.number, int(j)): t for lamella in straight.lamellas
            for j, t in zip(lamella.run.joints, lamella.tangents)}


def _joint_nodes(builder: SceneBuilder, network: CurveNetwork, lamella: Lamella, joints: np.ndarray,
                 hinges: np.ndarray) -> np.ndarray:
    """A node at each joint of a lamella, in order."""
    run = lamella.run
    turns = network.pairs[run.joints, 1] == run.number
    return builder.nodes(joints[run.joints], np.where(turns, hinges[run.joints], -1))


def _add_span(builder: SceneBuilder, lamella: Lamella, k: int, points: np.ndarray, nodes: np.ndarray,
              stiffness: np.ndarray, section: Section, pieces: int) -> None:
    """Two straight pieces and the corner between two joints of a lamella."""
    spans, following = lamella.spans, (k + 1) % len(nodes)
    a, b = points[lamella.run.joints[[k, following]]]
    normals = lamella.normals[[k, following]]
    chord = b - a
    up = normals.sum(axis=0)
    up -= chord * (up @ chord) / (chord @ chord)
    # the flat lamella's chord is a little longer than the one in space: keep its proportion of height to base
    flat = np.sqrt(spans.before[k] ** 2 - spans.heights[k] ** 2) / spans.shares[k]
    lift = spans.heights[k] * np.linalg.norm(chord) / flat
    middle = a + spans.shares[k] * chord + lift * up / np.linalg.norm(up)
    share = spans.shares[k]
    normal = (1 - share) * normals[0] + share * normals[1]
    arriving = _frames((middle - a)[None], normal[None])
    corner = builder.bodies(middle, arriving @ _CORNER_FRAME.T)
    angle = builder.hinges([0.0], parameter=int(lamella.corners[k]), factor=-1.0, prescribed=True)
    arrive, leave = builder.nodes([corner[0]] * 2, [-1, int(angle[0])], _CORNER_FRAME)

    def piece(tail: int, head: int, ends: np.ndarray, sides: np.ndarray, parameter: int) -> None:
        steps = np.linspace(0, 1, pieces + 1)[1:-1, None]
        normal = (1 - steps) * sides[0] + steps * sides[1]
        frames = _frames(np.broadcast_to(ends[1] - ends[0], normal.shape), normal)
        inner = builder.nodes(builder.bodies(ends[0] + steps * (ends[1] - ends[0]), frames))
        builder.rod([tail, *inner, head], stiffness, parameter=parameter, section=section)

    piece(nodes[k], int(arrive), np.array([a, middle]), np.array([normals[0], normal]), int(lamella.before[k]))
    piece(int(leave), nodes[following], np.array([middle, b]), np.array([normal, normals[1]]), int(lamella.after[k]))


def _frames(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """(n, 3, 3) axes as columns: x along x (n, 3), z as close to z (n, 3) as possible."""
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(z, x)
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=2)
