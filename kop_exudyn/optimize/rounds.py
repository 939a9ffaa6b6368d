"""The assigned stage in rounds: other parts for the elements where the objective gains by them, then the parts' SQP."""
from __future__ import annotations

import logging
from dataclasses import replace
from typing import Sequence

import numpy as np

from ..errors import SimulationFailure
from .objective import DesignDerivatives
from .reassign import LocalModel, Reassignment, reassign
from .stages import StageResult, Stages

log = logging.getLogger(__name__)

# How far the model reaches is known only after a trial, and a trial costs little next to an SQP: try several.
_DAMPINGS = (1e-1, 1e-2, 1e-3, 1e-4)
_MISLED = 0.1  # a design that ends above its prediction by this share of the promised gain keeps its parts at first
_PATIENCE = 1.1  # the SQP has to show what a trial is worth, unless J is larger than before by this factor


def in_rounds(stages: Stages, start: StageResult, fixed_kit: bool = False) -> StageResult:
    """Reassign and optimise in turns until neither gains, from a state in which every element is its part.

    fixed_kit : keep the parts (projection onto an existing kit), only the assignment changes
    """
    settings, best = stages.settings, start
    if settings.reassignments == 0:
        return start if fixed_kit else stages.assigned(start)
    for number in range(1, settings.reassignments + 1):
        trial = _best_trial(stages, best, fixed_kit)
        if trial is None and number > 1:
            break
        result = trial or best
        if not fixed_kit:
            result = stages.assigned(result, f"assigned-{number}", settings.round_steps)
        steps = best.steps + result.steps
        better = best.value is None or result.value is not None and result.value < best.value
        gain = np.inf if best.value is None or result.value is None else best.value - result.value
        best = replace(result if better else best, steps=steps, jumps=start.jumps)
        if gain < settings.reassigned_tolerance * abs(best.value or 0.0):
            break
    return best


def _best_trial(stages: Stages, best: StageResult, fixed_kit: bool) -> StageResult | None:
    """The best of several reassignments, None where none is worth an SQP (with a fixed kit: none is better)."""
    if best.value is None:  # a design failed: there is no model of it
        return None
    derivatives = stages.dataset.derivatives(best.designs, hessian=True)
    tried = [t for t in (_trial(stages, best, derivatives, damping, (), fixed_kit) for damping in _DAMPINGS) if t]
    if not tried:
        return None
    trial, found, damping = min(tried, key=lambda t: _value(t[0]))
    misled = _misled(stages, best, trial, found)
    if misled and len(misled) < len(best.designs):
        careful = _trial(stages, best, derivatives, damping, misled, fixed_kit)
        trial = min((trial, careful[0]), key=_value) if careful else trial
    if _value(trial) >= (1.0 if fixed_kit else _PATIENCE) * best.value:
        return None
    trial = stages.confirmed(trial)
    return trial if trial.value is not None else None


def _trial(stages: Stages, best: StageResult, derivatives: Sequence[DesignDerivatives], damping: float,
           frozen: Sequence[int], fixed_kit: bool) -> tuple[StageResult, Reassignment, float] | None:
    """The designs rebuilt of the parts that the model prefers; None where it prefers those that they have."""
    dataset = stages.dataset
    model = LocalModel.of(derivatives, dataset.design_weights, dataset.split(dataset.scales()), damping)
    found = reassign(stages.assigned_problem(best, range(len(best.designs))), model, frozen, fixed_kit)
    if found is None:
        return None
    trial = stages.built_from(found.kit, found.assignment, best.designs)
    log.info("other parts for %d elements (damping %g): J = %.5g, predicted %.5g", found.changes, damping,
             _value(trial), best.value + found.predicted.sum())
    return trial, found, damping


def _value(result: StageResult) -> float:
    return np.inf if result.value is None else result.value


def _misled(stages: Stages, best: StageResult, trial: StageResult, found: Reassignment) -> list[int]:
    """The designs that the model was wrong about: those that ended far above what it promised."""
    allowed = _MISLED * abs(found.predicted.sum())
    weights = stages.dataset.design_weights
    return [n for n, (old, new) in enumerate(zip(best.designs, trial.designs))
            if isinstance(new, SimulationFailure) or weights[n] * (new.value - old.value) > found.predicted[n] + allowed]
