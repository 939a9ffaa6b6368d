"""Sequential quadratic programming with a trust region for costly objectives that may fail to
evaluate."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..errors import InputError, SimulationFailure
from ..wording import counted
from .constraints import check_feasible, validate_bounds
from .curvature import SecantCorrection
from .history import SQPState, StepRecord
from .model import (
    ModelStep,
    QuadraticModel,
    Region,
    build_model,
    minimise_model,
    nearest_feasible,
    penalty_of,
    projected_gradient,
)
from .options import SQPOptions, SQPResult
from .problem import Derivatives, Point, Problem, block_sizes_of, scale_of
from .qp import QPSolver
from .quasi_newton import BlockBFGS

_log = logging.getLogger(__name__)
_ROUNDING = 4 * np.finfo(float).eps  # a smaller relative reduction can't be told from rounding


def minimise(
    problem: Problem,
    x0: np.ndarray,
    options: SQPOptions | None = None,
    *,
    observer: Callable[[StepRecord], None] | None = None,
    checkpoint: Callable[[SQPState, Point], None] | None = None,
    state: SQPState | None = None,
    start: Point | None = None,
) -> SQPResult:
    """Minimise a problem within its bounds and linear constraints.

    Each step minimises a convex quadratic model within a trust region, evaluates the objective
    there, and is taken if it attains its share of the predicted reduction; a point that raises
    SimulationFailure shrinks the region. Derivatives are computed at accepted points only, once.

    Parameters
    ----------
    x0 : (n,) start; moved to the nearest point within bounds and constraints
    observer : called with each StepRecord;  checkpoint : called with the state and point after each
        step
    state : continue from here; x0 is then not used
    start : the evaluated point at x0 (or state.x), if known; it is not evaluated again

    Raises InputError for bounds or constraints that can't be met, SimulationFailure when the start
    can't be evaluated.
    """
    return _Run(problem, options or SQPOptions(), observer, checkpoint).solve(x0, state, start)


class _Run:
    """One call of ``minimise``."""

    def __init__(self, problem: Problem, options: SQPOptions, observer: Any, checkpoint: Any):
        self.problem, self.options = problem, options
        self.observer, self.checkpoint = observer, checkpoint
        lower, upper = validate_bounds(problem.lower, problem.upper, problem.n)
        if problem.constraints.A.shape[1] != problem.n:
            message = f"has {problem.constraints.A.shape[1]} columns for {problem.n} variables"
            raise InputError(message, field="constraints.A")
        check_feasible(lower, upper, problem.constraints)
        self.region = Region(lower, upper, problem.constraints, scale_of(problem))
        self.qp, self.projection = QPSolver(options.qp), QPSolver(options.qp)
        sizes = block_sizes_of(problem)
        # problems may offer their gradient alone, which costs far less than second derivatives that
        # BFGS won't look at
        self._derivatives = problem.derivatives
        if options.hessian == "bfgs":
            self._derivatives = getattr(problem, "first_derivatives", problem.derivatives)
        self._completed = getattr(problem, "completed", None)
        self.bfgs = BlockBFGS(sizes, self.region.scale) if options.hessian == "bfgs" else None
        corrected = options.secant and options.hessian == "exact"
        self.secant = SecantCorrection(sizes, self.region.scale) if corrected else None
        self.seconds: dict[str, float] = {}

    def solve(self, x0: np.ndarray, state: SQPState | None, start: Point | None) -> SQPResult:
        state, point = self._begin(x0, state, start)
        derivatives = self._timed("derivatives", self._derivatives, point)
        point = derivatives.point or point
        while True:
            outcome = self._advanced(state, point, derivatives)
            if isinstance(outcome, SQPResult):
                if self._worth_raising(outcome):
                    state = replace(outcome.state, penalty=10 * outcome.state.penalty)
                    continue
                return replace(outcome, pressure=self._pressure(outcome, derivatives))
            state, point, derivatives = outcome
            if self.observer is not None:
                self.observer(state.history[-1])
            if self.checkpoint is not None:
                self.checkpoint(state, point)

    def _advanced(self, state: SQPState, point: Point, derivatives: Derivatives) -> Any:
        """The next state, point and derivatives; or the result, where there is none."""
        norm, state = self._stationarity(point, derivatives, state)
        met = not point.excess.any()
        if met and norm <= self.options.gradient_tolerance * max(
            state.gradient_scale, abs(point.value)
        ):
            return self._result(
                state, point, True, "converged: the projected gradient met its tolerance"
            )
        if self._stalled(state, point):
            text = (
                f"converged: the last {self.options.stall_steps} steps gained less "
                "than the tolerance"
            )
            return self._result(state, point, True, text)
        if state.step >= self.options.max_steps:
            text = (
                f"stopped after {counted(state.step, 'step')}: raise max_steps or "
                "resume from the last state"
            )
            return self._result(state, point, False, text)
        model = self._model(point, derivatives, state.penalty)
        return self._step(point, model, state, norm)

    def _worth_raising(self, result: SQPResult) -> bool:
        """Whether a minimum of the merit function exceeds a bound that more weight might meet."""
        most = self.options.penalty * 10**self.options.raises
        exceeded = result.point.excess.max(initial=0.0) > self.options.excess
        return bool(result.converged and exceeded and result.state.penalty < 0.99 * most)

    def _pressure(self, result: SQPResult, derivatives: Derivatives) -> np.ndarray:
        """Multipliers of the nonlinear bounds at the last point, from its own subproblem."""
        bounds = derivatives.inequalities
        if bounds is None or not bounds.rows:
            return np.zeros(0)
        found = np.zeros(bounds.bound.max() + 1)
        state = result.state
        model = self._model(result.point, derivatives, state.penalty)
        step = minimise_model(model, state.radius, self.qp, (state.y, state.z))
        if step is not None and len(step.pressure):
            found = step.pressure
        return found

    def _stalled(self, state: SQPState, point: Point) -> bool:
        recent = [r for r in state.history if r.penalty == state.penalty]
        recent = recent[-self.options.stall_steps :]
        return len(recent) == self.options.stall_steps and sum(
            r.actual for r in recent
        ) <= self.options.decrease_tolerance * abs(point.value)

    def _begin(
        self, x0: Any, state: SQPState | None, start: Point | None
    ) -> tuple[SQPState, Point]:
        """The first state and point; the quasi-Newton matrix of a resumed run."""
        if state is None:
            n, m = self.region.n, self.region.constraints.rows
            state = SQPState(
                self._feasible_start(x0),
                self.options.radius,
                y=np.zeros(m),
                z=np.zeros(n),
                penalty=self.options.penalty,
            )
        elif state.quasi_newton and (learnt := self.bfgs or self.secant):
            learnt.restore(state.quasi_newton)
        if start is not None and np.array_equal(start.x, state.x):
            return state, start
        point = self._timed("evaluate", self.problem.evaluate, state.x.copy(), None)
        if not np.isfinite(point.value):
            raise SimulationFailure("the objective is not finite", where="start")
        return replace(state, evaluations=state.evaluations + 1), point

    def _feasible_start(self, x0: np.ndarray) -> np.ndarray:
        x = np.array(x0, dtype=float)
        if x.shape != (self.region.n,) or not np.all(np.isfinite(x)):
            raise InputError(f"must be {self.region.n} finite numbers", field="x0")
        clipped = np.clip(x, self.region.lower, self.region.upper)
        if self.region.constraints.violation(clipped) <= self.options.feasibility:
            return clipped
        nearest = nearest_feasible(x, self.region, self.projection)
        if nearest is None:
            raise InputError("could not be moved to a point that meets the constraints", field="x0")
        _log.warning(
            "the start violates the constraints; moved to the nearest point that meets them"
        )
        return nearest

    def _stationarity(
        self, point: Point, derivatives: Derivatives, state: SQPState
    ) -> tuple[float, SQPState]:
        gradient = derivatives.gradient
        if gradient.shape != (self.region.n,) or not np.all(np.isfinite(gradient)):
            raise SimulationFailure(
                "the gradient is not finite or has the wrong shape", where=f"step {state.step}"
            )
        norm = projected_gradient(point.x, gradient, self.region, self.projection)
        return norm, replace(state, gradient_scale=norm) if state.step == 0 else state

    def _model(self, point: Point, derivatives: Derivatives, penalty: float) -> QuadraticModel:
        if self.bfgs is not None:
            self.bfgs.observe(point.x, derivatives.gradient)
            return build_model(
                point.x, replace(derivatives, extra=None), self.bfgs.matrix(), self.region, penalty
            )
        if derivatives.hessian is None:
            raise InputError(
                "the problem gives no Hessian: choose 'bfgs'", field="hessian", value="exact"
            )
        hessian = sp.csc_matrix(derivatives.hessian)
        if self.secant is not None:
            own = (
                derivatives.gradient
                if derivatives.own_gradient is None
                else derivatives.own_gradient
            )
            self.secant.observe(point.x, own, hessian)
            hessian = hessian + self.secant.matrix()
        return build_model(point.x, derivatives, hessian, self.region, penalty)

    def _step(self, point: Point, model: QuadraticModel, state: SQPState, norm: float) -> Any:
        """The next accepted state and point, or the result when there is none."""
        radius, trials, failures, last = state.radius, 0, 0, ""
        while trials < self.options.max_trials and radius >= self.options.min_radius:
            step = self._timed("qp", minimise_model, model, radius, self.qp, (state.y, state.z))
            if step is None:
                text = (
                    "stopped: no QP solver found the step; check the scale of the variables "
                    "and the Hessian"
                )
                return self._result(self._count(state, trials, failures), point, False, text)
            if step.damping == 0 and step.predicted <= self.options.decrease_tolerance * abs(
                point.value
            ):
                text = "converged: the model promises no further decrease"
                return self._result(self._count(state, trials, failures), point, True, text)
            if step.predicted <= _ROUNDING * abs(point.value):
                break
            trials += 1
            x = np.clip(point.x + self.region.scale * step.u, self.region.lower, self.region.upper)
            try:
                trial = self._timed("evaluate", self.problem.evaluate, x, point)
                actual = self._merit(point, state) - self._merit(trial, state)
                accepted = actual >= self.options.accept * step.predicted  # false for NaN
                if accepted and self._completed is not None:
                    trial = self._timed("evaluate", self._completed, trial, point)
                    actual = self._merit(point, state) - self._merit(trial, state)
                    accepted = actual >= self.options.accept * step.predicted
                # a point without derivatives can't be gone on from: it counts as failed
                derivatives = (
                    self._timed("derivatives", self._derivatives, trial) if accepted else None
                )
                if derivatives is not None and derivatives.point is not None:
                    trial = derivatives.point
            except SimulationFailure as failure:
                failures, last = failures + 1, str(failure)
                radius = 0.25 * min(step.length, radius)
                _log.info("step %d: trial %d failed: %s", state.step + 1, trials, failure)
                continue
            if accepted:
                state = self._count(state, trials, failures)
                state = self._accept(
                    state, trial, model, step, radius, norm, actual, trials, failures
                )
                return state, trial, derivatives
            radius = _shrunk(model, step, actual) * min(step.length, radius)
        return self._stuck(self._count(state, trials, failures), point, trials, failures, last)

    def _accept(
        self,
        state: SQPState,
        trial: Point,
        model: QuadraticModel,
        step: ModelStep,
        radius: float,
        norm: float,
        actual: float,
        trials: int,
        failures: int,
    ) -> SQPState:
        record = StepRecord(
            state.step + 1,
            float(trial.value),
            norm,
            step.predicted,
            float(actual),
            step.damping,
            radius,
            step.length,
            trials,
            failures,
            step.result.active,
            model.convexified,
            step.result.solver,
            self.seconds,
            float(trial.excess.max(initial=0.0)),
            state.penalty,
        )
        self.seconds = {}
        return replace(
            state,
            x=trial.x.copy(),
            radius=_next_radius(radius, step, actual / step.predicted),
            step=state.step + 1,
            y=step.result.y,
            z=step.result.z[: self.region.n],
            pressure=step.pressure,
            history=(*state.history, record),
            quasi_newton=learnt.to_arrays() if (learnt := self.bfgs or self.secant) else {},
        )

    def _stuck(
        self, state: SQPState, point: Point, trials: int, failures: int, last: str
    ) -> SQPResult:
        if not trials:
            text = (
                "stopped: the trust radius is so small that a step changes the objective by less "
                "than rounding"
            )
        elif failures:
            text = (
                f"stopped: {failures} of the last {counted(trials, 'trial point')} "
                "could not be simulated "
                f"(last: {last}); "
                "start elsewhere or tighten the bounds"
            )
        else:
            text = (
                f"stopped: none of the last {counted(trials, 'trial point')} attained "
                "the predicted "
                f"reduction; the objective is "
                "at its numerical accuracy or its derivatives are wrong"
            )
        return self._result(state, point, False, text)

    @staticmethod
    def _merit(point: Point, state: SQPState) -> float:
        """The exact penalty function that steps have to lower."""
        return point.value + state.penalty * penalty_of(point.excess)

    @staticmethod
    def _count(state: SQPState, trials: int, failures: int) -> SQPState:
        return replace(
            state, evaluations=state.evaluations + trials, failures=state.failures + failures
        )

    @staticmethod
    def _result(state: SQPState, point: Point, converged: bool, status: str) -> SQPResult:
        return SQPResult(
            point.x,
            point,
            converged,
            status,
            state.step,
            state.evaluations,
            state.failures,
            state.history,
            state,
        )

    def _timed(self, phase: str, function: Callable[..., Any], *arguments: Any) -> Any:
        began = time.perf_counter()
        try:
            return function(*arguments)
        finally:
            self.seconds[phase] = self.seconds.get(phase, 0.0) + time.perf_counter() - began


def _shrunk(model: QuadraticModel, step: ModelStep, actual: float) -> float:
    """The factor of a rejected step: minimiser of the parabola through both values and the slope,
    in [0.1, 0.5]."""
    slope = float(model.qp.g[: model.region.n] @ step.u)
    curvature = -actual - slope
    if not (np.isfinite(curvature) and curvature > 0):
        return 0.25
    return float(np.clip(-slope / (2 * curvature), 0.1, 0.5))


def _next_radius(radius: float, step: ModelStep, ratio: float) -> float:
    """The trust radius after an accepted step (Conn, Gould & Toint 2000, section 17.1)."""
    if ratio < 0.25:
        return 0.5 * min(step.length, radius)
    if ratio > 0.75:
        return max(radius, 2.5 * step.length)
    return radius
