"""Fits one design's own parameters to its target, before any kit: inputs that are off their target
blame the kit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..checks import check_kind
from ..kit.kinds import part_kind
from ..sqp.constraints import LinearConstraints, validate_bounds
from ..sqp.options import SQPOptions
from ..sqp.problem import Derivatives, Point
from ..sqp.solver import minimise
from ..structures.base import Design
from .evaluation import Evaluation
from .objective import DesignObjective
from .weights import Weights


class OwnProblem:
    """F(q) of one design over all its parameters, within its bounds and perhaps narrower ones.

    A point's data is the evaluation there; Exudyn's once derivatives were taken.
    """

    def __init__(self, objective: DesignObjective, lower: Any = -np.inf, upper: Any = np.inf):
        self.objective, design = objective, objective.design
        self.lower, self.upper = np.maximum(design.lower, lower), np.minimum(design.upper, upper)
        self.n = len(design.parameters)
        self.constraints = LinearConstraints.none(self.n)
        self.scale = np.full(self.n, float(design.free_scale))
        for group in design.groups:
            self.scale[group.indices] = part_kind(group.kind).scale(
                design.parameters[group.indices.ravel()]
            )

    def evaluate(self, x: np.ndarray, previous: Point | None) -> Point:
        return self.point(
            self.objective.evaluate(x, previous.data if previous is not None else None)
        )

    def point(self, evaluation: Evaluation) -> Point:
        """The point of a given evaluation."""
        return Point(evaluation.q, evaluation.value, evaluation)

    def derivatives(self, point: Point) -> Derivatives:
        found = self.objective.derivatives(point.data)
        refined = replace(point, data=found.evaluation)
        return Derivatives(found.gradient, sp.csc_matrix(found.hessian), point=refined)


def fit_input(
    design: Design,
    weights: Weights | None = None,
    *,
    lower: Any = -np.inf,
    upper: Any = np.inf,
    max_steps: int = 30,
    tolerance: float = 1e-3,
) -> Evaluation:
    """The design's parameters of least F, from its input parameters; confirmed by Exudyn.

    design : whose parameters are sought, and whose target they are to meet
    weights : of fit and energy, default: the fit weight of the design's class
    lower, upper : (nq,) or one number each, besides the design's own bounds; lengths in the
        design's unit, angles in rad
    max_steps : of the optimiser
    tolerance : steps that promise or gain less than this share of F are the last

    Raises InputError for bounds that exclude each other, SimulationFailure when the input can't be
    simulated.
    """
    check_kind("design", design, Design, "see load_design")
    weights = Weights(fit=design.fit_weight) if weights is None else weights
    check_kind("weights", weights, Weights, "Weights.of takes names and numbers")
    lower, upper = validate_bounds(lower, upper, len(design.parameters), "fit_input")
    objective = DesignObjective(design, weights)
    problem = OwnProblem(objective, lower, upper)
    start = np.clip(design.parameters, problem.lower, problem.upper)
    result = minimise(problem, start, SQPOptions(max_steps=max_steps, decrease_tolerance=tolerance))
    return objective.confirm(result.point.data)
