"""How far the loads move what they act on: compliance, for kits whose designs should be stiff as a
whole. Deflections count wherever they are, compliance where loads act.

With the loads f of a case (not factored) and the movements u of what they act on, the term is the
mean over the cases of

    f.u / f.u_0

u_0 that of the input design: the end compliance of designs that deform much (Buhl, Pedersen,
Sigmund, Struct. Multidisc. Optim. 19, 2000). Weight counts with the lengths of the rods.
"""

from __future__ import annotations

import numpy as np

from ...equilibrium.equilibria import Equilibrium
from ...equilibrium.sensitivities import Sensitivities
from ...structures.load_bound import LoadBound
from .base import register_term
from .under_loads import FACTOR, LoadTerm


@register_term
class Compliance(LoadTerm):
    """The mean of the loads' work f.u, over that of the input design."""

    name = "compliance"
    still = "the loads do no work on the input design in this load case"

    def of_case(self, bound: LoadBound, unloaded: Equilibrium, loaded: Equilibrium) -> float:
        return bound.work(FACTOR, unloaded, loaded)

    def gradient_of_case(
        self, bound: LoadBound, sensitivities: Sensitivities, loaded: Equilibrium
    ) -> np.ndarray:
        return bound.work_adjoint(sensitivities, FACTOR, loaded)

    def model_of_case(
        self, bound: LoadBound, sensitivities: Sensitivities, loaded: Equilibrium
    ) -> tuple[np.ndarray, np.ndarray]:
        """As of f.K^-1 f, of whose second derivatives 2 u_q.K u_q is the part that is never
        negative; the other, of the stiffness's own curvature, is left out."""
        gradient = self.gradient_of_case(bound, sensitivities, loaded)
        return gradient, 2 * bound.stiffness_product(sensitivities, FACTOR, loaded)
