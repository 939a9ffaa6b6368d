"""Kits whose designs keep to their shape whatever errors of the workshop do.

A design that snaps when its elements are a little off has other stable states near the one that is
wanted. Kits of nearly the same J differ in that, and nothing in J tells it: what helps is another
kit that is about as good, or another way to make the design of the same one.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import replace

from . import demands
from .assigned import further_rounds
from .events import SQPLabel
from .minding import minded, provable
from .remaking import NEAR, made_otherwise
from .stage_results import StageResult, all_same
from .stages import Stages

log = logging.getLogger(__name__)

# times the weights of stress and energy, where a design snaps
_CALMER = (3.0, 10.0, 30.0)
# times J: where what was found is above that, the last resorts are tried as well. A quarter of J is
# an eighth of the deviations' mean, and less than what levelling costs
DEAR = 1.25
_LOOKED_AT = 12  # results on the way, at most


def forgiving_stage(
    stages: Stages,
    best: StageResult,
    others: Sequence[StageResult],
    numbers: Iterator[int],
    before: StageResult | None = None,
    last_resorts: bool = True,
) -> StageResult:
    """A result whose designs keep to their shape whatever errors of the workshop do; `best` where
    they do, or where nothing else is found.

    others : results that were found on the way to the best one; those are looked at that aren't
        far above it
    numbers : of the SQPs that follow
    before : where the assigned stage began, which is gone back to where nothing else helps
    last_resorts : whether more is tried than the others

    A design that snaps is a point that should not have been accepted. The first of the others that
    forgives is the next best point. Last resorts: the designs that snap are made of the same parts
    otherwise (see `made_otherwise`); the parts are optimised with more weight on stress and energy,
    and from there again with the weights asked for, in steps that keep to what was won.
    """
    lost = stages.snapping(best)
    if not lost:
        return best
    names = [stages.dataset.designs[n].name for n in lost]
    log.info("errors of the workshop make %s snap", ", ".join(names))
    found: list[StageResult] = []
    if (other := substitute(stages, best, others)) is not None:
        found.append(secured_steps(stages, other, numbers, forgiving=True))
    mended, still = best, lost
    if not found and last_resorts:
        mended, still = made_otherwise(stages, best, lost, dear=True)
        if not still:
            found.append(secured_steps(stages, mended, numbers, forgiving=True))
    steps = best.steps

    def more_to_try() -> bool:
        dear = DEAR * value_of(best)
        return last_resorts and all(value_of(one) > dear for one in found)

    for factor in _CALMER if stages.optimises and more_to_try() else ():
        calmer = demands.calmer(stages, factor)
        trial = calmer.assigned(calmer.weighed(best), SQPLabel.of_round(next(numbers)))
        steps += trial.steps
        if stages.required.opening:
            opened = stages.opened_by_itself(trial)
        else:
            opened = stages.weighed(trial)
        if opened.value is not None and not stages.snapping(opened):
            found.append(secured_steps(stages, opened, numbers, forgiving=True))
            break
    if before is not None and more_to_try():
        first = demands.secured(stages).kept(before)
        if first.value is not None and not stages.snapping(first):
            found.append(secured_steps(stages, first, numbers, forgiving=True))
    if not found:
        return replace(mended, steps=steps, snapping=still)
    won = min(found, key=value_of)
    log.info("they keep to their shapes at J = %.5g, from %.5g", value_of(won), value_of(best))
    return replace(won, steps=max(steps, won.steps))


def proven(stages: Stages, result: StageResult) -> StageResult:
    """A result that forgives, tried with more sets of errors; designs that snap in one of them are
    made of the same parts otherwise, where that helps."""
    if result.value is None:
        return result
    lost = demands.unproved(stages, result)
    if not lost:
        return replace(result, snapping=()) if result.snapping else result
    names = [stages.dataset.designs[n].name for n in lost]
    log.info("in more sets of errors %s snap", ", ".join(names))
    mended, still = made_otherwise(stages, result, lost, dear=True)
    return result if mended is result else replace(mended, snapping=still)


def substitute(
    stages: Stages, best: StageResult, others: Sequence[StageResult]
) -> StageResult | None:
    """The best of other results that opens into about as good states and forgives; None without
    one."""
    limit = NEAR * value_of(best)
    near = sorted((other for other in others if value_of(other) <= limit), key=value_of)
    for number, other in enumerate(near[:_LOOKED_AT]):
        opened = demands.secured(stages).kept(other)
        if value_of(opened) > limit or stages.snapping(opened):
            continue
        log.info("the result on the way number %d forgives, at J = %.5g", number, value_of(opened))
        return opened
    return None


def secured_steps(
    stages: Stages, best: StageResult, numbers: Iterator[int], forgiving: bool
) -> StageResult:
    """Designs in the states that they open into, with the parts optimised once more in steps that
    keep every design on the branch along which it opens, and forgiving if it is that; as they were
    where that gains nothing, or gains little that can't be proved any more. Where the way on is
    blocked, rounds of reassignments follow."""
    best = demands.secured(stages).kept(best)
    if not stages.optimises or best.value is None:
        return best

    def steps(minding: Stages) -> StageResult:
        secured = demands.secured(minding, forgiving=forgiving)
        found = secured.assigned(best, SQPLabel.of_round(next(numbers)))
        return further_rounds(secured, found, numbers) if found.blocked else found

    if forgiving:
        tried = minded(stages, steps, provable(stages, best))
        found = tried.end
        worth = tried.proved or DEAR * value_of(found) < value_of(best)
    else:
        found, worth = steps(stages), True
    opened = replace(found, designs=demands.secured(stages).redeployed(found))
    same = found.value is not None and all_same(stages.dataset.designs, found, opened)
    return replace(found, steps=best.steps + found.steps) if same and worth else best


def value_of(result: StageResult) -> float:
    """What results are compared by."""
    return result.merit
