"""Exudyn's joints between the nodes of a scene: ties, hinges, prescribed angles, pins.

Every joint stands between the frames of two markers. Its equations are Exudyn's own; what is kept
here is which of them belong to what, and the vectors that they are made of, because Exudyn leaves
the stiffness that comes from its joints' reactions out of its Jacobian. With reactions lambda, a
joint's equations of position, x_1 + R_1 p_1 - x_0 - R_0 p_0, and of rotation, (R_0 a) . (R_1 b),
add to the derivative of the residual, for increments R exp(hat(w)),

    hat(p_1) hat(R_1^T lambda)  in (w_1, w_1),   - hat(p_0) hat(R_0^T lambda)  in (w_0, w_0),

    lambda hat(a) hat(R_0^T R_1 b)  in (w_0, w_0),   - lambda hat(a) R_0^T R_1 hat(b)  in (w_0, w_1)

and the same as the last two with the ends exchanged. They are not symmetric, as the residual's
rows of moments are in the nodes' own axes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

import numpy as np

from ..rods.rotations import axes_along_z, hat
from ..scene.scene import Scene
from .exudyn_layout import Carrier, Layout
from .exudyn_library import (
    HELD_COORDINATE,
    HINGE,
    JOINT,
    MARKER_OF_BODY,
    MARKER_OF_COORDINATE,
    MARKER_OF_NODE,
    RIGID_BODY,
    exu,
    item,
)

_GROUND = -1
_I3 = np.eye(3)
_RIGID, _REVOLUTE = (1, 1, 1, 1, 1, 1), (1, 1, 1, 1, 1, 0)


class Condition(IntEnum):
    """What an algebraic equation of Exudyn's asks for."""

    JOINT = 0
    ANGLE = 1
    PIN = 2


@dataclass(frozen=True)
class _End:
    """One side of a joint: a node (or the ground), the joint's axes (3, 3) and place (3,) in it."""

    node: int
    frame: np.ndarray
    place: np.ndarray

    @property
    def pose(self) -> exu.HT:
        return exu.HT(rotation=self.frame, translation=self.place)


@dataclass
class _Joint:
    """One joint: Exudyn's number, its sides, which axes it holds, and what it stands for.

    marker : of its first side; hinge : whose prescribed angle turns that side, or -1; body : whose
    axes in the scene are that side's, or -1; rows : its rotational equations among `_Equations`;
    along : its axes among `_Along`; set : the frame that its first side has been given last
    """

    number: Any
    first: _End
    second: _End
    axes: tuple[int, ...]
    condition: Condition
    marker: Any
    hinge: int = -1
    body: int = -1
    rows: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    along: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    set: np.ndarray | None = None


@dataclass
class _Equations:
    """All equations of rotation (m,) and of position (k,) of the joints, as arrays.

    row : number of the algebraic equation (of position: of its first of three)
    first, second, node : node numbers, -1 the ground; a, b : vectors in the nodes' axes
    a_axis : column of the first side's axes that `a` is; point, sign : p and -1 or 1
    """

    row: np.ndarray
    first: np.ndarray
    second: np.ndarray
    a: np.ndarray
    b: np.ndarray
    a_axis: np.ndarray
    position_row: np.ndarray
    node: np.ndarray
    point: np.ndarray
    sign: np.ndarray


@dataclass
class _Along:
    """Axes that joints hold together, (m,) each: of the first side, a, and of the second one, b.

    kind : `Condition`; the rest as in `_Equations`
    """

    kind: np.ndarray
    first: np.ndarray
    second: np.ndarray
    a: np.ndarray
    b: np.ndarray
    a_axis: np.ndarray


