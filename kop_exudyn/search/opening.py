"""The end of the assigned stage: designs that open into their shape by themselves."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import count

from .assigned import AFTER_LEAP, assigned_stage
from .forgiving import forgiving_stage, secured_steps, value_of
from .settings import StageSettings
from .stage_results import StageResult, all_same
from .stages import Stages

log = logging.getLogger(__name__)


def opened_stage(
    stages: Stages,
    start: StageResult,
    before: StageResult | None = None,
    numbers: Iterator[int] | None = None,
    last_resorts: bool = True,
    seen: Sequence[StageResult] = (),
    there: StageResult | None = None,
) -> StageResult:
    """Designs that open into their shape by themselves, and keep to it whatever errors of the
    workshop do: rounds from where they open into, again and again.

    The states of the assigned stage are led to from the relaxed ones, by ways that no builder goes:
    the search is freer so. Opened from its assembly, a design may end in another stable state; with
    rounds from there (but no leaps, which end in other states more often), the optimisation works
    on the states that a builder will find. Where they still aren't the same in the end, the best of
    these states are kept, and the parts optimised once more in secured steps. Then follows
    `forgiving_stage`.

    before : where the assigned stage began
    numbers : of the rounds, where this isn't the first call: every SQP has a name of its own
    last_resorts : see `forgiving_stage`
    seen : results on the way to `start`
    there : what `start` opens into, where that is known

    The result's states are those that the designs open into, unless one doesn't open at all.
    """
    settings = stages.settings
    result, numbers = start, numbers or count(_rounds_at_most(settings))
    if not stages.required.opening:
        return forgiving_stage(stages, start, seen, numbers, before, last_resorts)
    found: list[StageResult] = []
    on_the_way = list(seen)
    for number in range(settings.redeployments + 1):
        opened = stages.opened_by_itself(result) if there is None else there
        there = None
        log.info(
            "opened from the assembly: J = %.5g, from %.5g", value_of(opened), value_of(result)
        )
        same = opened.value is not None and all_same(stages.dataset.designs, result, opened)
        if opened.value is not None:
            found.append(opened)
        if same:  # and the states on the way are known with it
            result = opened
        if number == settings.redeployments or opened.value is None or same:
            break
        result = assigned_stage(stages, opened, numbers, leaps=0, seen=on_the_way)
    if not found:
        return start
    best = min(found, key=value_of)
    others = [other for other in found if other is not best] + on_the_way
    if best is not result:
        best = secured_steps(stages, best, numbers, forgiving=not stages.snapping(best))
    forgiving = forgiving_stage(stages, best, others, numbers, before, last_resorts)
    return replace(forgiving, jumps=start.jumps)


def _rounds_at_most(settings: StageSettings) -> int:
    """How many rounds the assigned stage may have had before its designs are opened."""
    return 2 + settings.reassignments + settings.leaps * (1 + AFTER_LEAP)
