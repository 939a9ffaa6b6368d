"""What terms about load cases have in common: a positive number for each case of a design, under
the loads themselves (not factored), over that of the input design; their mean. Load cases count
alike, whatever their size; designs without loads have no such term."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar

import numpy as np

from ...equilibrium.equilibria import Equilibrium
from ...equilibrium.sensitivities import Sensitivities
from ...errors import InputError, SimulationFailure
from ...structures.base import Design, Role
from ...structures.fitting import FitResult
from ...structures.load_bound import LoadBound
from .base import Reference, Term

FACTOR = 1.0  # of the loads


class LoadTerm(Term):
    """The mean over the load cases of a number, over that of the input design.

    still : what is said of an input design whose number is zero

    Raises InputError where a load case can't be looked at, or the input design doesn't carry it or
    its number is zero.
    """

    still: ClassVar[str]

    def __init__(self, design: Design, reference: Reference):
        super().__init__(design, reference)
        unloaded = reference.equilibria[design.fitted_role.name]
        self._cases = [
            LoadBound(design, replace(case, factor=FACTOR), unloaded, safety=None)
            for case in design.load_cases
        ]
        field = f"weights.{self.name}"
        try:
            own = [self.of_case(*one) for one in self._loaded(unloaded)]
        except SimulationFailure as failure:
            raise InputError(
                f"can't be judged: {failure}", source=design.name, field=field
            ) from None
        for bound, number in zip(self._cases, own):
            if not number > 0:
                raise InputError(self.still, source=design.name, field=field, value=bound.case.name)
        self._scales = np.array(own) * len(own)

    def sees(self, role: Role) -> bool:
        return role.fitted and bool(self._cases)

    def value(self, role: Role, equilibrium: Equilibrium, fit: FitResult | None = None) -> float:
        found = [self.of_case(*one) for one in self._loaded(equilibrium)]
        return float(np.sum(found / self._scales))

    def gradient(self, role: Role, sensitivities: Sensitivities, fit: FitResult) -> np.ndarray:
        found = np.zeros(len(sensitivities.equilibrium.q))
        cases = self._loaded(sensitivities.equilibrium)
        for (bound, _, loaded), scale in zip(cases, self._scales):
            found += self.gradient_of_case(bound, sensitivities, loaded) / scale
        return found

    def model(
        self, role: Role, sensitivities: Sensitivities, fit: FitResult
    ) -> tuple[np.ndarray, np.ndarray]:
        n = len(sensitivities.equilibrium.q)
        gradient, hessian = np.zeros(n), np.zeros((n, n))
        cases = self._loaded(sensitivities.equilibrium)
        for (bound, _, loaded), scale in zip(cases, self._scales):
            own, curvature = self.model_of_case(bound, sensitivities, loaded)
            gradient += own / scale
            hessian += curvature / scale
        return gradient, hessian

    @abstractmethod
    def of_case(self, bound: LoadBound, unloaded: Equilibrium, loaded: Equilibrium) -> float:
        """The number of one case, not negative.

        bound : of the case
        unloaded, loaded : the states, both of the same elements
        """

    @abstractmethod
    def gradient_of_case(
        self, bound: LoadBound, sensitivities: Sensitivities, loaded: Equilibrium
    ) -> np.ndarray:
        """(nq,) the derivative of the number in the elements, by the adjoint method.

        sensitivities : of the unloaded state
        """

    @abstractmethod
    def model_of_case(
        self, bound: LoadBound, sensitivities: Sensitivities, loaded: Equilibrium
    ) -> tuple[np.ndarray, np.ndarray]:
        """The derivative (nq,) and a positive semidefinite model of the second one (nq, nq)."""

    def _loaded(
        self, unloaded: Equilibrium
    ) -> Iterator[tuple[LoadBound, Equilibrium, Equilibrium]]:
        """Every load case with the unloaded state and its own. Raises SimulationFailure where the
        design gives way."""
        for bound in self._cases:
            states = bound.loaded(unloaded)
            if not states:
                raise SimulationFailure(
                    f"gives way under {bound.case.name!r}", where=self.design.name
                )
            yield bound, unloaded, states[FACTOR]
