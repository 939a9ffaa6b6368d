"""Assembly of a scene's rods: energy, gradient and Hessian straight into the factorisation's
arrays."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from .scene import Scene
from .sparsity import Sparsity
from .state import State

ENERGY, GRADIENT, HESSIAN = 0, 1, 2  # as in compiled/sources/assembly.c


class RodAssembly(ABC):
    """The rods of a scene, assembled into arrays that stay the same.

    gradient (n_kept,), values (n_values,) : of the assembled system, terms included
    strain e (E, 6), strain_displacement (E, 6, 14) : of the state assembled last
    predicted_stress (E, 6) : what a mixed assembly takes the geometric part at
    """

    def __init__(self, scene: Scene, sparsity: Sparsity):
        n = len(scene.elements)
        self.scene, self.sparsity = scene, sparsity
        self.gradient = np.zeros(sparsity.n_free + sparsity.n_driven)
        self.values = np.zeros(sparsity.n_values)
        self.strain = np.zeros((n, 6))
        self.strain_displacement = np.zeros((n, 6, 14))
        self.predicted_stress = np.zeros((n, 6))

    @abstractmethod
    def assemble(
        self, state: State, lengths: np.ndarray, order: int, mixed: bool
    ) -> tuple[float, float]:
        """Add to gradient and values up to the order asked for; returns the elastic energy and the
        dead load's potential.

        lengths : (E,) rest lengths
        mixed : geometric part at the predicted stress, else at the current one
        """

    @abstractmethod
    def scatter(
        self, rows: np.ndarray, slots: np.ndarray, g: np.ndarray, H: np.ndarray | None
    ) -> None:
        """Add a term's block gradients (m, k) and symmetric Hessians (m, k, k; None: only
        gradients), with its rows (m, k) and slots (m, k (k + 1) / 2)."""

    @abstractmethod
    def predict_stress(self, lengths: np.ndarray, increment: np.ndarray) -> None:
        """Set the predicted stress to (K/L) (e + B d), which a linear step d (n_kept,) leads to."""

    @abstractmethod
    def largest_forces(self, lengths: np.ndarray) -> tuple[float, float, float]:
        """Largest force and moment in the elements, and largest K_0 / L; NaN where a strain is."""
