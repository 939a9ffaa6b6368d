"""The assigned stage in rounds: other parts for the elements where the objective gains by them,
then the parts' SQP."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count

import numpy as np

from ..errors import SimulationFailure
from ..structures.opening import SAME_STATE
from .evaluation import DesignDerivatives, Evaluation, distance
from .events import ASSIGNED, SQPLabel
from .reassign import LocalModel, MoveParts, Reassignment, best_parts, keep_parts, reassign
from .stage_results import StageResult, combined
from .stages import Stages

log = logging.getLogger(__name__)

# How far the model reaches is known only after a trial, and a trial costs little next to an SQP:
# try several.
_DAMPINGS = (1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5)
_TRIALS = 3  # of a kind, those by which no element changes aside
# a design that ends above its prediction by this share of the promised gain keeps its parts at
# first
_MISLED = 0.1
# the SQP has to show what a trial is worth, unless J is larger than before by this factor
_PATIENCE = 1.1
_FAR_OFF = 2.0  # times J
_REPEATS = 4  # reassignments before an SQP
_BOLD = 0.01  # of the elements get other parts in a leap, at least
_BOLD_DAMPINGS = (*_DAMPINGS, 1e-6, 1e-7, 0.0)
AFTER_LEAP = 2  # rounds at most
# of J: another reassignment comes before the SQP while they lower it by this factor
_WORTHWHILE = 0.97

# what came of a reassignment, and the damping of its model
_Trial = tuple[StageResult, Reassignment, float]


def assigned_stage(
    stages: Stages,
    start: StageResult,
    numbers: Iterator[int] | None = None,
    leaps: int | None = None,
    seen: list[StageResult] | None = None,
) -> StageResult:
    """Reassign and optimise in turns until neither gains, from a state in which every element is
    its part; then leap.

    What the rounds end in is a local minimum, and there are many. A leap gives more elements other
    parts than the model can be trusted with, so that J rises at first; of where the rounds lead
    from there the better one is kept (iterated local search: Lourenço, Martin, Stützle 2003).

    numbers : of the rounds, where this isn't the first call: every SQP has a name of its own
    leaps : default: the settings'
    seen : gets the results on the way: where the best one has to be given up, one of them may do
    """
    settings = stages.settings
    if settings.reassignments == 0:
        label = ASSIGNED if numbers is None else SQPLabel.of_round(next(numbers))
        if not stages.optimises:
            return start
        return stages.best_confirmed(stages.assigned(start, label), start)
    rounds = _Rounds(stages, numbers or count(1), start.steps, [] if seen is None else seen)
    best = rounds.alternated(start, settings.reassignments)
    leaps = settings.leaps if leaps is None else leaps
    while leaps > 0 and best.value is not None:
        for trial in _bold_trials(stages, best)[:leaps]:
            leaps -= 1
            landed = rounds.alternated(rounds.landed(trial), AFTER_LEAP)
            log.info("a leap ends at J = %.5g, from %.5g", _value(landed), _value(best))
            if _value(landed) < _value(best):
                leaps = leaps if rounds.worthwhile(best, landed) else 0
                best = landed
                break
        else:
            break
    end = stages.best_confirmed(rounds.polished(best), best, start)
    return replace(end, steps=rounds.steps, jumps=start.jumps)


def further_rounds(
    stages: Stages,
    start: StageResult,
    numbers: Iterator[int],
    label: Callable[[int], SQPLabel] = SQPLabel.of_round,
    seen: list[StageResult] | None = None,
    optimised: bool = True,
) -> StageResult:
    """Reassigned and optimised in turns from where an SQP came to its end, with the rounds' own
    tolerances; not confirmed yet.

    In secured stages an SQP ends where one of the designs is about to open elsewhere; with other
    parts for some of its elements it often can go on.

    label : of the SQP of a number
    seen : gets the results on the way
    optimised : whether the parts are at their best already, for this assignment
    """
    if not stages.settings.reassignments or start.value is None:
        return start
    rounds = _Rounds(stages, numbers, start.steps, [] if seen is None else seen, label)
    best = rounds.alternated(start, stages.settings.reassignments, optimised)
    return replace(best, steps=rounds.steps, jumps=start.jumps)


@dataclass
class _Rounds:
    """Rounds with numbers, the steps of their SQPs (those of rounds that are undone included), and
    their results."""

    stages: Stages
    numbers: Iterator[int]
    steps: int
    seen: list[StageResult]
    label: Callable[[int], SQPLabel] = SQPLabel.of_round

    def alternated(self, best: StageResult, rounds: int, optimised: bool = False) -> StageResult:
        """Reassigned and optimised in so many rounds at most, as long as they gain.

        optimised : whether the parts are at their best already, for this assignment
        """
        for number in range(rounds):
            result = _many_reassigned(self.stages, best)
            if result is best and (number > 0 or optimised or not self.stages.optimises):
                break
            self.seen.append(result)
            result = self._optimised(result)
            self.seen.append(result)
            last, best = best, min((best, result), key=_value)
            if not self.worthwhile(last, best):
                break
        return best

    def worthwhile(self, last: StageResult, best: StageResult) -> bool:
        """Whether J fell by so much that another round may gain as well."""
        allowed = self.stages.settings.reassigned_tolerance
        return not np.isfinite(_value(last)) or _value(last) - _value(best) >= allowed * _value(
            last
        )

    def landed(self, trial: StageResult) -> StageResult:
        """The parts brought to a new assignment, roughly: the elements get other parts next."""
        return self._optimised(trial, (self.stages.settings.round_steps + 1) // 2)

    def polished(self, best: StageResult) -> StageResult:
        """The parts brought to the minimum, to the tolerance asked for."""
        settings = self.stages.settings
        result = self._optimised(best, settings.round_steps, settings.assigned_tolerance)
        return min((best, result), key=_value)

    def _optimised(
        self, result: StageResult, max_steps: int | None = None, tolerance: float | None = None
    ) -> StageResult:
        if not self.stages.optimises:
            return result
        settings = self.stages.settings
        result = self.stages.assigned(
            result,
            self.label(next(self.numbers)),
            max_steps or settings.round_steps,
            tolerance or settings.round_tolerance,
        )
        self.steps += result.steps
        return result


def _many_reassigned(stages: Stages, best: StageResult) -> StageResult:
    """Reassigned again and again while that alone gains: each time costs less than the SQP that
    follows."""
    for _ in range(_REPEATS):
        trial = _best_trial(stages, best)
        if trial is None:
            break
        enough = _value(trial) > _WORTHWHILE * _value(best)
        best = trial
        if enough:
            break
    return best


def _best_trial(stages: Stages, best: StageResult) -> StageResult | None:
    """The best of several reassignments, None where none is worth an SQP (with a fixed kit: none is
    better)."""
    if best.value is None:  # a design failed: there is no model of it
        return None
    derivatives = stages.dataset.derivatives(best.evaluations, hessian=True)
    trials = [_each_its_own(stages, best, derivatives)]
    if stages.rule.parts_move:
        trials += _together(stages, best, derivatives)
    found = [trial for trial in trials if trial is not None]
    for trial in sorted(found, key=_value):
        if _value(trial) >= _PATIENCE * _value(best):
            break
        if (kept := _kept(stages, best, trial)) is not None:
            return kept
    return None


def _kept(stages: Stages, best: StageResult, trial: StageResult) -> StageResult | None:
    """A trial as it is gone on from; None where that isn't possible.

    In secured stages it is opened. Designs that then don't open, or open elsewhere and lose by it,
    or that errors of the workshop make snap, stay as they were, where the parts do; that has to be
    better than before.
    """
    kept = stages.kept(trial)
    if kept.value is None:
        return None
    if not stages.dataset.requirements.opening:
        return kept
    lost = [
        n
        for n, (design, a, b) in enumerate(zip(stages.dataset.designs, kept.designs, trial.designs))
        if isinstance(a, Evaluation) and isinstance(b, Evaluation)
        if (design.way is not None and not a.way)
        or (distance(design, a, b) > SAME_STATE and stages.share(kept, n) > stages.share(best, n))
    ]
    if stages.dataset.requirements.samples:
        changed = [
            n
            for n, (a, b) in enumerate(zip(kept.evaluations, best.evaluations))
            if n not in lost and not np.array_equal(a.q, b.q)
        ]
        lost += stages.snapping(kept, changed)
    if not lost:
        return kept
    if not np.array_equal(trial.kit.vector, best.kit.vector):
        return None
    chosen = [best if n in lost else kept for n in range(len(best.designs))]
    found = stages.judged(combined(chosen, stages.dataset))
    return found if _value(found) < _value(best) else None


def _each_its_own(
    stages: Stages, best: StageResult, derivatives: Sequence[DesignDerivatives]
) -> StageResult | None:
    """With the parts as they are the designs don't depend on each other: each takes the best of its
    trials, if any."""
    trials = [trial for trial, _, _ in _several(stages, best, derivatives, keep_parts)]
    if stages.settings.reuse:  # but they do: which pieces are there already is the others' doing
        return min(trials, key=_value, default=None)
    results = [best, *trials]
    chosen = [
        min(results, key=lambda result: stages.share(result, n)) for n in range(len(best.designs))
    ]
    return (
        None
        if all(result is best for result in chosen)
        else stages.judged(combined(chosen, stages.dataset))
    )


def _together(
    stages: Stages, best: StageResult, derivatives: Sequence[DesignDerivatives]
) -> list[StageResult]:
    """Trials in which the parts move along; the best one also without the designs that the model
    was wrong about."""
    found = _several(stages, best, derivatives, best_parts)
    if found:
        trial, changed, damping = min(found, key=lambda t: _value(t[0]))
        misled = _misled(stages, best, trial, changed)
        if misled and len(misled) < len(best.designs):
            found += [t] if (t := _trial(stages, best, derivatives, damping, misled)) else []
    return [trial for trial, _, _ in found]


def _several(
    stages: Stages,
    best: StageResult,
    derivatives: Sequence[DesignDerivatives],
    move_parts: MoveParts,
) -> list[_Trial]:
    """The most cautious trials in which anything changes, up to one that is far off: bolder ones
    rarely are better."""
    found: list[_Trial] = []
    for damping in _DAMPINGS:
        trial = _trial(stages, best, derivatives, damping, (), move_parts)
        found += [trial] if trial is not None else []
        if (
            len(found) == _TRIALS
            or trial is not None
            and _value(trial[0]) > _FAR_OFF * _value(best)
        ):
            break
    return found


def _bold_trials(stages: Stages, best: StageResult) -> list[StageResult]:
    """Some trials in which many elements change, however J takes it; the best one first."""
    derivatives = stages.dataset.derivatives(best.evaluations, hessian=True)
    fewest = max(2.0, _BOLD * sum(design.n_elements for design in stages.dataset.designs))
    move_parts = best_parts if stages.rule.parts_move else keep_parts
    found: list[StageResult] = []
    for damping in _BOLD_DAMPINGS:
        trial = _trial(stages, best, derivatives, damping, (), move_parts)
        if trial is not None and trial[1].changes >= fewest and trial[0].value is not None:
            found.append(trial[0])
        if len(found) == _TRIALS:
            break
    confirmed = [stages.kept(trial) for trial in sorted(found, key=_value)]
    return [trial for trial in confirmed if trial.value is not None]


def _trial(
    stages: Stages,
    best: StageResult,
    derivatives: Sequence[DesignDerivatives],
    damping: float,
    frozen: Sequence[int] = (),
    move_parts: MoveParts = best_parts,
) -> _Trial | None:
    """The designs rebuilt of the parts that the model prefers; None where it prefers those that
    they have."""
    dataset = stages.dataset
    model = LocalModel.of(
        derivatives, dataset.design_weights, dataset.split(dataset.scales()), damping
    )
    model = replace(model, piece_cost=stages.piece_cost(best))
    found = reassign(
        stages.assigned_problem(best, range(len(best.designs))), model, frozen, move_parts
    )
    if found is None:
        return None
    # nobody looks for snaps here, and J tells what came of them
    path_steps = (stages.settings.path_steps + 1) // 2
    trial = stages.built_from(
        found.kit, found.assignment, best.evaluations, found.free, path_steps, watched=False
    )
    log.info(
        "other parts for %d elements (damping %g%s): J = %.5g, predicted %.5g",
        found.changes,
        damping,
        ", same parts" if move_parts is keep_parts else "",
        _value(trial),
        _value(best) + found.total,
    )
    return trial, found, damping


def _value(result: StageResult) -> float:
    return result.merit


def _misled(
    stages: Stages, best: StageResult, trial: StageResult, found: Reassignment
) -> list[int]:
    """The designs that the model was wrong about: those that ended far above what it promised."""
    allowed = _MISLED * abs(found.total)
    return [
        n
        for n, (old, new) in enumerate(zip(best.evaluations, trial.designs))
        if isinstance(new, SimulationFailure)
        or stages.share(trial, n) - stages.share(best, n) > found.predicted[n] + allowed
    ]
