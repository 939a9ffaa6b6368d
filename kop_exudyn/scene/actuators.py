"""Linear actuators: the deployment energy of umbrella cells, which pushes the two plates of a cell
apart.

Each actuator joins two bodies, the top and the bottom plate of one cell. With the plates' outward
normals n_t = R_t e_z and n_b = R_b e_z, the axis a = (n_t - n_b)/|n_t - n_b|, the gap u = x_t - x_b
and the spacing h = a.u, its energy is

    w [ k_a n_t.n_b + k_x/2 (h - h*)^2 + k_t/2 (|u|^2 - h^2) ]

(Ren et al., Umbrella meshes, ACM TOG 41(4), 2022): plates become parallel, reach the spacing h* and
don't slide sideways.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled.library import address, library
from ..errors import InputError
from .state import State
from .terms import SceneTerm

_I3 = np.eye(3)


class LinearActuators(SceneTerm):
    """The actuators of m cells.

    Parameters
    ----------
    top, bottom : (m,) bodies of the two plates; their z axes are the plates' outward normals
    spacing : h* (m,) or one number, length
    weight : w (m,) or one number, energy
    alignment, extension, shear : k_a (1), k_x and k_t (1 / length^2)

    Raises InputError for weights that are negative or not finite.
    """

    def __init__(
        self,
        top: Any,
        bottom: Any,
        spacing: Any,
        weight: Any = 1.0,
        *,
        alignment: float = 1.0,
        extension: float = 1.0,
        shear: float = 1.0,
    ):
        self.top, self.bottom = (np.array(bodies, np.int64).reshape(-1) for bodies in (top, bottom))
        m = len(self.top)
        self.spacing = np.array(np.broadcast_to(spacing, m), float)
        self.weight = np.array(np.broadcast_to(weight, m), float)
        if not (np.isfinite(self.weight).all() and (self.weight >= 0).all()):
            raise InputError(
                "weights of actuators must be finite and not negative", field="actuators.weight"
            )
        self.alignment, self.extension, self.shear = alignment, extension, shear
        if min(self.top.min(initial=0), self.bottom.min(initial=0)) < 0:
            raise InputError("bodies are numbered from 0", field="actuators")
        self._highest = int(max(self.top.max(initial=-1), self.bottom.max(initial=-1)))
        six = np.arange(6)
        self.dofs = np.concatenate(
            [6 * self.top[:, None] + six, 6 * self.bottom[:, None] + six], axis=1
        )

    @property
    def pairs(self) -> np.ndarray:
        """(m, 2) the bodies that each actuator joins, in the order of its unknowns."""
        return np.stack([self.top, self.bottom], axis=1)

    def weighted(self, weight: Any, spacing: Any = None) -> LinearActuators:
        """The same actuators with other weights, and perhaps other spacings to aim at."""
        return LinearActuators(
            self.top,
            self.bottom,
            self.spacing if spacing is None else spacing,
            weight,
            alignment=self.alignment,
            extension=self.extension,
            shear=self.shear,
        )

    def spacings(self, state: State) -> np.ndarray:
        """Spacings h (m,) along the mean axis."""
        axis, _, gap = self._geometry(state)[2:]
        return _dot(axis, gap)

    def energies(self, state: State) -> np.ndarray:
        """Energy (m,) of every actuator."""
        n_t, n_b, axis, _, gap = self._geometry(state)
        h = _dot(axis, gap)
        return self.weight * (
            self.alignment * _dot(n_t, n_b)
            + 0.5 * self.extension * (h - self.spacing) ** 2
            + 0.5 * self.shear * (_dot(gap, gap) - h * h)
        )

    def energy(self, state: State) -> float:
        return float(self.energies(state).sum())

    def gradient_hessian(self, state: State) -> tuple[float, np.ndarray, np.ndarray]:
        """Energy, gradients (m, 12) and Hessians (m, 12, 12), in (dx_t, w_t, dx_b, w_b)."""
        m, kernels = len(self.top), library()
        if kernels is None:
            return self._gradient_hessian(state)
        g, H = np.empty((m, 12)), np.empty((m, 12, 12))
        factors = np.array([self.alignment, self.extension, self.shear], float)
        numbers = [
            np.ascontiguousarray(a, float)
            for a in (self.spacing, self.weight, factors, state.positions, state.rotations)
        ]
        n = len(state.positions)
        if self._highest >= n:
            raise ValueError(f"an actuator names body {self._highest} (there are {n})")
        shapes = ((m,), (m,), (3,), (n, 3), (n, 3, 3))
        energy = kernels.actuate(
            m,
            address(self.top, np.int64),
            address(self.bottom, np.int64),
            *[address(a, np.float64, shape) for a, shape in zip(numbers, shapes)],
            address(g),
            address(H),
        )
        return energy, g, H

    def _gradient_hessian(self, state: State) -> tuple[float, np.ndarray, np.ndarray]:
        """The same in NumPy."""
        m = len(self.top)
        n_t, n_b, axis, length, gap = self._geometry(state)
        h = _dot(axis, gap)
        energies = self.energies(state)
        h_n, h_nn, h_nu = self._spacing_derivatives(axis, length, gap, h)
        slope = self.extension * (h - self.spacing) - self.shear * h
        curve = self.extension - self.shear

        # derivatives in the normals and in the gap; the two normals enter h by their difference
        g_t, g_b = (
            slope[:, None] * h_n + self.alignment * n_b,
            -slope[:, None] * h_n + self.alignment * n_t,
        )
        g_u = slope[:, None] * axis + self.shear * gap
        H_nn = slope[:, None, None] * h_nn + curve * _outer(h_n, h_n)
        H_nu = slope[:, None, None] * h_nu + curve * _outer(h_n, axis)
        H_uu = self.shear * _I3 + curve * _outer(axis, axis)

        J_t, J_b = _normal_map(state.rotations[self.top]), _normal_map(state.rotations[self.bottom])
        J_tT, J_bT = np.swapaxes(J_t, 1, 2), np.swapaxes(J_b, 1, 2)
        g = np.concatenate([g_u, _times(J_tT, g_t), -g_u, _times(J_bT, g_b)], axis=1)
        H = np.empty((m, 12, 12))
        H[:, 0:3, 0:3] = H[:, 6:9, 6:9] = H_uu
        H[:, 0:3, 6:9] = -H_uu
        H[:, 3:6, 0:3] = J_tT @ H_nu
        H[:, 3:6, 6:9] = -H[:, 3:6, 0:3]
        H[:, 9:12, 6:9] = J_bT @ H_nu
        H[:, 9:12, 0:3] = -H[:, 9:12, 6:9]
        H[:, 3:6, 3:6] = J_tT @ H_nn @ J_t + _normal_curvature(state.rotations[self.top], g_t)
        H[:, 9:12, 9:12] = J_bT @ H_nn @ J_b + _normal_curvature(state.rotations[self.bottom], g_b)
        H[:, 3:6, 9:12] = J_tT @ (self.alignment * _I3 - H_nn) @ J_b
        for row, column in ((0, 3), (6, 3), (6, 0), (0, 9), (6, 9), (9, 3)):
            H[:, row : row + 3, column : column + 3] = np.swapaxes(
                H[:, column : column + 3, row : row + 3], 1, 2
            )
        return float(energies.sum()), self.weight[:, None] * g, self.weight[:, None, None] * H

    def _geometry(self, state: State) -> tuple[np.ndarray, ...]:
        """Normals n_t, n_b, axis a, |n_t - n_b| and gap u."""
        n_t, n_b = state.rotations[self.top, :, 2], state.rotations[self.bottom, :, 2]
        difference = n_t - n_b
        length = np.linalg.norm(difference, axis=1)
        gap = state.positions[self.top] - state.positions[self.bottom]
        return n_t, n_b, difference / length[:, None], length, gap

    @staticmethod
    def _spacing_derivatives(
        axis: np.ndarray, length: np.ndarray, gap: np.ndarray, h: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """h = d.u/|d|: h_d (m, 3), h_dd and h_du (m, 3, 3), with d the difference of the
        normals."""
        across = gap - h[:, None] * axis
        project = _I3 - _outer(axis, axis)
        mixed = _outer(axis, across)
        h_dd = (
            -(h[:, None, None] * project + mixed + np.swapaxes(mixed, 1, 2))
            / length[:, None, None] ** 2
        )
        return across / length[:, None], h_dd, project / length[:, None, None]


def _normal_map(R: np.ndarray) -> np.ndarray:
    """dn/dw (m, 3, 3) of n = R exp(hat(w)) e_z:  R (w x e_z) = w_y R_x - w_x R_y."""
    J = np.zeros_like(R)
    J[:, :, 0], J[:, :, 1] = -R[:, :, 1], R[:, :, 0]
    return J


def _normal_curvature(R: np.ndarray, g: np.ndarray) -> np.ndarray:
    """Second variation (m, 3, 3) of g.n: with f = R^T g, (f e_z^T + e_z f^T)/2 - f_z I."""
    f = np.einsum("mji,mj->mi", R, g)
    H = -f[:, 2, None, None] * _I3
    H[:, 2, :] += 0.5 * f
    H[:, :, 2] += 0.5 * f
    return H


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("mi,mi->m", a, b)


def _outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, :, None] * b[:, None, :]


def _times(A: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.einsum("mij,mj->mi", A, v)
