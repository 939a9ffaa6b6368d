"""Builds a scene piece by piece: bodies, hinges, nodes, rods, pins, actuation, loads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import InputError
from ..rods.sections import Section
from .scene import Chain, Driven, Scene
from .state import State
from .terms import SceneTerm

_ALL = (0, 1, 2, 3, 4, 5)
_Z = (0.0, 0.0, 1.0)


class SceneBuilder:
    """Collects the pieces of a scene; every method returns the numbers of what it added.

    n_parameters : length of q, on which rest lengths and prescribed angles may depend
    """

    def __init__(self, n_parameters: int = 0):
        self.n_parameters = n_parameters
        self._positions: list[np.ndarray] = []
        self._rotations: list[np.ndarray] = []
        self._n_bodies = 0
        # angle, parameter, factor, prescribed, axis, centre
        self._hinges: list[tuple[np.ndarray, ...]] = []
        self._n_hinges = 0
        self._nodes: list[tuple[np.ndarray, ...]] = []  # body, hinge, frame, offset
        self._n_nodes = 0
        self._rods: list[tuple[np.ndarray, ...]] = []
        self._weights: list[np.ndarray] = []
        self._n_elements = 0
        self._chains: list[Chain] = []
        self._driven: list[tuple[int, int, int, float, float]] = []
        self._pins: list[tuple[int, int]] = []
        self._actuated: np.ndarray | None = None
        self._terms: list[SceneTerm] = []

    def bodies(self, positions: Any, rotations: Any = None) -> np.ndarray:
        """Add bodies at positions (n, 3) with axes rotations (n, 3, 3) (default: the global axes);
        returns (n,)."""
        positions = np.array(positions, float).reshape(-1, 3)
        n = len(positions)
        rotations = np.eye(3) if rotations is None else np.asarray(rotations, float)
        self._positions.append(positions)
        self._rotations.append(np.array(np.broadcast_to(rotations, (n, 3, 3))))
        self._n_bodies += n
        return np.arange(self._n_bodies - n, self._n_bodies)

    def hinges(
        self,
        angles: Any,
        *,
        parameter: Any = -1,
        factor: Any = 1.0,
        prescribed: bool = False,
        axis: Any = _Z,
        centre: Any = 0.0,
    ) -> np.ndarray:
        """Add hinges; returns (n,).

        angles (n,), rad: initial angles of free hinges; of prescribed ones the constant part of
        angle = constant + factor q[parameter] (parameter -1: constant alone).
        axis, centre (n, 3) or (3,) : direction and place in axes of the hinge's body, which is that
        of its nodes Raises InputError for axes without direction.
        """
        angles = np.array(angles, float).reshape(-1)
        n = len(angles)
        axis = np.array(np.broadcast_to(axis, (n, 3)), float)
        length = np.linalg.norm(axis, axis=1)
        if not ((length > 0) & np.isfinite(length)).all():
            raise InputError(
                "a hinge's axis needs a direction",
                field="scene.hinges",
                value=axis[int(np.argmin(length > 0))].tolist(),
            )
        self._hinges.append(
            (
                angles,
                np.broadcast_to(parameter, n).astype(int),
                np.broadcast_to(factor, n).astype(float),
                np.full(n, prescribed),
                axis / length[:, None],
                np.array(np.broadcast_to(centre, (n, 3)), float),
            )
        )
        self._n_hinges += n
        return np.arange(self._n_hinges - n, self._n_hinges)

    def nodes(self, body: Any, hinge: Any = -1, frame: Any = None, offset: Any = 0.0) -> np.ndarray:
        """Add rod nodes on bodies (n,), behind hinges (n,) (-1: fixed); returns (n,).

        frame (n, 3, 3) : rod axes in body axes at hinge angle 0, x along the rod
        offset (n, 3) : from the body, or from its hinge's centre, in the same axes
        """
        body = np.array(body, int).reshape(-1)
        n = len(body)
        frame = np.eye(3) if frame is None else np.asarray(frame, float)
        self._nodes.append(
            (
                body,
                np.broadcast_to(hinge, n).astype(int),
                np.array(np.broadcast_to(frame, (n, 3, 3))),
                np.array(np.broadcast_to(offset, (n, 3)), float),
            )
        )
        self._n_nodes += n
        return np.arange(self._n_nodes - n, self._n_nodes)

    def rod(
        self,
        nodes: Sequence[int],
        stiffness: Any,
        *,
        length: Any = 0.0,
        parameter: int = -1,
        factor: float = 1.0,
        curvature: Any = None,
        rest_strain: Any = None,
        weight: Any = None,
        section: Section | None = None,
        cut: tuple[bool, bool] = (False, False),
    ) -> np.ndarray:
        """Add a rod piece of k equal elements along its k + 1 nodes; returns the elements (k,).

        length : constant part of the whole piece's rest length; (k,) for unequal elements
        parameter, factor : rest length = length + factor q[parameter], shared equally by the
            elements
        curvature : (3,) or (k, 3) rest curvature (twist rate, about y, about z), 1 / length;
            default straight
        rest_strain : (k, 6) the whole rest strain measure instead, as h / length of the unstressed
            relative motion h
        weight : (3,) dead load per rest length
        cut : whether the section is cut at its first and last node, where a joint is
        """
        along = np.asarray(nodes, int)
        k = len(along) - 1
        if k < 1:
            raise InputError(
                "a rod needs at least two nodes", field="rod.nodes", value=along.tolist()
            )
        length = np.asarray(length, float)
        rest = np.zeros((k, 6))
        rest[:, 0] = 1.0
        if curvature is not None:
            rest[:, 3:] = curvature
        if rest_strain is not None:
            rest[:] = rest_strain
        self._rods.append(
            (
                np.stack([nodes[:-1], nodes[1:]], axis=1),
                np.array(np.broadcast_to(stiffness, (k, 6)), float),
                rest,
                np.array(length if length.ndim else np.full(k, length / k)),
                np.full(k, factor / k),
                np.full(k, parameter),
            )
        )
        self._weights.append(
            np.array(np.broadcast_to(0.0 if weight is None else weight, (k, 3)), float)
        )
        elements = np.arange(self._n_elements, self._n_elements + k)
        self._n_elements += k
        self._chains.append(Chain(along, elements, section, cut))
        return elements

    def rigid(self, nodes: Sequence[int], section: Section | None = None) -> None:
        """Add a piece that doesn't bend, between nodes of one body: drawn and exported, but without
        elements."""
        self._chains.append(Chain(np.asarray(nodes, int), np.zeros(0, int), section))

    def prescribe(
        self, body: int, axis: int, parameter: int, factor: float = 1.0, constant: float = 0.0
    ) -> None:
        """Let a parameter drive a body's coordinate (axis 0..2): coordinate = constant + factor
        q[parameter]."""
        self._driven.append((int(body), int(axis), int(parameter), float(factor), float(constant)))

    def pin(self, body: int, dofs: Sequence[int] = _ALL) -> None:
        """Hold a body's unknowns at their initial value: 0-2 global translation, 3-5 body-frame
        rotation.

        Of the turns, hold none, two or all three: what a single held one comes to in space depends
        on the path, unless the body turns about one axis only.
        """
        self._pins.extend((int(body), int(k)) for k in dofs)

    def mean_angle(self, hinges: Any) -> None:
        """Actuate: the mean angle of these free hinges is prescribed when solving; its multiplier
        is the torque."""
        self._actuated = np.array(hinges, int).reshape(-1)

    def term(self, term: SceneTerm) -> None:
        """Add a load, an attraction or an actuator."""
        self._terms.append(term)

    @property
    def n_bodies(self) -> int:
        """Bodies so far."""
        return self._n_bodies

    def build(self) -> Scene:
        """The finished scene. Raises InputError where pieces don't fit together."""
        if not self._rods:
            raise InputError("a scene needs at least one rod", field="scene.rods")
        positions, rotations = np.concatenate(self._positions), np.concatenate(self._rotations)
        body, hinge, frame, offset = _columns(self._nodes, 4)
        elements, stiffness, rest, constant, factor, parameter = _columns(self._rods, 6)
        angles, h_parameter, h_factor, prescribed, axis, centre = (
            _columns(self._hinges, 6)
            if self._hinges
            else (
                np.zeros(0),
                np.zeros(0, int),
                np.zeros(0),
                np.zeros(0, bool),
                np.zeros((0, 3)),
                np.zeros((0, 3)),
            )
        )
        if (body[elements[:, 0]] == body[elements[:, 1]]).any():
            raise InputError("an element must join two different bodies", field="scene.rods")
        _check_parameters(
            self.n_parameters, parameter, h_parameter, np.array([d[2] for d in self._driven], int)
        )
        driven, pinned = self._prescriptions(
            len(positions), angles, h_parameter, h_factor, prescribed
        )
        weights = np.concatenate(self._weights)
        return Scene(
            n_parameters=self.n_parameters,
            initial=State(positions, rotations, angles.copy()),
            hinge_axis=axis,
            hinge_centre=centre,
            node_body=body,
            node_hinge=hinge,
            node_frame=frame,
            node_offset=offset,
            elements=elements,
            stiffness=stiffness,
            rest_strain=rest,
            length_constant=constant,
            length_factor=factor,
            length_parameter=parameter,
            weight=weights if weights.any() else None,
            driven=driven,
            pinned=pinned,
            actuated=self._actuated,
            terms=tuple(self._terms),
            chains=tuple(self._chains),
        )

    def _prescriptions(
        self,
        n_bodies: int,
        angles: np.ndarray,
        parameter: np.ndarray,
        factor: np.ndarray,
        prescribed: np.ndarray,
    ) -> tuple[Driven, np.ndarray]:
        """Driven unknowns and the mask of pinned ones; a prescribed hinge without parameter is
        pinned."""
        pinned = np.zeros(6 * n_bodies + len(angles), bool)
        for pin_body, k in self._pins:
            pinned[6 * pin_body + k] = True
        pinned[6 * n_bodies :] = prescribed & (parameter < 0)
        by_hinge = np.flatnonzero(prescribed & (parameter >= 0))
        own = self._driven
        return Driven(
            dofs=np.array([6 * d[0] + d[1] for d in own] + list(6 * n_bodies + by_hinge), int),
            constants=np.array([d[4] for d in own] + list(angles[by_hinge]), float),
            parameters=np.array([d[2] for d in own] + list(parameter[by_hinge]), int),
            factors=np.array([d[3] for d in own] + list(factor[by_hinge]), float),
        ), pinned


def _columns(rows: list[tuple[np.ndarray, ...]], n: int) -> tuple[np.ndarray, ...]:
    return tuple(np.ascontiguousarray(np.concatenate([row[k] for row in rows])) for k in range(n))


def _check_parameters(n: int, *used: np.ndarray) -> None:
    for indices in used:
        if len(indices) and indices.max() >= n:
            raise InputError(
                f"parameter number out of range (there are {n})",
                field="parameter",
                value=int(indices.max()),
            )
