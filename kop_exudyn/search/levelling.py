"""The last tuning of the parts: the largest deviation brought down.

J has the mean square of the joints' distances from the target, summed over the designs. A single
joint that is far off hardly counts there, and yet it is what is seen. Here distances d beyond a
level s count with their fourth power, d^2 (1 + d^2 / (2 s^2)): as in a p-norm the largest tell,
and it is smooth, with exact gradients. Steps keep every design on the branch along which it opens,
and forgiving; so do the reassignments that follow where a design is still far off.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import replace

from . import demands
from .assigned import further_rounds
from .evaluation import Evaluation
from .events import SQPLabel
from .minding import minded, provable
from .remaking import made_better, made_otherwise
from .stage_results import StageResult, all_same
from .stages import Stages

log = logging.getLogger(__name__)

_LOOKED_AT = 6  # results on the way, at most
_MENDED = 1  # of these, the best ones: designs that snap are made otherwise
_REMAKINGS = 3  # rounds in which designs that are far off are made of other parts, at most
_FELT = 5.0  # times the level: where the largest deviation is beyond that, other parts are tried


def level(stages: Stages, result: StageResult, numbers: Iterator[int]) -> StageResult:
    """The result with parts whose largest deviation is smaller, at some cost in J; the same one
    where none are found.

    What is gained is not paid for by what is required: bounds are exceeded by no more than before,
    every design opens into the state that is reported, and no other designs snap, in more sets of
    errors than the steps were tried with.

    numbers : of the SQPs
    """
    share = stages.settings.levelling
    if not share or not stages.optimises or result.value is None:
        return result
    before = stages.confirmed(result)  # and placed best
    settings = stages.settings
    secured = demands.secured(stages, forgiving=True, but=result.snapping)
    own = demands.levelled(secured, share)
    start = own.kept(own.weighed(result))
    if start.value is None:
        return result
    ends: list[StageResult] = []

    def levelled(minding: Stages) -> Stages:
        kept = demands.secured(minding, forgiving=True, but=result.snapping)
        return demands.levelled(kept, share)

    def stepped(minding: Stages) -> StageResult:
        label = SQPLabel.of_levelling(next(numbers))
        return levelled(minding).assigned(
            start, label, settings.round_steps, settings.round_tolerance
        )

    members = provable(stages, before)  # what isn't proved now needn't be then
    first = minded(stages, stepped, members, ends)
    end = first.end
    steps, felt = result.steps + end.steps, 100 * _FELT * share
    if worst(end.designs) > felt:
        careful = levelled(demands.careful(first.stages))
        last = further_rounds(careful, end, numbers, SQPLabel.of_levelling, ends)
        ends.append(last)
        for number in range(_REMAKINGS):
            far = _far(last, felt)
            better = made_better(careful, last, far, number) if far else last
            if better is last:
                break
            ends.append(better)
            last = further_rounds(
                careful, better, numbers, SQPLabel.of_levelling, ends, optimised=False
            )
            ends.append(last)
        steps = result.steps + last.steps
    for k, trial in enumerate(sorted(ends, key=lambda one: worst(one.designs))[:_LOOKED_AT]):
        found = proved(stages, secured.weighed(trial), before, members, mended=k < _MENDED)
        if found is not None:
            log.info(
                "largest deviation %.3g %%, from %.3g %%, at J = %.5g, from %.5g",
                worst(found.designs),
                worst(before.designs),
                found.value,
                result.value,
            )
            return replace(found, steps=steps, jumps=result.jumps)
    return replace(result, steps=steps)


def _far(result: StageResult, felt: float) -> list[int]:
    """The designs of which a joint is farther off than is felt, %, the worst first."""
    off = {
        n: design.fit.max_percent
        for n, design in enumerate(result.designs)
        if isinstance(design, Evaluation) and design.fit.max_percent > felt
    }
    return sorted(off, key=lambda n: -off[n])


def proved(
    stages: Stages,
    found: StageResult,
    before: StageResult,
    members: Sequence[int] | None = None,
    mended: bool = True,
) -> StageResult | None:
    """A result that is better than before and makes no other designs snap, in more sets of errors
    than steps are tried with. None where there is none.

    members : the designs that this is asked of; default: those that don't snap before
    mended : whether designs that do snap are made of the same parts otherwise, which need forgive
        no more than steps have to: whether an end is proved is asked once more of the whole search
    """
    if found.value is None or not _better(stages, found, before):
        return None
    if members is None:
        members = [n for n in range(len(found.designs)) if n not in before.snapping]
    if lost := demands.unproved(stages, found, members):
        if not mended:
            return None
        found, still = made_otherwise(stages, found, lost)
        if still or not _better(stages, found, before):
            return None
    return replace(found, snapping=before.snapping)


def worst(designs: Sequence[object]) -> float:
    """The largest deviation of designs, % of their sizes; those that failed left out."""
    return max((d.fit.max_percent for d in designs if isinstance(d, Evaluation)), default=0.0)


def _better(stages: Stages, found: StageResult, before: StageResult) -> bool:
    """Whether the largest deviation fell, bounds are exceeded by no more, and the designs open into
    where they are."""
    if worst(found.designs) >= worst(before.designs) or found.penalty > before.penalty:
        return False
    if not stages.required.opening:
        return True
    opened = replace(found, designs=stages.redeployed(found))
    return all_same(stages.dataset.designs, found, opened)
