"""How far the joints are from the target, T / l0^2, in the fitted state."""

from __future__ import annotations

import numpy as np

from ...equilibrium.equilibria import Equilibrium
from ...equilibrium.sensitivities import Sensitivities
from ...structures.base import Role
from ...structures.fitting import FitResult
from .base import Term, register_term


@register_term
class Fit(Term):
    """Target fitting at the best rigid placement, over the square of the target's size."""

    name = "fit"

    def sees(self, role: Role) -> bool:
        return role.fitted

    def label(self, role: Role) -> str:
        return self.name

    def value(self, role: Role, equilibrium: Equilibrium, fit: FitResult) -> float:
        return fit.value / self.reference.target.size**2

    def gradient(self, role: Role, sensitivities: Sensitivities, fit: FitResult) -> np.ndarray:
        dofs = (6 * self.design.joints[:, None] + np.arange(3)).ravel()
        return sensitivities.adjoint(dofs, fit.gradient.ravel()) / self.reference.target.size**2

    def model(
        self, role: Role, sensitivities: Sensitivities, fit: FitResult
    ) -> tuple[np.ndarray, np.ndarray]:
        """Gauss-Newton: the closest points' own curvature is left out, their normals' projections
        are not."""
        positions_q = sensitivities.positions(self.design.joints)
        rows = fit.weighted_rows(positions_q)
        scale = 1 / self.reference.target.size**2
        return scale * (positions_q.T @ fit.gradient.ravel()), scale * (rows.T @ rows)
