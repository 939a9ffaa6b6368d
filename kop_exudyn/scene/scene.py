"""A scene: bodies, hinges, rods, loads and actuators, and how they depend on the design parameters
q.

Bodies (hubs, corners, plates, free interior nodes) carry a pose. A rod's node sits on one body,
perhaps behind one of its hinges: x = x_b + R_b (p + E(a) o),  R = R_b E(a) C,  with E(a) the turn
by the angle a about the hinge's axis through its centre p; without a hinge p = 0 and E = I. So
coincident joints need no constraint equations: the unknowns are body increments and free hinge
angles.

Unknowns are numbered 6 body + 0..5 (global translation, then body-frame rotation), then 6 n_bodies
+ hinge.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from ..errors import SimulationFailure
from ..rods.rotations import exp_so3
from ..rods.sections import Section
from .state import State
from .terms import SceneTerm

# by how much the cosine of a held turn may miss 1
_ROUND_OFF = 1e-14


@dataclass(frozen=True)
class Driven:
    """Unknowns that the parameters prescribe: value = constant + factor q[parameter].

    dofs (m,) ; constants (m,) ; parameters (m,) ; factors (m,)
    """

    dofs: np.ndarray
    constants: np.ndarray
    parameters: np.ndarray
    factors: np.ndarray


@dataclass(frozen=True)
class Chain:
    """One rod piece as it is drawn and exported: its nodes in order, its elements (none: rigid),
    its cross-section.

    cut : whether a joint cuts the section at the first and at the last node, see `Section.cut`
    """

    nodes: np.ndarray
    elements: np.ndarray
    section: Section | None = None
    cut: tuple[bool, bool] = (False, False)


@dataclass(frozen=True)
class Scene:
    """What is simulated; made by `SceneBuilder`.

    initial : state to start from
    hinge_axis (n_hinges, 3), hinge_centre (n_hinges, 3) : unit vectors and points, in axes of the
    hinge's body node_body (N,), node_hinge (N,) (-1: none)
    node_frame (N, 3, 3), node_offset (N, 3) : C and o, in body axes at hinge angle 0; o from the
    hinge's centre elements (E, 2) nodes; stiffness (E, 6); rest_strain (E, 6) length_constant,
    length_factor (E,), length_parameter (E,) (-1: none): rest length = constant + factor
    q[parameter]
    weight (E, 3) : dead load per rest length, or None
    driven : unknowns prescribed by parameters
    pinned : (6 n_bodies + n_hinges,) bool, unknowns held at their initial value; see `held`
    actuated : hinges whose mean angle is prescribed ("opening"), or None
    terms : loads, attraction, actuators
    chains : rod pieces
    """

    n_parameters: int
    initial: State
    hinge_axis: np.ndarray
    hinge_centre: np.ndarray
    node_body: np.ndarray
    node_hinge: np.ndarray
    node_frame: np.ndarray
    node_offset: np.ndarray
    elements: np.ndarray
    stiffness: np.ndarray
    rest_strain: np.ndarray
    length_constant: np.ndarray
    length_factor: np.ndarray
    length_parameter: np.ndarray
    weight: np.ndarray | None
    driven: Driven
    pinned: np.ndarray
    actuated: np.ndarray | None
    terms: tuple[SceneTerm, ...]
    chains: tuple[Chain, ...]

    @property
    def n_bodies(self) -> int:
        return len(self.initial.positions)

    @property
    def n_hinges(self) -> int:
        return len(self.initial.angles)

    @property
    def n_dofs(self) -> int:
        """Unknowns before pins and driven ones are taken out."""
        return 6 * self.n_bodies + self.n_hinges

    def with_terms(self, *terms: SceneTerm) -> Scene:
        """The same scene with these loads, attractions and actuators instead."""
        return replace(self, terms=tuple(terms))

    def with_weight(self, weight: np.ndarray | None) -> Scene:
        """The same scene with this dead load (E, 3) per rest length."""
        return replace(self, weight=weight)

    def with_pins(self, pinned: np.ndarray) -> Scene:
        """The same scene with these unknowns (n_dofs,) bool held instead."""
        return replace(self, pinned=np.asarray(pinned, bool))

    @cached_property
    def chain_parameters(self) -> np.ndarray:
        """(n_chains,) the parameter that each rod piece's length depends on, -1 without one."""
        return np.array(
            [
                self.length_parameter[chain.elements[0]] if len(chain.elements) else -1
                for chain in self.chains
            ],
            int,
        )

    @cached_property
    def length_scale(self) -> float:
        """A length typical of the elements, from the initial geometry; makes tolerances independent
        of units."""
        x = self.node_poses(self.initial)[0]
        return float(
            np.median(np.linalg.norm(x[self.elements[:, 1]] - x[self.elements[:, 0]], axis=1))
        )

    @cached_property
    def size(self) -> float:
        """Bounding-box diagonal of the initial nodes."""
        return float(np.linalg.norm(np.ptp(self.node_poses(self.initial)[0], axis=0)))

    @cached_property
    def reach(self) -> float:
        """Largest distance that tells how finely coordinates are resolved: the size, or of scenes
        away from the origin their largest coordinate."""
        x = self.node_poses(self.initial)[0]
        return max(self.size, float(np.abs(x).max(initial=0.0)))

    def rest_lengths(self, q: np.ndarray) -> np.ndarray:
        """Rest lengths (E,) at q (n_parameters,). Raises SimulationFailure unless all are
        positive."""
        lengths = self.length_constant.copy()
        has = self.length_parameter >= 0
        lengths[has] += self.length_factor[has] * q[self.length_parameter[has]]
        if not (lengths > 0).all():
            worst = int(np.argmin(np.where(np.isnan(lengths), -np.inf, lengths)))
            raise SimulationFailure(
                f"rest length of element {worst} is {lengths[worst]:.6g}, not positive"
            )
        return lengths

    def by_parameter(self, per_length: np.ndarray) -> np.ndarray:
        """(n_parameters,) derivatives of a sum over the elements, from those in their rest lengths
        (E,)."""
        has = np.flatnonzero(self.length_parameter >= 0)
        return np.bincount(
            self.length_parameter[has],
            self.length_factor[has] * per_length[has],
            minlength=self.n_parameters,
        )

    def length_derivative(self, elements: np.ndarray) -> np.ndarray:
        """Derivatives (m, n_parameters) of some elements' rest lengths."""
        out = np.zeros((len(elements), self.n_parameters))
        parameter = self.length_parameter[elements]
        has = np.flatnonzero(parameter >= 0)
        out[has, parameter[has]] = self.length_factor[elements[has]]
        return out

    def driven_values(self, q: np.ndarray) -> np.ndarray:
        """Values (m,) of the driven unknowns at q."""
        d = self.driven
        return d.constants + d.factors * q[d.parameters]

    def with_driven(self, state: State, q: np.ndarray) -> State:
        """The state with the driven unknowns set to their values at q."""
        d, n = self.driven, 6 * self.n_bodies
        if not len(d.dofs):
            return state
        values = self.driven_values(q)
        hinge = d.dofs >= n
        angles, positions = state.angles.copy(), state.positions.copy()
        angles[d.dofs[hinge] - n] = values[hinge]
        bodies = d.dofs[~hinge]
        positions[bodies // 6, bodies % 6] = values[~hinge]
        return State(positions, state.rotations, angles)

    def held(self, state: State, q: np.ndarray) -> State:
        """The state with the pinned unknowns where this scene pins them and the driven ones at
        their values at q: what an iteration may start from.

        Of a body that may turn about one of its axes only, that turn is kept. One that may turn
        about two keeps its turns: increments about the third are held, no place of it.
        """
        state, n = self.with_driven(state, q), 6 * self.n_bodies
        if not self.pinned.any():
            return state
        pinned, at = self.pinned[:n].reshape(-1, 2, 3), self.initial
        rotations = state.rotations.copy()
        fixed, hinged, axes = self._held_bodies
        rotations[fixed] = at.rotations[fixed]
        # the axis that each of them may turn about, as it was and as it is
        was, now = (of.rotations[hinged, :, axes] for of in (at, state))
        tilted = np.abs(np.einsum("bi,bi->b", was, now) - 1.0) > _ROUND_OFF
        for body, k in zip(hinged[tilted].tolist(), axes[tilted].tolist()):
            turn = at.rotations[body].T @ state.rotations[body]
            i, j = (k + 1) % 3, (k + 2) % 3
            angle = np.arctan2(turn[j, i] - turn[i, j], turn[i, i] + turn[j, j])
            rotations[body] = at.rotations[body] @ exp_so3(angle * np.eye(3)[k])
        return State(
            np.where(pinned[:, 0], at.positions, state.positions),
            rotations,
            np.where(self.pinned[n:], at.angles, state.angles),
        )

    @cached_property
    def _held_bodies(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Bodies that can't turn, those that may turn about one of their axes only, and that
        axis."""
        pinned = self.pinned[: 6 * self.n_bodies].reshape(-1, 2, 3)[:, 1]
        hinged = np.flatnonzero(pinned.sum(axis=1) == 2)
        return np.flatnonzero(pinned.all(axis=1)), hinged, np.argmin(pinned[hinged], axis=1)

    @cached_property
    def driven_map(self) -> sp.csr_matrix:
        """d(driven unknowns)/dq (m, n_parameters)."""
        d = self.driven
        return sp.csr_matrix(
            (d.factors, (np.arange(len(d.dofs)), d.parameters)),
            shape=(len(d.dofs), self.n_parameters),
        )

    def hinge_turns(self, angles: np.ndarray) -> np.ndarray:
        """E(a) (n_hinges, 3, 3), turns about the hinges' axes."""
        return exp_so3(angles[:, None] * self.hinge_axis)

    def node_arms(self, state: State) -> tuple[np.ndarray, np.ndarray]:
        """From every node's body to the node, y (N, 3), and dy/da (N, 3) in its hinge's angle; in
        body axes."""
        arms, rates = self.node_offset.copy(), np.zeros_like(self.node_offset)
        behind = np.flatnonzero(self.node_hinge >= 0)
        hinge = self.node_hinge[behind]
        turned = np.einsum(
            "nij,nj->ni", self.hinge_turns(state.angles)[hinge], self.node_offset[behind]
        )
        arms[behind] = self.hinge_centre[hinge] + turned
        rates[behind] = np.cross(self.hinge_axis[hinge], turned)
        return arms, rates

    def node_poses(self, state: State) -> tuple[np.ndarray, np.ndarray]:
        """Positions (N, 3) and rotations (N, 3, 3) of all nodes."""
        Rb, frames = state.rotations[self.node_body], self.node_frame.copy()
        behind = np.flatnonzero(self.node_hinge >= 0)
        frames[behind] = self.hinge_turns(state.angles)[self.node_hinge[behind]] @ frames[behind]
        return state.positions[self.node_body] + np.einsum(
            "nij,nj->ni", Rb, self.node_arms(state)[0]
        ), Rb @ frames

    def polylines(self, state: State) -> list[np.ndarray]:
        """Node positions (k, 3) along every rod piece."""
        x = self.node_poses(state)[0]
        return [x[chain.nodes] for chain in self.chains]
