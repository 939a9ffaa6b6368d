"""Scenes of a C-shell: the smooth design of pre-curved rods, and the straightened one with its
corners.

Both have the same bodies: joints, then along each strand the corners and the inner nodes of the
half-pieces. In the smooth design a corner is a node of the curved rod, at the same share of the
span. So a state of one design becomes a start for the other by the flat networks' difference,
carried along with each body.

The joint axis is the body's z axis. At a joint the first curve's rod is fixed to the body, the
second one turns with a free hinge. A corner holds the two pieces of a rod, the second one behind a
hinge whose angle a parameter drives.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.curves import direction
from ...geometry.network import CurveNetwork, Strand, middle_joint
from ...rods.rotations import rotation_z
from ...rods.sections import Material, Section
from ...scene.builder import SceneBuilder
from ...scene.scene import Scene
from ...scene.state import State
from ..numbering import Numbering, StrandNumbers, number_pieces
from .straightening import StraightStrand, straighten

# height, and turns out of the plane: what an assembly lying on the floor can't do
PLANAR = (2, 3, 4)


@dataclass(frozen=True)
class RodModel:
    """What all rods are modelled with.

    rod_offset : distance of the two rods' axes at a joint, along the joint axis
    elements : rod elements of each half-piece
    """

    section: Section
    material: Material
    rod_offset: float = 0.0
    elements: int = 2

    @property
    def stiffness(self) -> np.ndarray:
        return self.section.stiffness(self.material)


@dataclass(frozen=True)
class HalfPiece:
    """What lies between a joint and a corner (or a free tip), in the direction of its strand.

    strand : number of its curve; bodies (elements + 1,) : from one end to the other
    stations (elements + 1,) : arc lengths on the smooth curve
    angles (elements + 1,) : the smooth curve's directions there, rad
    parameter : its length's place in q
    """

    strand: int
    bodies: np.ndarray
    stations: np.ndarray
    angles: np.ndarray
    parameter: int


@dataclass(frozen=True)
class ShellLayout:
    """All bodies of a C-shell in the plane, for both of its designs.

    smooth, straight (n, 3) : x, y and direction (rad) of every body
    hinges (2, n_joints) : joint angles of the smooth and of the straightened design
    halves (n_joints,) : half-turns between the hinge and the second rod's direction of travel
    pieces : half-pieces; corners (m, 2) : body and parameter of every corner
    numbering : the straightened design's parameters and elements
    """

    network: CurveNetwork
    smooth: np.ndarray
    straight: np.ndarray
    hinges: np.ndarray
    halves: np.ndarray
    pieces: list[HalfPiece]
    corners: np.ndarray
    numbering: Numbering

    @property
    def joints(self) -> np.ndarray:
        return np.arange(self.network.n_joints)

    def straightened(self, state: State, scene: Scene) -> State:
        """A start for the straightened design's scene, from a state of the smooth one."""
        flat = self.straight - self.smooth
        local = np.einsum(
            "nji,nj->ni",
            rotation_z(self.smooth[:, 2]),
            np.concatenate([flat[:, :2], np.zeros((len(flat), 1))], axis=1),
        )
        n = self.network.n_joints
        return State(
            state.positions + np.einsum("nij,nj->ni", state.rotations, local),
            state.rotations @ rotation_z(flat[:, 2]),
            np.concatenate(
                [state.angles[:n] + self.hinges[1] - self.hinges[0], scene.initial.angles[n:]]
            ),
        )


def lay_out(network: CurveNetwork, elements: int) -> ShellLayout:
    """Straighten all strands, number their parameters, and place all bodies.

    Raises InputError where one corner can't follow a span.
    """
    straights = [straighten(strand, network.joints) for strand in network.strands]
    numbering = number_pieces(
        network.strands, [s.lengths for s in straights], [s.corners for s in straights]
    )
    build = _LayoutBuilder(network, elements)
    for number, (straight, numbers) in enumerate(zip(straights, numbering.strands)):
        build.add(number, straight, numbers)
    return build.finish(straights, numbering)


def shell_scene(
    layout: ShellLayout,
    model: RodModel,
    *,
    straight: bool,
    planar: bool = False,
    imperfection: float = 0.0,
) -> Scene:
    """The smooth or the straightened design's scene, laid out flat; its actuation is the mean
    opening angle.

    planar : out-of-plane freedoms removed
    imperfection : height, relative to the size, of a shallow surface that the rods' rest shapes
        follow
    """
    network = layout.network
    build = SceneBuilder(len(layout.numbering.parameters) if straight else 0)
    poses = layout.straight if straight else layout.smooth
    lift = 0.5 * model.rod_offset
    bodies = build.bodies(
        np.concatenate([poses[:, :2], _heights(layout, lift)[:, None]], axis=1),
        rotation_z(poses[:, 2]),
    )
    hinges = build.hinges(layout.hinges[int(straight)])
    ends = _EndNodes(build, layout, hinges, lift)
    if straight:
        ends.add_corners()
    inner, stiffness = build.nodes(bodies), model.stiffness
    for piece in layout.pieces:
        nodes = [ends.node(piece, 0), *inner[piece.bodies[1:-1]], ends.node(piece, -1)]
        nodes = [int(inner[b] if n is None else n) for n, b in zip(nodes, piece.bodies)]
        strain = _rest_strain(layout, piece, straight, imperfection)
        length = {"parameter": piece.parameter} if straight else {"length": np.diff(piece.stations)}
        first, last = (bool(body < network.n_joints) for body in piece.bodies[[0, -1]])
        build.rod(
            nodes,
            stiffness,
            section=model.section,
            rest_strain=strain,
            cut=(first, last),
            **length,
        )
    build.mean_angle(hinges[network.opens])
    build.pin(int(bodies[middle_joint(network.joints)]))
    if planar:
        for body in bodies:
            build.pin(int(body), PLANAR)
    return build.build()


