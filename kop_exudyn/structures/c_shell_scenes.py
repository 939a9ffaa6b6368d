"""Scenes of a C-shell: the smooth design of pre-curved rods, and the straightened one with its corners.

The joint axis is the body's z axis. At a joint the first curve's rod is fixed to the body, the second one turns with a
free hinge. A corner is a body between two pieces of a rod, its angle a prescribed hinge that a parameter drives.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..rods.rotations import log_so3, rotation_z
from ..rods.sections import Material, Section
from ..scene.builder import SceneBuilder
from ..scene.scene import Scene
from .curve_network import CurveNetwork
from .straight_network import StraightNetwork, StraightRod

PLANAR = (2, 3, 4)  # height, and turns out of the plane: what an assembly lying on the floor can't do


@dataclass(frozen=True)
class ShellScene:
    """A scene, and where to find things in it.

    joints (J,) : bodies of the joints
    hinges (J,) : their free hinges
    tracks : for every curve, (span, fraction, body) of its bodies between joints, fraction of the span's length
    """

    scene: Scene
    joints: np.ndarray
    hinges: np.ndarray
    tracks: list[list[tuple[int, float, int]]]


@dataclass(frozen=True)
class Layout:
    """What both scenes share: section, material, offset of the two rods along the joint axis."""

    section: Section
    material: Material
    rod_offset: float = 0.0

    @property
    def stiffness(self) -> np.ndarray:
        return self.section.stiffness(self.material)


class _Joints:
    """Joint bodies, hinges, and the node by which each rod sits on a joint."""

    def __init__(self, builder: SceneBuilder, network: CurveNetwork, layout: Layout):
        self.builder, self.layout, self.network = builder, layout, network
        headings = {(run.number, int(j)): run.curve.heading(u)
                    for run in network.runs for j, u in zip(run.joints, run.parameters)}
        first = np.array([headings[int(a), j] for j, (a, _) in enumerate(network.pairs)])
        second = np.array([headings[int(b), j] for j, (_, b) in enumerate(network.pairs)])
        flat = np.concatenate([network.positions, np.zeros((len(first), 1))], axis=1)
        self.bodies = builder.bodies(flat, rotation_z(first))
        self.hinges = builder.hinges(np.mod(second - first + np.pi, 2 * np.pi) - np.pi)

    def node(self, curve: int, joint: int) -> int:
        """A node at a joint, its axes along the curve there."""
        turns = int(self.network.pairs[joint, 1]) == curve
        lift = 0.5 * self.layout.rod_offset * (1 if turns else -1)
        return int(self.builder.nodes([self.bodies[joint]], [self.hinges[joint] if turns else -1],
                                      offset=[[0.0, 0.0, lift]])[0])

    def finish(self, planar: bool) -> Scene:
        """Actuate all hinges, hold the joint nearest to the middle."""
        builder = self.builder
        builder.mean_angle(self.hinges)
        middle = self.network.positions - self.network.positions.mean(axis=0)
        builder.pin(int(self.bodies[np.argmin(np.linalg.norm(middle, axis=1))]))
        scene = builder.build()
        if not planar:
            return scene
        pinned = scene.pinned.copy()
        pinned[: 6 * scene.n_bodies].reshape(-1, 6)[:, PLANAR] = True
        return scene.with_pins(pinned)


def smooth_scene(network: CurveNetwork, layout: Layout, elements_per_span: int, free_ends: bool) -> ShellScene:
    """Pre-curved rods that follow the curves: unstressed in the flat network."""
    builder = SceneBuilder()
    joints = _Joints(builder, network, layout)
    tracks = []
    for run in network.runs:
        curve, track = run.curve, []
        spans = [(joints.node(run.number, a), joints.node(run.number, b), u, v) for a, b, u, v in run.spans]
        if free_ends and not curve.closed:
            u, v = run.parameters[[0, -1]]
            spans += [(None, joints.node(run.number, int(run.joints[0])), 0.0, u)] if u > 1e-9 * curve.end else []
            spans += [(joints.node(run.number, int(run.joints[-1])), None, v, curve.end)] if v < (1 - 1e-9) * curve.end else []
        for k, (tail, head, u, v) in enumerate(spans):
            fractions = np.linspace(0, 1, elements_per_span + 1)
            stops = curve.at_lengths(u, v, fractions)
            headings = curve.heading(u) + np.array([curve.turning(u, s) if s > u else 0.0 for s in stops])
            x = np.concatenate([curve.position(stops), np.zeros((len(stops), 1))], axis=1)
            own = slice(0 if tail is None else 1, None if head is None else -1)
            bodies = builder.bodies(x[own], rotation_z(headings[own]))
            nodes = builder.nodes(bodies).tolist()
            track += [(k, float(f), int(b)) for f, b in zip(fractions[own], bodies)] if k < len(run.spans) else []
            lengths = curve.length(u, v) / elements_per_span
            builder.rod(([] if tail is None else [tail]) + nodes + ([] if head is None else [head]), layout.stiffness,
                        length=np.full(elements_per_span, lengths), section=layout.section,
                        rest_strain=_relative_motions(x, rotation_z(headings)) / lengths)
        tracks.append(track)
    return ShellScene(joints.finish(planar=False), joints.bodies, joints.hinges, tracks)


def straight_scene(network: CurveNetwork, straight: StraightNetwork, layout: Layout, elements_per_piece: int,
                   planar: bool = False) -> ShellScene:
    """Straight pieces and driven corners, laid out along the flat network."""
    builder = SceneBuilder(len(straight.parameters))
    joints = _Joints(builder, network, layout)
    tracks = [_add_rod(builder, joints, rod, straight.parameters, layout, elements_per_piece) for rod in straight.rods]
    return ShellScene(joints.finish(planar), joints.bodies, joints.hinges, tracks)


def _add_rod(builder: SceneBuilder, joints: _Joints, rod: StraightRod, q: np.ndarray, layout: Layout,
             pieces: int) -> list[tuple[int, float, int]]:
    """One straightened curve; returns its track."""
    run, track = rod.run, []
    stations = [joints.node(run.number, int(j)) for j in run.joints]
    if run.curve.closed:
        stations.append(joints.node(run.number, int(run.joints[0])))
    flat = joints.network.positions

    def piece(tail: int, head: int, start: np.ndarray, stop: np.ndarray, heading: float, parameter: int,
              span: int, fractions: tuple[float, float]) -> None:
        steps = np.linspace(0, 1, pieces + 1)[1:-1]
        x = np.concatenate([start + steps[:, None] * (stop - start), np.zeros((len(steps), 1))], axis=1)
        bodies = builder.bodies(x, rotation_z(heading))
        at = fractions[0] + steps * (fractions[1] - fractions[0])
        track.extend((span, float(f), int(b)) for f, b in zip(at, bodies))
        builder.rod([tail, *builder.nodes(bodies), head], layout.stiffness, parameter=parameter, section=layout.section)

    for k, (j0, j1, _, _) in enumerate(run.spans):
        heading, angle = rod.headings[k], q[rod.corners[k]]
        l1, l2 = q[rod.before[k]], q[rod.after[k]]
        corner = int(builder.bodies([[*rod.points[k], 0.0]], rotation_z(heading))[0])
        hinge = builder.hinges([0.0], parameter=int(rod.corners[k]), prescribed=True)
        arrive, leave = builder.nodes([corner, corner], [-1, int(hinge[0])])
        share = l1 / (l1 + l2)
        track.append((k, share, corner))
        piece(stations[k], int(arrive), flat[j0], rod.points[k], heading, int(rod.before[k]), k, (0.0, share))
        piece(int(leave), stations[k + 1], rod.points[k], flat[j1], heading + angle, int(rod.after[k]), k, (share, 1.0))
    for end, (tip, joint) in enumerate(zip(rod.tips, (0, -1))):
        if tip >= 0:
            _add_tip(builder, layout, rod, q, tip, stations[joint], flat[run.joints[joint]], pieces, first=end == 0)
    return track


def _add_tip(builder: SceneBuilder, layout: Layout, rod: StraightRod, q: np.ndarray, parameter: int, station: int,
             joint: np.ndarray, pieces: int, first: bool) -> None:
    """The straight end of a rod beyond its outermost joint."""
    run = rod.run
    heading = run.curve.heading(run.parameters[0 if first else -1])
    direction = np.array([np.cos(heading), np.sin(heading), 0.0]) * q[parameter]
    steps = np.linspace(-1, 0, pieces + 1)[:-1] if first else np.linspace(0, 1, pieces + 1)[1:]
    bodies = builder.bodies(np.append(joint, 0.0) + steps[:, None] * direction, rotation_z(heading))
    nodes = builder.nodes(bodies).tolist()
    builder.rod(nodes + [station] if first else [station] + nodes, layout.stiffness, parameter=parameter,
                section=layout.section)


def _relative_motions(x: np.ndarray, R: np.ndarray) -> np.ndarray:
    """(k, 6) h = log(H_i^-1 H_i+1) of poses after each other, turning about z: u = A(phi) p."""
    p = np.einsum("nji,nj->ni", R[:-1], np.diff(x, axis=0))
    phi = log_so3(np.swapaxes(R[:-1], 1, 2) @ R[1:])
    half = 0.5 * phi[:, 2]
    a = np.where(np.abs(half) < 1e-6, 1 - half**2 / 3, half / np.tan(np.where(half == 0, 1.0, half)))
    u = np.stack([a * p[:, 0] + half * p[:, 1], a * p[:, 1] - half * p[:, 0], p[:, 2]], axis=1)
    return np.concatenate([u, phi], axis=1)
