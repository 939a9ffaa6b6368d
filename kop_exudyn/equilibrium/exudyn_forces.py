"""Forces of a scene's terms and of its actuation, as an object of Exudyn's with user functions.

Actuators, attraction and loads are evaluated wherever Exudyn's iteration is, with their own
stiffness: with T the constant map from increments of Exudyn's nodes to increments of the scene's
bodies and hinges, forces are -T^T g and their stiffness is T^T H T. The prescribed mean angle is
one more equation, whose unknown is the actuation's torque, a coordinate of its own:

    dE/du + torque c = 0,   mean angle(u) - opening = 0,   c = d(mean angle)/du .

The derivative of a term's moments about a body's own axes has a skew part besides H, hat(g) / 2.

Exudyn holds on to the functions that it is given, and Python can't collect what is tied up with it
in a circle: nothing here knows Exudyn's system.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp

from ..rods.rotations import exp_so3, hat
from ..scene.scene import Scene
from ..scene.state import State
from .exudyn_layout import Layout
from .exudyn_library import exu


class SceneForces:
    """What acts on a scene besides its rods, on Exudyn's nodes.

    nodes : (m,) layout nodes whose coordinates it takes, six each; where the scene is actuated the
        torque follows as the last coordinate
    ramp : mean angle from which the opening grows with Exudyn's time, and the terms' forces from
        nothing; None: both are there at once
    """

    def __init__(self, scene: Scene, layout: Layout, length: float, force: float):
        self._length, self._energy = length, force * length
        self.ramp: float | None = None
        touched = [np.unique(term.dofs) for term in scene.terms]
        hinges = [] if scene.actuated is None else [6 * scene.n_bodies + scene.actuated]
        dofs = np.unique(np.concatenate([*touched, *hinges, np.zeros(0, int)])).astype(int)
        self._bodies = np.unique(dofs[dofs < 6 * scene.n_bodies] // 6)
        self._hinges = dofs[dofs >= 6 * scene.n_bodies] - 6 * scene.n_bodies
        by_hinge = {key[1]: c for key, c in layout.carriers.items() if key[1] >= 0}
        hubs = [layout.carriers[int(body), -1] for body in self._bodies]
        pairs = [
            (layout.carriers[by_hinge[h].body, -1], by_hinge[h]) for h in self._hinges.tolist()
        ]
        carriers = hubs + [c for pair in pairs for c in pair]
        self.nodes = np.unique(np.array([c.node for c in carriers], int))
        place = {int(node): k for k, node in enumerate(self.nodes)}
        self._hub = np.array([place[c.node] for c in hubs], int)
        self._hub_frames = np.array([c.frame for c in hubs]).reshape(-1, 3, 3)
        self._pair = np.array([[place[c.node] for c in pair] for pair in pairs], int).reshape(-1, 2)
        self._pair_frames = np.array([[c.frame for c in pair] for pair in pairs])
        self._pair_frames = self._pair_frames.reshape(-1, 2, 3, 3)
        self._axes = scene.hinge_axis[self._hinges]
        self._map = self._node_map(scene)
        self.actuated = scene.actuated is not None
        if scene.actuated is not None:
            row = np.searchsorted(self._hinges, scene.actuated)
            self._mean = np.zeros(len(self._hinges))
            np.add.at(self._mean, row, 1 / len(row))
            rows = self._map[6 * scene.n_bodies + self._hinges]
            self._column = np.asarray(rows.T @ self._mean).ravel()
        self._blank = State(
            np.zeros_like(scene.initial.positions),
            np.tile(np.eye(3), (scene.n_bodies, 1, 1)),
            scene.initial.angles.copy(),
        )
        self.set(scene, None, scene.initial.angles, np.zeros((layout.n_nodes, 6)))

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return 6 * len(self.nodes) + self.actuated

    def set(
        self, scene: Scene, opening: float | None, angles: np.ndarray, reference: np.ndarray
    ) -> None:
        """Take a scene's terms, its opening, and Exudyn's reference coordinates (n_nodes, 6).

        angles : (n_hinges,) those near which hinge angles are measured
        """
        self._terms, self._opening, self._near = scene.terms, opening, angles
        self._reference = reference[self.nodes]

    # -- what Exudyn asks for ----------------------------------------------------------------------
    def force(self, displacements: np.ndarray, time: float = 1.0) -> np.ndarray:
        """Generalised forces (size,) on the coordinates: minus the left-hand side's.

        time : Exudyn's, from 0 to 1, which counts where forces grow with it (see `ramp`)
        """
        state = self._state(displacements)
        share = 1.0 if self.ramp is None else time
        out = np.zeros(self.size)
        nodal = out[: 6 * len(self.nodes)]
        if self._terms:
            nodal -= share * (self._map.T @ self._gradient(state)) / self._energy
        if self.actuated:
            nodal -= displacements[-1] * self._column
            out[-1] = -self.gap(state.angles, share)
        return out

    def stiffness(self, displacements: np.ndarray, time: float = 1.0) -> sp.csr_matrix:
        """Derivative (size, size) of the left-hand side."""
        state = self._state(displacements)
        n = 6 * len(self.nodes)
        matrix = sp.csr_matrix((n, n))
        if self._terms:
            g, H = self._second(state)
            moments = g[6 * self._bodies[:, None] + np.arange(3, 6)]
            rows = 6 * self._bodies[:, None, None] + np.arange(3, 6)[:, None]
            columns = 6 * self._bodies[:, None, None] + np.arange(3, 6)
            skew = 0.5 * hat(moments)
            rows, columns = (np.broadcast_to(i, skew.shape).ravel() for i in (rows, columns))
            H = H + sp.csr_matrix((skew.ravel(), (rows, columns)), shape=H.shape)
            share = 1.0 if self.ramp is None else time
            matrix = share * (self._map.T @ H @ self._map) / self._energy
        if self.actuated:
            column = sp.csr_matrix(self._column[:, None])
            matrix = sp.bmat([[matrix, column], [column.T, None]])
        return sp.csr_matrix(matrix)

    def user_functions(self) -> tuple[Any, Any]:
        """Force and Jacobian as Exudyn's `ObjectGenericODE2` takes them."""

        def force(mbs: Any, t: float, number: int, q: Any, q_t: Any) -> Any:
            return self.force(np.array(q), t)

        def jacobian(
            mbs: Any, t: float, number: int, q: Any, q_t: Any, factor: float, factor_t: float
        ) -> Any:
            matrix = self.stiffness(np.array(q), t)
            matrix.eliminate_zeros()  # Exudyn's triplets must not be zero
            container = exu.MatrixContainer()
            container.SetWithSparseMatrix(matrix, factor=factor)
            return container

        return force, jacobian

    def gap(self, angles: np.ndarray, share: float = 1.0) -> float:
        """How far the mean of the actuated hinges' angles (n_hinges,) is from the opening, or from
        a share of the way to it."""
        assert self._opening is not None
        opening = self._opening
        if self.ramp is not None:
            opening = self.ramp + share * (opening - self.ramp)
        return float(self._mean @ angles[self._hinges] - opening)

    # -- inside ------------------------------------------------------------------------------------
    def _node_map(self, scene: Scene) -> sp.csr_matrix:
        """T (n_dofs, 6 m): the scene's increments from those of the nodes, in the model's units."""
        rows: list[np.ndarray] = []
        columns: list[np.ndarray] = []
        values: list[np.ndarray] = []

        def add(row: np.ndarray, column: np.ndarray, value: np.ndarray) -> None:
            shape = np.broadcast_shapes(row.shape, column.shape, value.shape)
            for kept, part in ((rows, row), (columns, column), (values, value)):
                kept.append(np.broadcast_to(part, shape).ravel())

        three = np.arange(3)
        add(
            6 * self._bodies[:, None] + three,
            6 * self._hub[:, None] + three,
            np.array([[self._length]]),
        )
        add(
            (6 * self._bodies + 3)[:, None, None] + three[:, None],
            (6 * self._hub + 3)[:, None, None] + three,
            self._hub_frames,
        )
        for side, sign in ((0, -1.0), (1, 1.0)):
            along = np.einsum("hi,hij->hj", self._axes, self._pair_frames[:, side])
            add(
                (6 * scene.n_bodies + self._hinges)[:, None],
                (6 * self._pair[:, side] + 3)[:, None] + three,
                sign * along,
            )
        shape = (scene.n_dofs, 6 * len(self.nodes))
        data = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        return sp.csr_matrix(data, shape=shape)

    def _state(self, displacements: np.ndarray) -> State:
        """The scene's state as far as these nodes tell it."""
        total = self._reference + displacements[: 6 * len(self.nodes)].reshape(-1, 6)
        R = exp_so3(total[:, 3:])
        positions, rotations = self._blank.positions.copy(), self._blank.rotations.copy()
        positions[self._bodies] = total[self._hub, :3] * self._length
        rotations[self._bodies] = R[self._hub] @ np.swapaxes(self._hub_frames, 1, 2)
        angles = self._near.copy()
        frames = R[self._pair] @ np.swapaxes(self._pair_frames, 2, 3)
        turn = np.swapaxes(frames[:, 0], 1, 2) @ frames[:, 1]
        angles[self._hinges] = angles_about(turn, self._axes, self._near[self._hinges])
        return State(positions, rotations, angles)

    def _gradient(self, state: State) -> np.ndarray:
        g = np.zeros(self._map.shape[0])
        for term in self._terms:
            np.add.at(g, term.dofs, term.gradient_hessian(state)[1])
        return g

    def _second(self, state: State) -> tuple[np.ndarray, sp.csr_matrix]:
        n = self._map.shape[0]
        g, H = np.zeros(n), sp.csr_matrix((n, n))
        for term in self._terms:
            _, slope, curve = term.gradient_hessian(state)
            np.add.at(g, term.dofs, slope)
            rows = np.broadcast_to(term.dofs[:, :, None], curve.shape).ravel()
            columns = np.broadcast_to(term.dofs[:, None, :], curve.shape).ravel()
            H = H + sp.csr_matrix((curve.ravel(), (rows, columns)), shape=(n, n))
        return g, H


def angles_about(turns: np.ndarray, axes: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Angles (n,) of turns (n, 3, 3) about unit axes (n, 3), on the same turn as those nearby."""
    sine = np.stack(
        [
            turns[:, 2, 1] - turns[:, 1, 2],
            turns[:, 0, 2] - turns[:, 2, 0],
            turns[:, 1, 0] - turns[:, 0, 1],
        ],
        axis=1,
    )
    cosine = np.trace(turns, axis1=1, axis2=2) - 1
    measured = np.arctan2(np.einsum("nk,nk->n", sine, axes), cosine)
    return near + np.remainder(measured - near + np.pi, 2 * np.pi) - np.pi