class Joints:
    """All joints of a model: `index` them when the model is assembled, then `set` parameters.

    unit : the model's unit of length, in the scene's
    """

    def __init__(self, mbs: Any, scene: Scene, layout: Layout, nodes: list[Any], unit: float):
        self._mbs, self._layout, self._nodes, self._unit = mbs, layout, nodes, unit
        self._ground = mbs.AddObject(item.ObjectGround())
        fixed = mbs.AddNode(item.NodePointGround())
        self._fixed = mbs.AddMarker(MARKER_OF_COORDINATE(nodeNumber=fixed, coordinate=0))
        self._bodies = {
            c.node: mbs.AddObject(RIGID_BODY(nodeNumber=nodes[c.node]))
            for c in layout.carriers.values()
            if c.rigid
        }
        self._joints: list[_Joint] = []
        self._held: list[tuple[Any, int, int]] = []  # connector, body and axis of a place
        self._offsets: dict[Any, float] = {}
        self._prescribed = scene.initial.angles
        self._add_ties()
        self._add_hinges(scene)
        self._add_pins(scene)

    # -- model -------------------------------------------------------------------------------------
    def _end(self, carrier: Carrier, frame: np.ndarray, place: np.ndarray | None = None) -> _End:
        where = np.zeros(3) if place is None else carrier.frame.T @ place / self._unit
        return _End(carrier.node, carrier.frame.T @ frame, where)

    def _marker(self, end: _End) -> Any:
        if end.node == _GROUND or end.place.any():
            body = self._ground if end.node == _GROUND else self._bodies[end.node]
            return self._mbs.AddMarker(MARKER_OF_BODY(bodyNumber=body, localHT=end.pose))
        node = self._nodes[end.node]
        return self._mbs.AddMarker(MARKER_OF_NODE(nodeNumber=node, localHT=end.pose))

    def _add(
        self,
        first: _End,
        second: _End,
        axes: tuple[int, ...],
        condition: Condition,
        hinge: int = -1,
        body: int = -1,
    ) -> None:
        markers = [self._marker(first), self._marker(second)]
        if axes == _REVOLUTE:
            joint = HINGE(markerNumbers=markers)
        else:
            joint = JOINT(markerNumbers=markers, constrainedAxes=list(axes))
        number = self._mbs.AddObject(joint)
        self._joints.append(_Joint(number, first, second, axes, condition, markers[0], hinge, body))

    def _add_ties(self) -> None:
        for key, node, frame, offset in self._layout.ties:
            first = self._end(self._layout.carriers[key], _I3, offset)
            self._add(first, _End(node, frame.T, np.zeros(3)), _RIGID, Condition.JOINT)

    def _add_hinges(self, scene: Scene) -> None:
        n = 6 * scene.n_bodies
        prescribed = scene.pinned[n:].copy()
        prescribed[scene.driven.dofs[scene.driven.dofs >= n] - n] = True
        for (body, hinge), carrier in self._layout.carriers.items():
            if hinge < 0:
                continue
            hub, centre = self._layout.carriers[body, -1], scene.hinge_centre[hinge]
            if prescribed[hinge]:
                first, second = self._end(hub, _I3, centre), self._end(carrier, _I3)
                self._add(first, second, _RIGID, Condition.ANGLE, hinge=hinge)
            else:
                along = axes_along_z(scene.hinge_axis[hinge])
                first, second = self._end(hub, along, centre), self._end(carrier, along)
                self._add(first, second, _REVOLUTE, Condition.JOINT)

    def _add_pins(self, scene: Scene) -> None:
        """Coordinates that are held at the scene's places, and turns against the scene's axes."""
        n = 6 * scene.n_bodies
        held = scene.pinned[:n].reshape(-1, 6).copy()
        driven = scene.driven.dofs[scene.driven.dofs < n]
        held[driven // 6, driven % 6] = True
        for body in np.flatnonzero(held.any(axis=1)).tolist():
            carrier = self._layout.carriers[body, -1]
            node = self._nodes[carrier.node]
            for axis in np.flatnonzero(held[body, :3]).tolist():
                marker = self._mbs.AddMarker(MARKER_OF_COORDINATE(nodeNumber=node, coordinate=axis))
                connector = HELD_COORDINATE(markerNumbers=[self._fixed, marker])
                self._held.append((self._mbs.AddObject(connector), body, axis))
            if held[body, 3:].any():
                axes = (0, 0, 0, *held[body, 3:].astype(int).tolist())
                first = _End(_GROUND, _I3, np.zeros(3))
                self._add(first, self._end(carrier, _I3), axes, Condition.PIN, body=body)

    # -- equations ---------------------------------------------------------------------------------
    def index(self) -> None:
        """Find every joint's equations, and the vectors that they are made of."""
        system = self._mbs.systemData
        rotations: list[tuple] = []
        positions: list[tuple] = []
        along: list[tuple] = []
        kinds, lengths = {}, set()
        for joint in self._joints:
            rows = system.GetObjectLTGAE(joint.number)
            turned = joint.condition == Condition.ANGLE
            for k, row in enumerate(rows):
                kinds[row] = Condition.JOINT if turned and k < 3 else joint.condition
            if all(joint.axes[:3]):
                lengths.update(rows[:3])
                positions += [
                    (rows[0], end.node, end.place, sign)
                    for end, sign in ((joint.first, -1.0), (joint.second, 1.0))
                    if end.place.any()
                ]
            begin = len(rotations)
            for k, a, b in _products(joint.axes[3:]):
                rotations.append(
                    (
                        rows[3 + k],
                        joint.first.node,
                        joint.second.node,
                        joint.first.frame[:, a],
                        joint.second.frame[:, b],
                        a,
                    )
                )
            joint.rows = np.arange(begin, len(rotations))
            begin = len(along)
            for k in _together(joint.axes[3:]):
                along.append(
                    (
                        int(joint.condition),
                        joint.first.node,
                        joint.second.node,
                        joint.first.frame[:, k],
                        joint.second.frame[:, k],
                        k,
                    )
                )
            joint.along = np.arange(begin, len(along))
        for connector, _, _ in self._held:
            (row,) = system.GetObjectLTGAE(connector)
            kinds[row] = Condition.PIN
            lengths.add(row)
        count = len(kinds)
        self.conditions = np.array([kinds[row] for row in range(count)], int)
        self.is_length = np.isin(np.arange(count), list(lengths))
        self._equations = _Equations(
            *(_column(rotations, k, size) for k, size in enumerate((0, 0, 0, 3, 3, 0))),
            *(_column(positions, k, size) for k, size in enumerate((0, 0, 3, 0))),
        )
        self._along = _Along(*(_column(along, k, n) for k, n in enumerate((0, 0, 0, 3, 3, 0))))

    def set(self, scene: Scene, q: np.ndarray, reference: np.ndarray) -> None:
        """Take a scene's prescribed angles, places and axes; reference (n_nodes, 6) coordinates."""
        state, equations = scene.with_driven(scene.initial, q), self._equations
        turns = scene.hinge_turns(state.angles)
        self._prescribed = state.angles
        for joint in self._joints:
            if joint.hinge >= 0:
                frame = joint.first.frame @ turns[joint.hinge]
            elif joint.body >= 0:
                frame = state.rotations[joint.body]
            else:
                continue
            if joint.set is not None and np.array_equal(frame, joint.set):
                continue
            joint.set = frame
            end = _End(joint.first.node, frame, joint.first.place)
            self._mbs.SetMarkerParameter(joint.marker, "localHT", end.pose)
            equations.a[joint.rows] = frame.T[equations.a_axis[joint.rows].astype(int)]
            self._along.a[joint.along] = frame.T[self._along.a_axis[joint.along].astype(int)]
        for connector, body, axis in self._held:
            node = self._layout.carriers[body, -1].node
            offset = float(state.positions[body, axis] / self._unit - reference[node, axis])
            if offset != self._offsets.get(connector):
                self._offsets[connector] = offset
                self._mbs.SetObjectParameter(connector, "offset", offset)

    def whole_turns(self, angles: np.ndarray) -> float:
        """Full turns, as an angle, by which angles (n_hinges,) miss the prescribed ones at most:
        frames don't tell them.
        """
        hinges = [joint.hinge for joint in self._joints if joint.hinge >= 0]
        turns = np.rint((angles - self._prescribed)[hinges] / (2 * np.pi))
        return float(2 * np.pi * np.abs(turns).max(initial=0.0))

    def reversals(self, rotations: np.ndarray) -> dict[Condition, float]:
        """Angles, where more than a quarter turn, between axes that joints hold together, the
        largest of each kind; rotations (n_nodes, 3, 3).

        Exudyn's equations ask for right angles between the other axes, which half a turn keeps.
        """
        along = self._along
        R = np.concatenate([rotations, _I3[None]])  # the ground is the last one
        ahead = np.einsum("mij,mj->mi", R[along.first], along.a)
        cosine = np.einsum("mi,mij,mj->m", ahead, R[along.second], along.b)
        found: dict[Condition, float] = {}
        for k in np.flatnonzero(cosine < 0.0).tolist():
            kind = Condition(int(along.kind[k]))
            found[kind] = max(found.get(kind, 0.0), float(np.arccos(max(cosine[k], -1.0))))
        return found

    def geometric_stiffness(
        self, rotations: np.ndarray, reactions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What the reactions add to the derivative of the residual, as triplets.

        rotations : (n_nodes, 3, 3); reactions : (n_equations,) Exudyn's multipliers
        """
        e = self._equations
        R = np.concatenate([rotations, _I3[None]])  # the ground is the last one
        R0, R1 = R[e.first], R[e.second]
        b0 = np.einsum("mji,mjk,mk->mi", R0, R1, e.b)
        a1 = np.einsum("mji,mjk,mk->mi", R1, R0, e.a)
        a_hat, b_hat = hat(e.a), hat(e.b)
        by = reactions[e.row][:, None, None]
        across = np.swapaxes(R0, 1, 2) @ R1
        blocks = [
            (e.first, e.first, by * a_hat @ hat(b0)),
            (e.first, e.second, -by * a_hat @ across @ b_hat),
            (e.second, e.second, by * b_hat @ hat(a1)),
            (e.second, e.first, -by * b_hat @ np.swapaxes(across, 1, 2) @ a_hat),
        ]
        force = reactions[e.position_row[:, None] + np.arange(3)]
        own = np.einsum("mji,mj->mi", R[e.node], force)
        blocks.append((e.node, e.node, e.sign[:, None, None] * hat(e.point) @ hat(own)))
        rows, columns, values = [], [], []
        for row, column, block in blocks:
            inner = (row >= 0) & (column >= 0)
            at = (6 * row[inner] + 3)[:, None, None] + np.arange(3)[:, None]
            to = (6 * column[inner] + 3)[:, None, None] + np.arange(3)
            rows.append(np.broadcast_to(at, block[inner].shape).ravel())
            columns.append(np.broadcast_to(to, block[inner].shape).ravel())
            values.append(block[inner].ravel())
        return np.concatenate(rows), np.concatenate(columns), np.concatenate(values)


def _products(axes: tuple[int, ...]) -> list[tuple[int, int, int]]:
    """Exudyn's equations of rotation: number among the three, axis of the first and of the second
    side that have to be perpendicular to each other.

    Where one or two turns are held, the first side's axis is the (first) free one.
    """
    free = [k for k in range(3) if not axes[k]]
    if not free:
        return [(0, 2, 1), (1, 2, 0), (2, 0, 1)]
    if len(free) == 1:
        return [(k, free[0], k) for k in range(3) if axes[k]]
    if len(free) == 2:
        return [(k, free[0], free[1]) for k in range(3) if axes[k]]
    return []


def _together(axes: tuple[int, ...]) -> list[int]:
    """The axes that both sides of a joint have in common: all, the only free one, or none."""
    free = [k for k in range(3) if not axes[k]]
    return [0, 1, 2] if not free else free if len(free) == 1 else []


def _column(rows: list[tuple], k: int, size: int) -> np.ndarray:
    """One column of a list of tuples, of numbers or of vectors (size,)."""
    if not rows:
        return np.zeros((0, size) if size else 0, float if size else int)
    return np.array([row[k] for row in rows])
