"""Derivatives of an equilibrium in the parameters, from its own factorisation: adjoint and full, no
differences.

At equilibrium R(x, q) + tau c = 0 and c.x fixed, so x_q solves K x_q + c tau_q = -R_q, c.x_q = 0.
R_q is sparse: B^T dsigma/dL for a rest length, the Hessian's own columns for a driven unknown.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sp

from ..arrays import (
    Indices,
    Numbers,
    ParameterHessian,
    ParameterRows,
    Parameters,
    Stresses,
    StressFactors,
    StressRows,
)
from ..rods.element import length_derivative
from ..scene.scene import Scene
from ..scene.state import State
from .block_solve import Solutions
from .direction import Border, border_of, bordered_solve
from .equilibria import Equilibrium, Start
from .system import System

# Relative residual of the linear solves beyond which derivatives are worthless.
_TRUSTED_RESIDUAL = 1e-6


class Sensitivities:
    """All first derivatives of one equilibrium, and the exact second derivatives of its potential
    energy.

    Nothing is computed before it is asked for. The factorisation is the system's, which others may
    use in between: where it has moved on, the equilibrium's own is made again before it is used.

    What needs a solve raises SimulationFailure where the stiffness is exactly singular.
    """

    def __init__(self, system: System, equilibrium: Equilibrium):
        self._system, self.equilibrium = system, equilibrium
        system.linearise(equilibrium.state, equilibrium.q)
        self._lengths = system.lengths
        scene, s = system.scene, system.sparsity
        self._strain = system.strain.copy()
        energy_L, stress_L, self._energy_LL = length_derivative(
            self._strain, system.lengths, scene.stiffness, scene.rest_strain
        )
        self._energy_L, self._stress_L = energy_L, stress_L
        self._has = system.parameter_pattern.elements
        self._driven_values = system.values[s.n_factor_values :].copy()
        self._gradient = system.gradient.copy()
        self._length_entries = self._differentiate_by_length()
        self._residual_q = self._assemble_residual_q()

    def __repr__(self) -> str:
        return f"<Sensitivities in {len(self.equilibrium.q)} parameters>"

    @property
    def system(self) -> System:
        """The system, with this equilibrium's Hessian and factorisation in it."""
        self._system.linearise(self.equilibrium.state, self.equilibrium.q)
        return self._system

    # -- states --------------------------------------------------------------------------------
    @cached_property
    def solutions(self) -> Solutions:
        """x_q (n_free, n_parameters): all free unknowns in all parameters; angles in rad,
        translations global."""
        return self.system.solve_columns(
            -self._residual_q, None if self._border is None else self._border.column
        )

    @property
    def full(self) -> ParameterRows:
        """x_q as one array (n_free, n_parameters), copied from the solutions each time."""
        return self.solutions.rows(np.arange(self._n))

    def rows(self, dofs: Indices) -> ParameterRows:
        """Derivatives (m, n_parameters) of any unknowns of the scene, pinned (zero) and driven ones
        included."""
        kept = self._system.sparsity.kept[dofs]
        out = np.zeros((len(kept), self._system.scene.n_parameters))
        free = (kept >= 0) & (kept < self._n)
        out[free] = self.solutions.rows(kept[free])
        driven = kept >= self._n
        out[driven] = self._driven_map[kept[driven] - self._n].toarray()
        return out

    def positions(self, bodies: Indices) -> ParameterRows:
        """Derivatives (3 m, n_parameters) of body positions (m,), x y z after each other a body."""
        return self.rows((6 * np.asarray(bodies)[:, None] + np.arange(3)).ravel())

    def angles(self, hinges: Indices) -> ParameterRows:
        """Derivatives (m, n_parameters) of hinge angles."""
        return self.rows(6 * self._system.scene.n_bodies + np.asarray(hinges))

    @cached_property
    def torque_gradient(self) -> Parameters:
        """Derivative (n_parameters,) of the actuation's multiplier, zero without actuation."""
        if self._border is None:
            return np.zeros(self._system.scene.n_parameters)
        return -(self._residual_q.T @ self._border.column) / self._border.schur

    def adjoint(self, dofs: Indices, cotangent: Numbers) -> Parameters:
        """Gradient (n_parameters,) of J given dJ/d(unknowns) (m,) at some unknowns: one solve, no
        x_q."""
        kept = self._system.sparsity.kept[dofs]
        load = np.zeros(self._n + self._system.sparsity.n_driven)
        np.add.at(load, kept[kept >= 0], np.asarray(cotangent, float)[kept >= 0])
        return self._by_load(load)

    # -- stresses ------------------------------------------------------------------------------
    @cached_property
    def stresses(self) -> StressRows:
        """Derivatives (E, 6, n_parameters) of the elements' generalised stresses; memory E x 6 x
        n_parameters."""
        return self.stresses_of(np.arange(len(self._system.scene.elements)))

    def stresses_of(self, elements: Indices) -> StressRows:
        """Derivatives (m, 6, n_parameters) of some elements' generalised stresses."""
        rows = self.stress_rows(elements, np.broadcast_to(np.eye(6), (len(elements), 6, 6)))
        return rows.reshape(len(elements), 6, -1)

    def stress_rows(self, elements: Indices, factors: StressFactors) -> ParameterRows:
        """Derivatives (m r, n_parameters) of sums of elements' generalised stresses, r of each of
        m elements with their factors (m, r, 6); element by element."""
        system, scene = self.system, self._system.scene
        stiffness = scene.stiffness[elements] / self._lengths[elements][:, None]
        blocks = factors @ (self._B[elements] * stiffness[:, :, None])
        kept = system.sparsity.rows[elements][:, None]  # absent unknowns are -1
        free, driven = (kept >= 0) & (kept < self._n), kept >= self._n
        out = self.solutions.product(_rows_of(blocks, kept, free, self._n))
        if driven.any():
            own = _rows_of(blocks, kept - self._n, driven, self._driven_map.shape[0])
            own = (own @ self._driven_map).tocoo()
            out[own.row, own.col] += own.data
        has = np.flatnonzero(scene.length_parameter[elements] >= 0)
        of, r = elements[has], factors.shape[1]
        direct = np.einsum("mrs,ms->mr", factors[has], self._stress_L[of])
        direct *= scene.length_factor[of][:, None]
        out[r * has[:, None] + np.arange(r), scene.length_parameter[of][:, None]] += direct
        return out

    def stress_adjoint(self, cotangent: Stresses) -> Parameters:
        """Gradient (n_parameters,) of J given dJ/d(generalised stresses) (E, 6): one solve, no
        x_q."""
        explicit = np.einsum("er,er->e", self._stress_L, cotangent)
        return self._system.scene.by_parameter(explicit) + self._by_load(self._scattered(cotangent))

    # -- energies ------------------------------------------------------------------------------
    @cached_property
    def potential_gradient(self) -> Parameters:
        """d(potential)/dq (n_parameters,): by the envelope theorem only the explicit part
        counts."""
        explicit = self._system.scene.by_parameter(self._energy_L + self._weight_energy_L())
        return explicit + self._driven_map.T @ self._gradient[self._n :]

    @cached_property
    def energy_gradient(self) -> Parameters:
        """d(elastic energy)/dq (n_parameters,), the work of loads and actuators taken out by one
        adjoint solve."""
        if not self._loaded:
            return self.potential_gradient
        return self._system.scene.by_parameter(self._energy_L) + self._by_load(
            self._elastic_gradient()
        )

    @cached_property
    def potential_hessian(self) -> ParameterHessian:
        """Exact d2(potential)/dq2 (n_parameters, n_parameters): Pi_qq + Pi_qx x_q."""
        scene = self._system.scene
        twice = np.zeros(scene.n_parameters)
        factor = scene.length_factor[self._has]
        np.add.at(twice, scene.length_parameter[self._has], factor**2 * self._energy_LL[self._has])
        explicit = sp.diags_array(twice)
        driven = self._driven_map
        if driven.shape[0]:
            upper = self._system.sparsity.driven_columns(self._driven_values)[1]
            block = upper + sp.triu(upper, 1).T
            lengths_driven = driven.T @ self._lengths_in_driven()
            explicit = explicit + (lengths_driven + lengths_driven.T + driven.T @ block @ driven)
        explicit = explicit.tocoo()
        hessian = self.solutions.product(self._residual_q.T)
        # the only dense sum: these matrices are large
        hessian[explicit.row, explicit.col] += explicit.data
        hessian += hessian.T
        hessian *= 0.5
        return hessian

    @property
    def energy_hessian(self) -> ParameterHessian:
        """Exact d2(elastic energy)/dq2 of an unloaded scene; of a loaded one the potential's, a
        model of it."""
        return self.potential_hessian

    # -- use -----------------------------------------------------------------------------------
    def predict(self, dq: Parameters, dopening: float = 0.0) -> Start:
        """First-order prediction of the equilibrium at q + dq and opening + dopening: one solve."""
        system, eq = self.system, self.equilibrium
        rhs = -(self._residual_q @ dq)
        step, change = bordered_solve(
            system, self._border, rhs, dopening if self._border is not None else 0.0
        )
        kept = np.concatenate([step, self._driven_map @ dq])
        return Start(
            eq.state.moved(system.increment(step)),
            eq.torque + float(change),
            eq.stress + self._stress_change(kept, dq),
        )

    @cached_property
    def trusted(self) -> bool:
        """Whether derivatives can be relied on: False close to a bifurcation or limit point, and
        under moments without potential, whose tangent's skew part is not in the factorisation."""
        if not self._system.conservative:
            return False
        # columns in uneven shares: in a plain sum those of symmetric parameters could cancel out of
        # the softest mode
        shares = 1.0 + 0.5 * np.sin(np.arange(1, self._residual_q.shape[1] + 1) * 0.7390851)
        probe = self._residual_q @ shares
        size = np.abs(probe).max(initial=0.0)
        if size == 0.0:
            return True
        system, border = self.system, self._border
        if system.singular:
            return False
        d, t = bordered_solve(system, border, probe)
        residual = system.multiply(d) - probe
        if system.constraint is not None:
            residual = residual + system.constraint * t
        return bool(
            np.isfinite(residual).all() and np.abs(residual).max() <= _TRUSTED_RESIDUAL * size
        )

    # -- pieces --------------------------------------------------------------------------------
    @property
    def _border(self) -> Border | None:
        """The constraint through this equilibrium's factorisation, solved for once each."""
        return border_of(self.system)

    @property
    def _B(self) -> np.ndarray:
        """The elements' (E, 6, 14) derivatives of strains, in the system's own array."""
        return self.system.strain_displacement

    @property
    def _n(self) -> int:
        return self._system.n_unknowns

    @property
    def _loaded(self) -> bool:
        return bool(self._system.scene.terms) or self._system.scene.weight is not None

    @property
    def _driven_map(self) -> sp.csr_matrix:
        return self._system.scene.driven_map

    def _differentiate_by_length(self) -> np.ndarray:
        """Entries of d(gradient)/d(lengths' parameters), see `ParameterPattern`."""
        scene, has = self._system.scene, self._has
        block = np.einsum("eri,er->ei", self._B[has], self._stress_L[has])
        if scene.weight is not None:
            block += _weight_gradient_per_length(scene, self.equilibrium.state)[has]
        block *= scene.length_factor[has][:, None]
        return block[self._system.parameter_pattern.kept]

    def _assemble_residual_q(self) -> sp.csc_matrix:
        """R_q (n_free, n_parameters)."""
        return self._system.parameter_pattern.matrix(self._length_entries, self._driven_values)

    def _lengths_in_driven(self) -> sp.csr_matrix:
        """d(gradient in the driven unknowns)/d(lengths' parameters) (n_driven, n_parameters)."""
        pattern = self._system.parameter_pattern
        driven = pattern.rows >= self._n
        rows, columns = pattern.rows[driven] - self._n, pattern.columns[driven]
        return sp.csr_matrix(
            (self._length_entries[driven], (rows, columns)),
            shape=(self._system.sparsity.n_driven, self._system.scene.n_parameters),
        )

    def _stress_change(self, kept: np.ndarray, dq: np.ndarray) -> np.ndarray:
        """First-order change (E, 6) of the generalised stresses, for an increment of the kept
        unknowns and of q."""
        scene, s = self._system.scene, self._system.sparsity
        increment = np.append(kept, 0.0)[s.rows]  # absent unknowns (-1) read the appended zero
        change = (
            np.einsum("eri,ei->er", self._B, increment) * scene.stiffness / self._lengths[:, None]
        )
        has = self._has
        change[has] += (
            self._stress_L[has]
            * (scene.length_factor[has] * dq[scene.length_parameter[has]])[:, None]
        )
        return change

    def _weight_energy_L(self) -> np.ndarray | float:
        """d(load potential)/dL (E,) of dead loads: -w.(x_0 + x_1)/2."""
        scene = self._system.scene
        if scene.weight is None:
            return 0.0
        x = scene.node_poses(self.equilibrium.state)[0]
        return -0.5 * np.einsum(
            "ei,ei->e", scene.weight, x[scene.elements[:, 0]] + x[scene.elements[:, 1]]
        )

    def _by_load(self, load: np.ndarray) -> np.ndarray:
        """Gradient (n_parameters,) of J by way of the state, given dJ/d(kept unknowns)."""
        multiplier, _ = bordered_solve(self.system, self._border, load[: self._n])
        return self._driven_map.T @ load[self._n :] - self._residual_q.T @ multiplier

    def _elastic_gradient(self) -> np.ndarray:
        """d(elastic energy)/d(kept unknowns) at the equilibrium."""
        return self._scattered(self._strain)

    def _scattered(self, values: np.ndarray) -> np.ndarray:
        """B^T C v summed into the kept unknowns, for v (E, 6) and the elements' stiffnesses C =
        stiffness / length."""
        s, scene = self._system.sparsity, self._system.scene
        block = np.einsum("eri,er->ei", self._B, scene.stiffness * values / self._lengths[:, None])
        keep = s.rows >= 0
        return np.bincount(s.rows[keep], block[keep], minlength=s.n_free + s.n_driven)


