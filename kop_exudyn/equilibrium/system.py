"""A scene's equations: gradient, Hessian and factorisation, with all arrays made once a
topology."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from functools import cached_property
from time import perf_counter

import numpy as np
import scipy.sparse as sp

from ..scene.assembly import ENERGY, GRADIENT, HESSIAN
from ..scene.assembly_choice import rod_assembly
from ..scene.scene import Scene
from ..scene.sparsity import ParameterPattern, sparsity_of
from ..scene.state import State
from .block_solve import Solutions
from .factorisation import factorisation


@dataclass
class Counters:
    """What a system was asked to do, for profiles and for tests that count calls. Seconds are wall
    time."""

    energies: int = 0
    gradients: int = 0
    hessians: int = 0
    factorisations: int = 0
    solves: int = 0
    assembly_s: float = 0.0
    factorisation_s: float = 0.0
    solve_s: float = 0.0


@dataclass(frozen=True)
class Energy:
    """elastic : strain energy of the rods; potential : elastic plus loads, attraction and
    actuators."""

    elastic: float
    potential: float


class System:
    """Solver workspace of one scene.

    After `assemble`, `gradient` (n_kept,), `values`, `strain` (E, 6) and `strain_displacement` (E,
    6, 14) belong to the state assembled last; the factorisation to whatever `factorise` was called
    on last. Who reads them later, after others may have worked with the same system, asks for them
    with `linearise`, which costs nothing where they are still at hand.

    A system belongs to the thread that made it: in another one `set_parameters`, `assemble` and
    `factorise` raise RuntimeError, since two threads would overwrite each other's arrays.
    """

    def __init__(self, scene: Scene):
        self.scene = scene
        self._thread = threading.get_ident()
        self.sparsity = s = sparsity_of(scene)
        self.rods = rod_assembly(scene, s)
        self.values, self.gradient = self.rods.values, self.rods.gradient
        self.strain = self.rods.strain
        self.strain_displacement = self.rods.strain_displacement
        self.predicted_stress = self.rods.predicted_stress
        self.lengths = scene.length_constant.copy()
        self.factorisation = factorisation()
        self.counters = Counters()
        self._matrix = s.free_matrix(self.values)
        self.metric = self._metric()
        self.constraint = self._constraint()
        self._forces: tuple[float, float] | None = None  # of the state assembled last
        self._constraint_solution: np.ndarray | None = None  # of the factorisation at hand
        self.number = 0  # of the factorisation at hand, counted from 1
        # state and parameters whose own (unshifted, unmixed) Hessian is assembled and factorised
        self._held: tuple[State, np.ndarray] | None = None
        self.is_rotation = self._dof_is_rotation()[s.free]
        self.rotations = np.flatnonzero(self.is_rotation)  # taking numbers is quicker than a mask
        # moments count as forces
        self.force_weight = np.where(self.is_rotation, 1 / scene.length_scale, 1.0)

    @cached_property
    def parameter_pattern(self) -> ParameterPattern:
        """Where derivatives of the gradient in the parameters go."""
        return ParameterPattern(self.scene, self.sparsity)

    @property
    def n_unknowns(self) -> int:
        return self.sparsity.n_free

    @property
    def conservative(self) -> bool:
        """Whether a potential exists (a spatial moment has none)."""
        return all(term.conservative for term in self.scene.terms)

    @property
    def singular(self) -> bool:
        """Whether the last factorisation met an exactly zero pivot, so that nothing can be solved
        with it."""
        return self.factorisation.singular

    def set_parameters(self, q: np.ndarray) -> None:
        """Take the rest lengths of q; raises SimulationFailure unless they are positive."""
        self._check_thread()
        self.lengths = self.scene.rest_lengths(q)
        self._held = self._forces = None

    def holds(self, state: State, q: np.ndarray) -> bool:
        """Whether the Hessian at hand, assembled and factorised, is the one of a state (that very
        object) at the parameters q."""
        if self._held is None or self._held[0] is not state:
            return False
        return self._held[1] is q or np.array_equal(self._held[1], q)

    def mark_held(self, state: State, q: np.ndarray) -> None:
        """Note that the Hessian at hand is the state's own at the parameters q (not to be changed
        afterwards), neither shifted nor mixed."""
        self._held = (state, q)

    def linearise(self, state: State, q: np.ndarray) -> None:
        """Hold gradient, Hessian and factorisation of a state at the parameters q.

        They are made anew unless they are at hand. Raises SimulationFailure for rest lengths that
        are not positive.
        """
        if not self.holds(state, q):
            self.set_parameters(q)
            self.assemble(state)
            self.factorise()
            self.mark_held(state, q)

    def assemble(self, state: State, order: int = HESSIAN, mixed: bool = False) -> Energy:
        """Energy, and up to the order asked for gradient and Hessian, at a state.

        mixed : take the geometric stiffness at `predicted_stress` instead of the state's own stress
        """
        self._check_thread()
        begin = perf_counter()
        scene, s, count = self.scene, self.sparsity, self.counters
        self._held = self._forces = None
        if order >= GRADIENT:
            self.gradient[:] = 0.0
        if order == HESSIAN:
            self.values[:] = 0.0
        elastic, load = self.rods.assemble(state, self.lengths, order, mixed)
        potential = elastic + load
        for term, rows, slots in zip(scene.terms, s.term_rows, s.term_slots):
            if order == ENERGY:
                potential += term.energy(state)
            else:
                energy, g, H = term.gradient_hessian(state)
                potential += energy
                self.rods.scatter(rows, slots, g, H if order == HESSIAN else None)
        count.energies += order == ENERGY
        count.gradients += order == GRADIENT
        count.hessians += order == HESSIAN
        count.assembly_s += perf_counter() - begin
        return Energy(elastic, potential)

    def predict_stress(self, increment: np.ndarray) -> None:
        """Store the stress that the increment (n_free,) leads to, linearised at the state assembled
        last."""
        kept = np.zeros(len(self.gradient))
        kept[: self.sparsity.n_free] = increment
        self.rods.predict_stress(self.lengths, kept)

    def stress(self) -> np.ndarray:
        """Generalised stresses (E, 6) of the state assembled last."""
        return self.scene.stiffness * self.strain / self.lengths[:, None]

    def factorise(self, shift: float = 0.0, most: int | None = None) -> int:
        """Factorise the assembled Hessian plus shift times the metric; returns how many pivots are
        not positive.

        most : give up, with nothing to solve with, once more than this aren't
        """
        self._check_thread()
        begin = perf_counter()
        if shift:
            diagonal = self.values[self.sparsity.diagonal]
            self.values[self.sparsity.diagonal] = diagonal + shift * self.metric
        negative = self.factorisation.update(self._matrix, most)
        self._constraint_solution = None
        self.number += 1
        if shift:
            self.values[self.sparsity.diagonal] = diagonal
        self._held = None
        self.counters.factorisations += 1
        self.counters.factorisation_s += perf_counter() - begin
        return negative

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        """K^-1 rhs with the factorisation at hand; rhs (n_free,) or (n_free, k)."""
        begin = perf_counter()
        found = self.factorisation.solve(rhs)
        self.counters.solves += 1 if rhs.ndim == 1 else rhs.shape[1]
        self.counters.solve_s += perf_counter() - begin
        return found

    def solve_constraint(self) -> np.ndarray:
        """K^-1 c (n_free,) of the constraint c with the factorisation at hand, solved for once."""
        assert self.constraint is not None
        if self._constraint_solution is None:
            self._constraint_solution = self.solve(self.constraint)
        return self._constraint_solution

    def solve_columns(self, rhs: sp.csc_matrix, column: np.ndarray | None = None) -> Solutions:
        """Solutions (n_free, k) for many sparse right-hand sides; with column = K^-1 c on the
        constraint's kernel."""
        self.counters.solves += rhs.shape[1]
        return self.factorisation.solve_columns(
            rhs, None if column is None else self.constraint, column
        )

    def multiply(self, v: np.ndarray) -> np.ndarray:
        """K v with the assembled Hessian over the free unknowns; v (n_free,) or (n_free, k)."""
        U, diagonal = self._matrix, self.values[self.sparsity.diagonal]
        return U @ v + U.T @ v - (diagonal * v.T).T

    def increment(self, free: np.ndarray) -> np.ndarray:
        """An increment (n_dofs,) of all unknowns from one of the free ones."""
        full = np.zeros(self.scene.n_dofs)
        full[self.sparsity.free] = free
        return full

    def force_scale(self) -> tuple[float, float]:
        """Largest internal force of the state assembled last, and the round-off level of its
        forces.

        Moments count divided by the length scale. Round-off: coordinates of size s leave strains of
        about eps s / L, hence forces of eps s EA / L.
        """
        if self._forces is None:
            scene = self.scene
            force, moment, stretch = self.rods.largest_forces(self.lengths)
            self._forces = (
                float(np.maximum(force, moment / scene.length_scale)),
                float(np.finfo(float).eps * scene.reach * stretch),
            )
        return self._forces

    def _check_thread(self) -> None:
        if threading.get_ident() != self._thread:
            raise RuntimeError(
                "a System is the workspace of the thread that made it; another thread needs a "
                "System of its own (System(scene), or design.systems asked for there)"
            )

    def _dof_is_rotation(self) -> np.ndarray:
        rotation = np.ones(self.scene.n_dofs, bool)
        rotation[: 6 * self.scene.n_bodies].reshape(-1, 6)[:, :3] = False
        return rotation

    def _metric(self) -> np.ndarray:
        """1 for rotations, 1 / length_scale^2 for translations: makes a shift independent of
        units."""
        metric = np.where(self._dof_is_rotation(), 1.0, self.scene.length_scale**-2)
        return metric[self.sparsity.free]

    def _constraint(self) -> np.ndarray | None:
        """Derivative (n_free,) of the mean actuated angle, or None without actuation."""
        if self.scene.actuated is None:
            return None
        row = np.zeros(self.sparsity.n_free)
        place = self.sparsity.kept[6 * self.scene.n_bodies + self.scene.actuated]
        row[place] = 1 / len(place)
        return row
