"""Elastic energy of every state, over the input design's: pieces that hardly want to bend hold a
shape badly, or yield."""

from __future__ import annotations

import numpy as np

from ...equilibrium.equilibria import Equilibrium
from ...equilibrium.sensitivities import Sensitivities
from ...structures.base import Role
from ...structures.fitting import FitResult
from .base import Term, register_term


@register_term
class Energy(Term):
    """E / E0 in every state that is solved, E0 that of the input design's fitted state."""

    name = "energy"

    def value(self, role: Role, equilibrium: Equilibrium, fit: FitResult) -> float:
        return equilibrium.elastic_energy / self.reference.energy

    def gradient(self, role: Role, sensitivities: Sensitivities, fit: FitResult) -> np.ndarray:
        return sensitivities.energy_gradient / self.reference.energy

    def model(
        self, role: Role, sensitivities: Sensitivities, fit: FitResult
    ) -> tuple[np.ndarray, np.ndarray]:
        """The exact Hessian (of a loaded scene the potential's)."""
        return self.gradient(
            role, sensitivities, fit
        ), sensitivities.energy_hessian / self.reference.energy
