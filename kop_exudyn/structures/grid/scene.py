"""The scene of an orthogonal grid: straight pieces between joints on the surface and corners that a
parameter drives.

Rod axes: x along the lamella, y across it in the tangent plane, z along the surface normal. A
joint's body has z along the normal; the first lamella is fixed to it, the second one turns with a
free hinge. A corner's body has z along the lamella's y, about which its hinge turns; the hinge
angle is minus the corner parameter, as a turn about y leads from the normal's side away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.network import CurveNetwork, middle_joint
from ...geometry.surfaces import Surface
from ...rods.sections import Material, Section
from ...scene.builder import SceneBuilder
from ...scene.scene import Scene
from .lamellas import Lamella, Lamellas

# Rod axes (columns) in the axes of a corner's body: z_body = y_rod, y_body = -z_rod.
_CORNER_FRAME = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


@dataclass(frozen=True)
class GridScene:
    """scene; joints (J,) bodies; hinges (J,) free hinges."""

    scene: Scene
    joints: np.ndarray
    hinges: np.ndarray


def grid_scene(
    surface: Surface,
    network: CurveNetwork,
    straight: Lamellas,
    section: Section,
    material: Material,
    elements_per_piece: int,
    held: np.ndarray | None = None,
) -> GridScene:
    """Joints on the surface, corners over the chords.

    held : joints that keep their places; None: the one nearest to the middle is fixed, which only
        stops rigid motions
    """
    builder = SceneBuilder(len(straight.numbering.parameters))
    places = surface.at(network.joints)
    first, second = (
        np.array([straight.lamellas[c].tangents[k] for c, k in zip(*side)])
        for side in zip(network.pairs.T, network.places.T)
    )
    joints = builder.bodies(places.points, _frames(first, places.normals))
    across = np.cross(places.normals, first)
    hinges = builder.hinges(
        np.arctan2(np.sum(second * across, axis=1), np.sum(second * first, axis=1))
    )
    stiffness = section.stiffness(material)
    for number, lamella in enumerate(straight.lamellas):
        own = lamella.strand.joints
        turns = network.pairs[own, 1] == number
        nodes = builder.nodes(joints[own], np.where(turns, hinges[own], -1))
        for k in range(lamella.strand.n_spans):
            _add_span(
                builder, lamella, k, places.points, nodes, stiffness, section, elements_per_piece
            )
    if held is None:
        builder.pin(int(joints[middle_joint(places.points)]))
    else:
        for joint in held:
            builder.pin(int(joints[joint]), (0, 1, 2))
    return GridScene(builder.build(), joints, hinges)


def _add_span(
    builder: SceneBuilder,
    lamella: Lamella,
    k: int,
    points: np.ndarray,
    nodes: np.ndarray,
    stiffness: np.ndarray,
    section: Section,
    pieces: int,
) -> None:
    """Two straight pieces and the corner between two joints of a lamella."""
    spans, numbers, ends = lamella.spans, lamella.numbers, lamella.strand.ends[k]
    a, b = points[lamella.strand.joints[ends]]
    normals = lamella.normals[ends]
    chord = b - a
    up = normals.sum(axis=0)
    up -= chord * (up @ chord) / (chord @ chord)
    # the flat lamella's chord is a little longer than the one in space: keep its proportion of
    # height to base
    flat = np.sqrt(spans.before[k] ** 2 - spans.heights[k] ** 2) / spans.shares[k]
    lift = spans.heights[k] * np.linalg.norm(chord) / flat
    middle = a + spans.shares[k] * chord + lift * up / np.linalg.norm(up)
    share = spans.shares[k]
    normal = (1 - share) * normals[0] + share * normals[1]
    arriving = _frames((middle - a)[None], normal[None])
    corner = builder.bodies(middle, arriving @ _CORNER_FRAME.T)
    angle = builder.hinges([0.0], parameter=int(numbers.corners[k]), factor=-1.0, prescribed=True)
    arrive, leave = builder.nodes([corner[0]] * 2, [-1, int(angle[0])], _CORNER_FRAME)

    def piece(
        tail: int,
        head: int,
        line: np.ndarray,
        sides: np.ndarray,
        parameter: int,
        cut: tuple[bool, bool],
    ) -> None:
        steps = np.linspace(0, 1, pieces + 1)[1:-1, None]
        normal = (1 - steps) * sides[0] + steps * sides[1]
        frames = _frames(np.broadcast_to(line[1] - line[0], normal.shape), normal)
        inner = builder.nodes(builder.bodies(line[0] + steps * (line[1] - line[0]), frames))
        along = [tail, *inner, head]
        builder.rod(along, stiffness, parameter=parameter, section=section, cut=cut)

    first, last = nodes[ends]
    piece(
        first,
        int(arrive),
        np.array([a, middle]),
        np.array([normals[0], normal]),
        int(numbers.before[k]),
        (True, False),
    )
    piece(
        int(leave),
        last,
        np.array([middle, b]),
        np.array([normal, normals[1]]),
        int(numbers.after[k]),
        (False, True),
    )


def _frames(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """(n, 3, 3) axes as columns: x along x (n, 3), z as close to z (n, 3) as possible."""
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(z, x)
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=2)
