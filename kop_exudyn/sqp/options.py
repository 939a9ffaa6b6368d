"""What is asked of the optimiser, and what it gives."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..checks import check_choice, check_not_negative, check_positive, check_whole
from .history import SQPState, StepRecord
from .problem import Point
from .qp import QPOptions


@dataclass(frozen=True)
class SQPOptions:
    """Settings of ``minimise``.

    hessian : ``exact``, from the problem, or ``bfgs``
    secant : correct the problem's Hessian by what it didn't predict (see curvature.py); for
        problems of few variables, since every step teaches it one direction of each block
    max_steps : accepted steps, those before a resumption included
    max_trials : points evaluated in search of one step
    gradient_tolerance : stop when the projected gradient, in scaled variables, falls below this
        share of the larger of the objective and the projected gradient at the start
    decrease_tolerance : stop when the full, undamped model step promises less than this share of
        the objective, or when the last `stall_steps` steps together gained less than it
    stall_steps : see there
    radius : first trust radius in scaled variables (2-norm); infinite: the first step is the
        model's minimiser
    min_radius : smallest trust radius; below it no step is looked for
    accept : least share of the predicted reduction that a step must attain
    feasibility : violation of the constraints by the start, in the constraints' units, that is put
        right silently
    penalty : weight of a nonlinear bound's excess in the merit function, at first; where a minimum
        of that still exceeds a bound by more than `excess`, it is raised tenfold, `raises` times at
        most
    qp : settings of the QP solver
    """

    hessian: str = "exact"
    secant: bool = False
    max_steps: int = 200
    max_trials: int = 25
    gradient_tolerance: float = 1e-6
    decrease_tolerance: float = 1e-10
    stall_steps: int = 3
    radius: float = np.inf
    min_radius: float = 1e-10
    accept: float = 1e-4
    feasibility: float = 1e-9
    penalty: float = 1.0
    excess: float = 1e-3
    raises: int = 1
    qp: QPOptions = QPOptions()

    def __post_init__(self) -> None:
        check_choice("hessian", self.hessian, ("exact", "bfgs"))
        for name in ("max_steps", "max_trials", "stall_steps", "raises"):
            check_whole(name, getattr(self, name), least=int(name in ("max_trials", "stall_steps")))
        check_not_negative("feasibility", self.feasibility)
        for name in (
            "gradient_tolerance",
            "decrease_tolerance",
            "radius",
            "min_radius",
            "accept",
            "penalty",
            "excess",
        ):
            check_positive(name, getattr(self, name), finite=name != "radius")


@dataclass(frozen=True)
class SQPResult:
    """The last accepted point and how it was reached.

    converged : whether a tolerance was met;  status : why it stopped and, if it did not converge,
        what to do
    steps, evaluations, failures : accepted steps, evaluated points, and those of them that could
        not be simulated
    pressure : (k,) multipliers of the nonlinear bounds that have rows at the last point, in the
        order of `Inequalities.bound`; what widening a bound by one would gain
    """

    x: np.ndarray
    point: Point
    converged: bool
    status: str
    steps: int
    evaluations: int
    failures: int
    history: tuple[StepRecord, ...]
    state: SQPState
    pressure: np.ndarray = field(default_factory=lambda: np.zeros(0))
