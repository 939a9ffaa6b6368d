"""Steps that are taken once more where their end is not proved, minding what made it snap."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from . import demands
from .stage_results import StageResult
from .stages import Stages

log = logging.getLogger(__name__)

_AGAIN = 1  # times that steps are taken once more, at most


@dataclass(frozen=True)
class Minded:
    """Where steps led to.

    end : the first result that is proved to forgive, or the best one where none is
    stages : minding all sets of errors that made results snap
    proved : whether it forgives
    """

    end: StageResult
    stages: Stages
    proved: bool


def minded(
    stages: Stages,
    run: Callable[[Stages], StageResult],
    members: Sequence[int],
    seen: list[StageResult] | None = None,
) -> Minded:
    """Where steps lead to that mind the sets of errors that made designs snap where steps led to
    before.

    Few sets are tried at each step, so that steps come to where just these are forgiven. More of
    them would cost as much at every step; those that tell are few.

    run : takes the steps, always from the same result
    members : the designs that must not snap
    seen : gets the results
    """
    ends: list[StageResult] = []
    for again in range(_AGAIN + 1):
        ends.append(run(stages))
        if seen is not None:
            seen.append(ends[-1])
        # where distances are measured depends on the weights
        weighed = demands.secured(stages).weighed(ends[-1])
        lost = demands.unproved(stages, weighed, members) if weighed.value is not None else ()
        if not lost:
            return Minded(ends[-1], stages, True)
        if again < _AGAIN:
            names = [stages.dataset.designs[n].name for n in lost]
            log.info("in more sets of errors %s snap: once more, minding these", ", ".join(names))
            stages = demands.minding(stages, weighed, lost)
    return Minded(min(ends, key=lambda end: end.merit), stages, False)


def provable(stages: Stages, result: StageResult) -> list[int]:
    """The designs of a result that are proved to forgive: steps from there must not lose that."""
    doubtful = {*result.snapping, *demands.unproved(stages, result)}
    return [n for n in range(len(result.designs)) if n not in doubtful]