def _rows_of(blocks: np.ndarray, columns: np.ndarray, there: np.ndarray, n: int) -> sp.csr_matrix:
    """Blocks (m, r, k) as the rows (m r, n) of a sparse matrix: their columns (m, 1, k), and which
    of these are there; the others count as zeros."""
    m, r, k = blocks.shape
    data = np.where(there, blocks, 0.0)
    indices = np.broadcast_to(np.where(there, columns, 0), blocks.shape)
    starts = np.arange(0, m * r * k + 1, k)
    return sp.csr_matrix((data.ravel(), indices.ravel(), starts), shape=(m * r, n))


def _weight_gradient_per_length(scene: Scene, state: State) -> np.ndarray:
    """d/dL (E, 14) of the dead load's generalised forces on an element's unknowns."""
    assert scene.weight is not None
    half = -0.5 * scene.weight
    arms, rates = scene.node_arms(state)
    out = np.zeros((len(scene.elements), 14))
    for end in range(2):
        node = scene.elements[:, end]
        Rb = state.rotations[scene.node_body[node]]
        force = np.einsum("nji,nj->ni", Rb, half)
        out[:, 7 * end : 7 * end + 3] = half
        out[:, 7 * end + 3 : 7 * end + 6] = np.cross(arms[node], force)
        out[:, 7 * end + 6] = np.einsum("ni,ni->n", rates[node], force)
    return out
