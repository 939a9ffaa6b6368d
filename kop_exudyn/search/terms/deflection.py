"""How far the designs deflect under their loads: for kits whose designs should be stiffer than the
bounds on deflections ask for.

With u_i the movement of the rods' n bodies under a load case (not factored), and u_0 that of the
input design, the term is the mean over the cases of

    sum_i |u_i|^2 / sum_i |u_0,i|^2

Load cases count alike, whatever their size; designs without loads have no such term.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ...equilibrium.equilibria import Equilibrium
from ...equilibrium.sensitivities import Sensitivities
from ...errors import InputError, SimulationFailure
from ...structures.base import Design, Role
from ...structures.fitting import FitResult
from ...structures.load_bound import LoadBound
from .base import Reference, Term, register_term

_FACTOR = 1.0  # deflections are those under the loads themselves


@register_term
class Deflection(Term):
    """The mean of the squared movements under the loads, over that of the input design.

    Raises InputError where a load case can't be looked at, or the input design doesn't carry it or
    doesn't move under it.
    """

    name = "deflection"

    def __init__(self, design: Design, reference: Reference):
        super().__init__(design, reference)
        unloaded = reference.equilibria[design.fitted_role.name]
        self._cases = [
            LoadBound(design, replace(case, factor=_FACTOR), unloaded, safety=None)
            for case in design.load_cases
        ]
        self._scales = np.ones(len(self._cases))
        try:
            squares = [float((moved**2).sum()) for _, _, moved in self._moved(unloaded)]
        except SimulationFailure as failure:
            raise InputError(
                f"can't be judged: {failure}", source=design.name, field="weights.deflection"
            ) from None
        self._scales = np.array(squares) * len(squares)
        for bound, square in zip(self._cases, squares):
            if not square > 0:
                raise InputError(
                    "the input design doesn't move under this load case",
                    source=design.name,
                    field="weights.deflection",
                    value=bound.case.name,
                )

    def sees(self, role: Role) -> bool:
        return role.fitted and bool(self._cases)

    def value(self, role: Role, equilibrium: Equilibrium, fit: FitResult | None = None) -> float:
        squares = [float((moved**2).sum()) for _, _, moved in self._moved(equilibrium)]
        return float(np.sum(squares / self._scales))

    def gradient(self, role: Role, sensitivities: Sensitivities, fit: FitResult) -> np.ndarray:
        found = np.zeros(len(sensitivities.equilibrium.q))
        states = self._moved(sensitivities.equilibrium)
        for (bound, loaded, moved), scale in zip(states, self._scales):
            found += bound.moves_adjoint(sensitivities, _FACTOR, loaded, 2 / scale * moved)
        return found

    def model(
        self, role: Role, sensitivities: Sensitivities, fit: FitResult
    ) -> tuple[np.ndarray, np.ndarray]:
        """Gauss-Newton: the curvature of the movements themselves is left out."""
        n = len(sensitivities.equilibrium.q)
        gradient, hessian = np.zeros(n), np.zeros((n, n))
        states = self._moved(sensitivities.equilibrium)
        for (bound, loaded, moved), scale in zip(states, self._scales):
            rows = bound.moves_derivatives(sensitivities, _FACTOR, loaded).reshape(-1, n)
            gradient += 2 / scale * moved.ravel() @ rows
            hessian += 2 / scale * rows.T @ rows
        return gradient, hessian

    def _moved(self, unloaded: Equilibrium) -> Iterator[tuple[LoadBound, Equilibrium, np.ndarray]]:
        """By load case, its loaded state and the movements (n, 3). Raises SimulationFailure where
        the design gives way."""
        for bound in self._cases:
            states = bound.loaded(unloaded)
            if not states:
                raise SimulationFailure(
                    f"gives way under {bound.case.name!r}", where=self.design.name
                )
            loaded = states[_FACTOR]
            yield bound, loaded, bound.moves(unloaded, loaded)
