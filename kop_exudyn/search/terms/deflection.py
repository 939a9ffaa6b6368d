"""How far the designs deflect under their loads: for kits whose designs should be stiffer than the
bounds on deflections ask for.

With u_i the movement of the rods' n bodies under a load case (not factored), and u_0 that of the
input design, the term is the mean over the cases of

    sum_i |u_i|^2 / sum_i |u_0,i|^2
"""

from __future__ import annotations

import numpy as np

from ...equilibrium.equilibria import Equilibrium
from ...equilibrium.sensitivities import Sensitivities
from ...structures.load_bound import LoadBound
from .base import register_term
from .under_loads import FACTOR, LoadTerm


@register_term
class Deflection(LoadTerm):
    """The mean of the squared movements under the loads, over that of the input design."""

    name = "deflection"
    still = "the input design doesn't move under this load case"

    def of_case(self, bound: LoadBound, unloaded: Equilibrium, loaded: Equilibrium) -> float:
        return float((bound.moves(unloaded, loaded) ** 2).sum())

    def gradient_of_case(
        self, bound: LoadBound, sensitivities: Sensitivities, loaded: Equilibrium
    ) -> np.ndarray:
        moved = bound.moves(sensitivities.equilibrium, loaded)
        return bound.moves_adjoint(sensitivities, FACTOR, loaded, 2 * moved)

    def model_of_case(
        self, bound: LoadBound, sensitivities: Sensitivities, loaded: Equilibrium
    ) -> tuple[np.ndarray, np.ndarray]:
        """Gauss-Newton: the curvature of the movements themselves is left out."""
        moved = bound.moves(sensitivities.equilibrium, loaded)
        n = len(sensitivities.equilibrium.q)
        rows = bound.moves_derivatives(sensitivities, FACTOR, loaded).reshape(-1, n)
        return 2 * moved.ravel() @ rows, 2 * rows.T @ rows