class _LayoutBuilder:
    """Collects bodies strand by strand."""

    def __init__(self, network: CurveNetwork, elements: int):
        self.network, self.elements = network, elements
        flat = np.concatenate([network.joints, network.directions[:, :1]], axis=1)
        self.smooth, self.straight = [flat], [flat.copy()]
        self.n_bodies = len(flat)
        self.pieces: list[HalfPiece] = []
        self._stations: list[np.ndarray] = []  # of the bodies of the strand that is being added
        self._drafts: list[tuple[np.ndarray, np.ndarray, int]] = []  # and of its pieces
        self.corners: list[tuple[int, int]] = []

    def add(self, number: int, straight: StraightStrand, numbers: StrandNumbers) -> None:
        strand = straight.strand
        for end, parameter in zip((0, -1), numbers.tips):
            if parameter is not None:
                self._tip(straight, end, parameter)
        for k, ((tail, head), (begin, end)) in enumerate(
            zip(strand.joints[strand.ends], strand.spans)
        ):
            l1, l2 = straight.lengths[k]
            angles = straight.angles[k], straight.angles[k] + straight.corners[k]
            a, b = self.network.joints[[tail, head]]
            middle = begin + l1 / (l1 + l2) * (end - begin)
            x = a + l1 * direction(angles[0]) if straight.exact[k] else 0.5 * (a + b)
            body = self._bodies(np.array([middle]), x[None], angles[0])[0]
            self.corners.append((body, int(numbers.corners[k])))
            self._piece((tail, body), (begin, middle), (a, x), angles[0], numbers.before[k])
            self._piece((body, head), (middle, end), (x, b), angles[1], numbers.after[k])
        self._evaluate(number, strand)

    def _evaluate(self, number: int, strand: Strand) -> None:
        """Ask the strand's curve about all its bodies and pieces at once."""
        if not self._drafts:
            return
        n = sum(map(len, self._stations))
        s = np.concatenate([*self._stations, *(stations for _, stations, _ in self._drafts)])
        x, angle = strand.curve.pose(s)
        self.smooth.append(np.concatenate([x[:n], angle[:n, None]], axis=1))
        of_pieces = angle[n:].reshape(len(self._drafts), self.elements + 1)
        for (bodies, stations, parameter), angles in zip(self._drafts, of_pieces):
            self.pieces.append(HalfPiece(number, bodies, stations, angles, parameter))
        self._stations, self._drafts = [], []

    def finish(self, straights: list[StraightStrand], numbering: Numbering) -> ShellLayout:
        network = self.network
        smooth, straight = np.concatenate(self.smooth), np.concatenate(self.straight)
        turn = network.directions[:, 1] - network.directions[:, 0]
        hinge = network.opening_angles
        shift = np.array(
            [
                [
                    straights[c].angles[k] - straights[c].strand.angles[k]
                    for c, k in zip(pair, place)
                ]
                for pair, place in zip(network.pairs, network.places)
            ]
        )
        straight[: network.n_joints, 2] += shift[:, 0]
        return ShellLayout(
            network,
            smooth,
            straight,
            np.stack([hinge, hinge + shift[:, 1] - shift[:, 0]]),
            np.round((turn - hinge) / np.pi).astype(int),
            self.pieces,
            np.array(self.corners, int).reshape(-1, 2),
            numbering,
        )

    def _tip(self, straight: StraightStrand, end: int, parameter: int) -> None:
        """The free end before the first (0) or after the last (-1) joint."""
        strand = straight.strand
        length = strand.tail if end else strand.head
        joint, at, angle = strand.joints[end], strand.stations[end], straight.angles[end]
        x, far = self.network.joints[joint], at + length if end else at - length
        tip = x + (length if end else -length) * direction(angle)
        body = self._bodies(np.array([far]), tip[None], angle)[0]
        if end:
            self._piece((joint, body), (at, far), (x, tip), angle, parameter)
        else:
            self._piece((body, joint), (far, at), (tip, x), angle, parameter)

    def _piece(
        self,
        ends: tuple[int, int],
        stations: tuple[float, float],
        points: tuple[np.ndarray, np.ndarray],
        angle: float,
        parameter: int,
    ) -> None:
        share = np.linspace(0, 1, self.elements + 1)
        s = stations[0] + share * (stations[1] - stations[0])
        x = points[0] + share[1:-1, None] * (points[1] - points[0])
        inner = self._bodies(s[1:-1], x, angle)
        self._drafts.append((np.array([ends[0], *inner, ends[1]]), s, int(parameter)))

    def _bodies(self, s: np.ndarray, x: np.ndarray, angle: float) -> np.ndarray:
        """Bodies at arc lengths s of the smooth curve and at x (n, 2) of a straight piece."""
        self._stations.append(s)
        self.straight.append(np.concatenate([x, np.full((len(s), 1), angle)], axis=1))
        self.n_bodies += len(s)
        return np.arange(self.n_bodies - len(s), self.n_bodies)


