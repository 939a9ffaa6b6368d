"""One design at one parameter vector: its states, its objective and what bounds it, and the
derivatives there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ..equilibrium.equilibria import Equilibrium
from ..equilibrium.exudyn_confirm import Confirmation
from ..structures.base import Design
from ..structures.fitting import FitResult
from ..structures.stress_bound import Rows


@dataclass(frozen=True)
class Evaluation:
    """One design at one parameter vector.

    q : (nq,)
    value : F
    terms : its weighted parts by name ("fit", "energy ROLE", ...)
    fit : target fitting of the joints
    equilibria : by role
    confirmations : Exudyn's, by role; empty until a result is made of it
    iterations, solves : Newton iterations and equilibria that it took
    utilisation : by state, the largest equivalent stress over what is allowed; empty where stress
        is not bounded. States are the roles, and the stations of the way that are known; under
        loads the deflections are states of their own
    loaded : by load case and factor, the states under loads, where they are bounded; empty for a
        case under which the design gives way
    way : the states at the stations of `Design.way`, known for points that are kept where designs
        have to open by themselves
    """

    q: np.ndarray
    value: float
    terms: Mapping[str, float]
    fit: FitResult
    equilibria: Mapping[str, Equilibrium]
    confirmations: Mapping[str, Confirmation]
    iterations: int
    solves: int
    utilisation: Mapping[str, float] = field(default_factory=dict)
    way: tuple[Equilibrium, ...] = ()
    loaded: Mapping[str, Mapping[float, Equilibrium]] = field(default_factory=dict)

    @property
    def excess(self) -> dict[str, float]:
        """By how much the bounds are exceeded, by state; zero where they are met."""
        return {state: max(0.0, value - 1.0) for state, value in self.utilisation.items()}


@dataclass(frozen=True)
class DesignDerivatives:
    """Gradient (nq,) and model Hessian (nq, nq; None when not asked for) of F, and the refined
    evaluation.

    seconds : by phase, for profiles
    bounds : by state, the bounds that come near to being met with, linearised
    """

    gradient: np.ndarray
    hessian: np.ndarray | None
    evaluation: Evaluation
    seconds: Mapping[str, float]
    bounds: Mapping[str, Rows] = field(default_factory=dict)

    @property
    def model(self) -> np.ndarray:
        """The Hessian, which must have been asked for."""
        assert self.hessian is not None
        return self.hessian


def distance(design: Design, a: Evaluation, b: Evaluation) -> float:
    """How far apart two states of a design are: the largest distance of a joint, as a share of the
    target's size.

    Each state is at the placement of its least T on the target.
    """
    role = design.fitted_role.name
    joints = [e.fit.fitted.apply(e.equilibria[role].state.positions[design.joints]) for e in (a, b)]
    return float(np.linalg.norm(joints[0] - joints[1], axis=1).max()) / a.fit.size
