"""Designs made of the same parts otherwise.

With the parts as they are, designs don't depend on each other, and each has many local minima:
other parts for some of its elements, about as good. What is asked for beyond J tells them apart: a
design that snaps, or that is far off, often has another way that neither snaps nor is far off.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from . import demands
from .evaluation import DesignDerivatives, Evaluation
from .reassign import LocalModel, Reassignment, improved, keep_parts
from .shaking import shaken
from .stage_results import StageResult, combined
from .stages import Stages

log = logging.getLogger(__name__)

NEAR = 1.5  # times J: results above that are no substitute
# ways to make a design that are looked for: the share of its elements that get any other parts
# first, and the damping of the model that the others follow
_OTHERWISE = (((0.01, 1e-2),) * 12, ((0.03, 1e-2),) * 12)
_BETTER = tuple((share, damping) for damping in (1e-2, 1e-3) for share in (0.01, 0.03)) * 6
_OPENED = 6  # of those that are to be better, at most
_LEAST = 0.02  # of its value, by which a design has to gain


def made_otherwise(
    stages: Stages, result: StageResult, lost: Sequence[int], dear: bool = False
) -> tuple[StageResult, tuple[int, ...]]:
    """The result with other parts, of the same kit, for the elements of designs that snap; and the
    designs that still do.

    Some of a design's elements get any other parts, and then all those that the model prefers:
    another local minimum, of which there are many. Each is opened and tried with errors. A design
    may cost half more than it did, or half of a design's mean share more.

    lost : the designs that snap
    dear : where nothing else forgives, J may rise by a half for a design alone
    """
    still = tuple(lost)
    if not _free_to_choose(stages):
        return result, still
    derivatives = _Derivatives(stages)
    for n in lost:
        found = _forgiving(stages, result, n, derivatives, dear)
        if found is not None:
            log.info(
                "%s made of other parts forgives: J = %.5g, from %.5g",
                stages.dataset.designs[n].name,
                found.merit,
                result.merit,
            )
            result = replace(found, steps=result.steps, status=result.status)
            still = tuple(k for k in still if k != n)
    return result, still


def _forgiving(
    stages: Stages, result: StageResult, n: int, derivatives: _Derivatives, dear: bool
) -> StageResult | None:
    """The result with a design made otherwise that forgives, in the sets of errors that prove it as
    well if there is one; None where none is found."""
    rng = np.random.default_rng([stages.settings.seed, n])
    values = [stages.share(result, k) for k in range(len(result.designs))]
    most = values[n] + (NEAR - 1) * result.merit
    usual = min(most, values[n] + (NEAR - 1) * max(values[n], float(np.mean(values))))
    last: StageResult | None = None
    for tries in _OTHERWISE:
        for opened in _opened(stages, result, n, _ways(stages, result, n, derivatives, rng, tries)):
            value = stages.share(opened, n)
            dearer = value > usual
            if value > most or dearer and (not dear or last is not None):
                continue
            if n in stages.snapping(opened, [n]):
                continue
            if not dearer and not demands.unproved(stages, opened, [n]):
                return opened
            if last is None or stages.share(last, n) > usual >= value:
                last = opened
    return last


def made_better(stages: Stages, result: StageResult, far: Sequence[int], seed: int) -> StageResult:
    """The result with other parts, of the same kit, for the elements of designs that are far off.

    Of several local minima that one is gone on from which is best, opens and forgives.

    far : these designs
    seed : of what is tried
    """
    if not _free_to_choose(stages):
        return result
    derivatives = _Derivatives(stages)
    for n in far:
        rng = np.random.default_rng([stages.settings.seed, seed, n])
        before = stages.share(result, n)
        limit = (1 - _LEAST) * before
        ways = _ways(stages, result, n, derivatives, rng, _BETTER)
        for opened in _opened(stages, result, n, ways, _OPENED, limit):
            value = stages.share(opened, n)
            if value <= limit and n not in stages.snapping(opened, [n]):
                log.info(
                    "%s made of other parts: %.5g, from %.5g",
                    stages.dataset.designs[n].name,
                    value,
                    before,
                )
                result = replace(opened, steps=result.steps, status=result.status)
                break
    return result


class _Derivatives:
    """Of the designs of results that follow each other: found once for as long as a design stays as
    it is."""

    def __init__(self, stages: Stages):
        self._stages = stages
        self._known: dict[int, tuple[Evaluation, DesignDerivatives]] = {}

    def of(self, result: StageResult) -> list[DesignDerivatives]:
        """With the Hessians, of all designs."""
        new = {
            n: evaluation
            for n, evaluation in enumerate(result.evaluations)
            if n not in self._known or self._known[n][0] is not evaluation
        }
        changed = self._stages.dataset.subset(list(new))
        found = changed.derivatives(list(new.values()), hessian=True)
        self._known |= {n: (new[n], derivatives) for n, derivatives in zip(new, found)}
        return [self._known[n][1] for n in range(len(result.designs))]


def _free_to_choose(stages: Stages) -> bool:
    """Whether elements may take any part of the kit: not so where a user's constraints hold for
    them, which other parts would break."""
    return (
        stages.rule.stock is None
        and stages.settings.constraints is None
        and not len(stages.dataset.sliding)
    )


def _ways(
    stages: Stages,
    result: StageResult,
    n: int,
    derivatives: _Derivatives,
    rng: np.random.Generator,
    tries: Sequence[tuple[float, float]],
) -> list[Reassignment]:
    """Local minima of a design's model over its elements' parts, those that differ.

    tries : for each, the share of the elements that is shaken first, and the model's damping
    """
    dataset = stages.dataset
    members = range(len(result.designs))
    scales = dataset.split(dataset.scales())
    own = [g for g, design in enumerate(dataset.group_designs) if design == n]
    others = [k for k in members if k != n]
    problem = stages.assigned_problem(result, members)
    found: list[Reassignment] = []
    models = {
        damping: LocalModel.of(derivatives.of(result), dataset.design_weights, scales, damping)
        for damping in {damping for _, damping in tries}
    }
    for share, damping in tries:
        start = shaken(result.assignment, result.kit, rng, own, share)
        way = improved(problem.reassigned(start), models[damping], others, keep_parts)
        if way is None or not way.assignment.changes(result.assignment):
            continue
        if all(way.assignment.changes(other.assignment) for other in found):
            found.append(way)
    return found


def _opened(
    stages: Stages,
    result: StageResult,
    n: int,
    ways: Sequence[Reassignment],
    most: int | None = None,
    limit: float = np.inf,
) -> Iterator[StageResult]:
    """The result with a design made in these ways and opened, in the order of its value where it is
    led there.

    most : so many at most;  limit : of that value
    """
    steps = (stages.settings.path_steps + 1) // 2
    led = []
    for way in ways:
        trial = stages.built_from(
            way.kit, way.assignment, result.evaluations, way.free, steps, watched=False
        )
        if isinstance(trial.designs[n], Evaluation) and stages.share(trial, n) <= limit:
            led.append(trial)
    led.sort(key=lambda trial: stages.share(trial, n))
    for trial in led[:most]:
        chosen = [trial if k == n else result for k in range(len(result.designs))]
        opened = demands.secured(stages).kept(stages.judged(combined(chosen, stages.dataset)))
        if opened.value is not None:
            yield opened
