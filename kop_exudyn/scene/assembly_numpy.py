"""The assembly of rods in NumPy, all elements at once: for machines without compiled kernels, and
what these are compared with."""

from __future__ import annotations

import numpy as np

from ..rods.element import evaluate
from ..rods.rotations import hat
from .assembly import ENERGY, HESSIAN, RodAssembly
from .state import State

_CHUNK = 2048  # elements at a time, to bound memory
_UPPER = np.triu_indices(14)


class NumpyAssembly(RodAssembly):
    """By batched products of small matrices."""

    def assemble(
        self, state: State, lengths: np.ndarray, order: int, mixed: bool
    ) -> tuple[float, float]:
        with np.errstate(all="ignore"):  # the solver's safeguards see what isn't finite
            nodes = _Nodes(self, state)
            parts = [
                self._assemble(nodes, slice(first, first + _CHUNK), lengths, order, mixed)
                for first in range(0, len(lengths), _CHUNK)
            ]
        elastic, potential = np.sum(parts, axis=0)
        return float(elastic), float(potential)

    def _assemble(
        self, nodes: _Nodes, some: slice, lengths: np.ndarray, order: int, mixed: bool
    ) -> tuple[float, float]:
        scene, s = self.scene, self.sparsity
        tail, head = scene.elements[some].T
        x, R, L, K = nodes.x, nodes.R, lengths[some], scene.stiffness[some]
        stress = self.predicted_stress[some] if mixed else None
        W, G, H, e, B = evaluate(
            x[tail], R[tail], x[head], R[head], L, K, scene.rest_strain[some], stress
        )
        self.strain[some] = e
        load = np.zeros((len(L), 3))
        if scene.weight is not None:
            load = 0.5 * L[:, None] * scene.weight[some]
        energies = W.sum(), -np.sum(load * (x[tail] + x[head]))
        if order == ENERGY:
            return energies
        T = np.zeros((len(L), 12, 14))  # element unknowns from those of two bodies and hinges
        T[:, :6, :7], T[:, 6:, 7:] = nodes.T[tail], nodes.T[head]
        G[:, :3] -= load
        G[:, 6:9] -= load
        _add(self.gradient, s.rows[some], np.einsum("eka,ek->ea", T, G))
        if order < HESSIAN:
            return energies
        if stress is not None:
            G = np.einsum("erk,er->ek", B, stress)
            G[:, :3] -= load
            G[:, 6:9] -= load
        square = np.swapaxes(T, 1, 2) @ H @ T
        for node, at in ((tail, 0), (head, 7)):
            force, moment = G[:, 6 * at // 7 :][:, :3], G[:, 6 * at // 7 :][:, 3:6]
            square[:, at + 3 : at + 7, at + 3 : at + 7] += nodes.curvature(node, force, moment)
        self.strain_displacement[some] = B @ T
        _add(self.values, s.slots[some], square[:, *_UPPER])
        return energies

    def scatter(
        self, rows: np.ndarray, slots: np.ndarray, g: np.ndarray, H: np.ndarray | None
    ) -> None:
        _add(self.gradient, rows, g)
        if H is not None:
            a, b = np.triu_indices(rows.shape[1])
            twice = (a != b) & (rows[:, a] == rows[:, b])
            _add(self.values, slots, np.where(twice, 2.0, 1.0) * H[:, a, b])

    def predict_stress(self, lengths: np.ndarray, increment: np.ndarray) -> None:
        d = np.append(increment, 0.0)[self.sparsity.rows]  # absent unknowns (-1) read the zero
        strain = self.strain + np.einsum("eri,ei->er", self.strain_displacement, d)
        self.predicted_stress[:] = self.scene.stiffness * strain / lengths[:, None]

    def largest_forces(self, lengths: np.ndarray) -> tuple[float, float, float]:
        K = self.scene.stiffness
        with np.errstate(all="ignore"):
            force = np.abs(K * self.strain / lengths[:, None])
        return (
            float(force[:, :3].max(initial=0.0)),
            float(force[:, 3:].max(initial=0.0)),
            float((K[:, 0] / lengths).max(initial=0.0)),
        )


class _Nodes:
    """Poses (x, R) of all nodes at a state, and their first and second variations.

    T (N, 6, 7) : dx = dx_b - R_b hat(y) w_b + R_b d da,   w = (EC)^T w_b + C^T n da
    """

    def __init__(self, assembly: NumpyAssembly, state: State):
        scene = assembly.scene
        self.x, self.R = scene.node_poses(state)
        self.y, self.d = scene.node_arms(state)
        self.Rb = state.rotations[scene.node_body]
        self.EC = np.swapaxes(self.Rb, 1, 2) @ self.R
        behind = scene.node_hinge >= 0
        self.n = np.zeros_like(self.y)
        self.n[behind] = scene.hinge_axis[scene.node_hinge[behind]]
        self.T = np.zeros((len(self.x), 6, 7))
        self.T[:, :3, :3] = np.eye(3)
        self.T[:, :3, 3:6] = -self.Rb @ hat(self.y)
        self.T[:, :3, 6] = np.einsum("nij,nj->ni", self.Rb, self.d)
        self.T[:, 3:, 3:6] = np.swapaxes(self.EC, 1, 2)
        self.T[:, 3:, 6] = np.einsum("nji,nj->ni", scene.node_frame, self.n)

    def curvature(self, node: np.ndarray, force: np.ndarray, moment: np.ndarray) -> np.ndarray:
        """(E, 4, 4) second variation of the map of some nodes (E,) in (w_b, a), contracted with
        forces (global) and moments (node axes).

        f = R_b^T force, b = C^T n:  w.(f y^T)w - (f.y) w.w,  w.(d x f) da,  f.(n x d) da^2,  and
        half of w.EC (b x moment) da.
        """
        y, d, b = self.y[node], self.d[node], self.T[node, 3:, 6]
        f = np.einsum("nji,nj->ni", self.Rb[node], force)
        out = np.zeros((len(node), 4, 4))
        outer = f[:, :, None] * y[:, None, :]
        out[:, :3, :3] = 0.5 * (outer + np.swapaxes(outer, 1, 2))
        out[:, :3, :3] -= np.einsum("ni,ni->n", f, y)[:, None, None] * np.eye(3)
        turned = np.einsum("nij,nj->ni", self.EC[node], np.cross(b, moment))
        out[:, :3, 3] = out[:, 3, :3] = np.cross(d, f) + 0.5 * turned
        out[:, 3, 3] = np.einsum("ni,ni->n", f, np.cross(self.n[node], d))
        return out


def _add(to: np.ndarray, places: np.ndarray, values: np.ndarray) -> None:
    """to[places] += values, leaving out places of -1."""
    keep = places >= 0
    to += np.bincount(places[keep], values[keep], minlength=len(to))