class _EndNodes:
    """Nodes at the ends of half-pieces: on joints for each of the two rods, on corners before and
    behind the hinge."""

    def __init__(self, build: SceneBuilder, layout: ShellLayout, hinges: np.ndarray, lift: float):
        self.build, self.layout = build, layout
        n = layout.network.n_joints
        flipped = np.where(layout.halves % 2 == 1, -1.0, 1.0)
        frames = np.zeros((n, 3, 3))
        frames[:, 0, 0], frames[:, 1, 1], frames[:, 2, 2] = flipped, flipped, 1.0
        first = build.nodes(layout.joints, offset=[[0.0, 0.0, -lift]])
        second = build.nodes(layout.joints, hinges, frames, [[0.0, 0.0, lift]])
        self._joint = np.stack([first, second], axis=1)
        self._leaving: dict[int, int] = {}

    def add_corners(self) -> None:
        bodies, parameters = self.layout.corners.T
        hinges = self.build.hinges(np.zeros(len(bodies)), parameter=parameters, prescribed=True)
        self._leaving = dict(zip(bodies.tolist(), self.build.nodes(bodies, hinges).tolist()))

    def node(self, piece: HalfPiece, end: int) -> int | None:
        """The node at a half-piece's end; None where it is the body's plain node."""
        body = int(piece.bodies[end])
        if body < self.layout.network.n_joints:
            return int(self._joint[body, int(self.layout.network.pairs[body, 1] == piece.strand)])
        return self._leaving.get(body) if end == 0 else None


def _heights(layout: ShellLayout, lift: float) -> np.ndarray:
    """Heights (n,) of all bodies: joints at zero, the rods' bodies between the heights of their
    nodes at the joints."""
    z = np.zeros(len(layout.smooth))
    if not lift:
        return z
    n, pairs = layout.network.n_joints, layout.network.pairs
    at_joint: dict[int, list[float]] = {}
    for piece in layout.pieces:
        for body in piece.bodies[[0, -1]]:
            if body < n:
                height = lift if pairs[body, 1] == piece.strand else -lift
                at_joint.setdefault(
                    int(piece.bodies[0] if body == piece.bodies[-1] else piece.bodies[-1]), []
                ).append(height)
                z[piece.bodies[1:-1]] = height
    for body, heights in at_joint.items():
        z[body] = np.mean(heights)
    return z


def _rest_strain(
    layout: ShellLayout, piece: HalfPiece, straight: bool, imperfection: float
) -> np.ndarray:
    """(elements, 6) rest strain measure: straight, or such that the flat smooth network is
    unstressed."""
    strain = np.zeros((len(piece.bodies) - 1, 6))
    poses = (layout.straight if straight else layout.smooth)[piece.bodies]
    angles = piece.angles
    if straight:
        strain[:, 0] = 1.0
    else:
        strain[:, [0, 1, 5]] = (
            _planar_motions(poses[:, :2], angles) / np.diff(piece.stations)[:, None]
        )
    if imperfection:
        c, s = np.cos(angles[:-1]), np.sin(angles[:-1])
        xx, xy, yy = imperfection / layout.network.size * _SHALLOW
        strain[:, 3] = (yy - xx) * c * s + xy * (c * c - s * s)
        strain[:, 4] = -(xx * c * c + 2 * xy * c * s + yy * s * s)
    return strain


# Second derivatives of the shallow surface of imperfect rest shapes, unlike those of any symmetric
# buckling mode.
_SHALLOW = np.array([3.4, 0.3, 0.6])


def _planar_motions(x: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """(k, 3) stretch, shear and turn h = log(H_i^-1 H_i+1) between poses (k + 1) after each other
    in the plane."""
    phi = np.diff(angles)
    step, c, s = np.diff(x, axis=0), np.cos(angles[:-1]), np.sin(angles[:-1])
    p = c * step[:, 0] + s * step[:, 1], c * step[:, 1] - s * step[:, 0]
    half = 0.5 * phi
    a = np.where(
        np.abs(half) < 1e-4, 1 - half**2 / 3, half / np.tan(np.where(half == 0, 1.0, half))
    )
    return np.stack([a * p[0] + half * p[1], a * p[1] - half * p[0], phi], axis=1)
