"""The last search of the assigned stage: one or two elements get other parts, and the parts are
optimised again before that is judged.

Reassignment under the model (reassign.py) changes an element only where it gains with the parts as
they are, one element after the other. Assignments that pay only once the parts have followed, or
only together with a second element's change, are never seen by it. Here these are ranked by the
model's minimum over the parts, and the best of them are built and optimised; what ends lower is
gone on from.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ..kit.kinds import has_joint, part_kind
from ..kit.parts import Assignment
from .reassign import LocalModel, best_parts
from .settings import EFFORTS
from .sliding import best_in_boxes
from .stage_results import StageResult
from .stages import Stages

log = logging.getLogger(__name__)

_DAMPING = 1e-4  # of the model
_SINGLES = 120  # changes of one element whose parts are solved for, those that promise most
_PAIRED = 24  # of them that are also tried two at a time
_HOPELESS = 3.0  # times J as built: not optimised
_GAIN = 1e-6  # of J, that counts

# group of elements, element in it, its new part and variant
_Change = tuple[int, int, int, int]


@dataclass(frozen=True)
class _Neighbour:
    """Another assignment and the parameters (n_p + k,) that the model prefers with it."""

    assignment: Assignment
    vector: np.ndarray
    predicted: float


def exchanged(
    stages: Stages,
    best: StageResult,
    optimised: Callable[[StageResult], StageResult],
) -> StageResult:
    """The best that exchanges lead to from a result in which every element is its part.

    optimised : brings a result's parts to their minimum

    How many assignments are built from each result is the effort's `exchanges`; none twice. Returns
    `best` where no exchange ends lower, or a design of it failed.
    """
    trials = EFFORTS[stages.settings.effort].exchanges
    seen = {_key(best)}
    steps = best.steps
    gained = trials > 0 and stages.rule.parts_move and stages.rule.stock is None
    while gained and best.value is not None:
        gained = False
        for result in _built(stages, best, seen, trials):
            end = optimised(result)
            steps += end.steps
            log.info("an exchange ends at J = %s, from %s", end.value, best.value)
            if end.value is not None and end.merit < best.merit * (1 - _GAIN):
                best, gained = end, True
                break
    return replace(best, steps=steps)


def _built(
    stages: Stages, best: StageResult, seen: set[bytes], trials: int
) -> Iterator[StageResult]:
    """Designs built of the neighbours that promise most, as many as `trials`; those that aren't
    hopeless."""
    dataset = stages.dataset
    derivatives = dataset.derivatives(best.evaluations, hessian=True)
    scales = dataset.split(dataset.scales())
    model = LocalModel.of(derivatives, dataset.design_weights, scales, _DAMPING)
    problem = stages.assigned_problem(best, range(len(best.designs)))
    number = 0
    for neighbour in _neighbours(stages, best, model):
        at = problem.reassigned(neighbour.assignment)
        kit, free = at.kit_of(neighbour.vector), at.free_of(neighbour.vector)
        key = _key(replace(best, kit=kit, assignment=neighbour.assignment))
        if key in seen:
            continue
        seen.add(key)
        number += 1
        built = stages.built_from(kit, neighbour.assignment, best.evaluations, free, watched=False)
        if built.value is not None and built.merit <= _HOPELESS * best.merit:
            kept = stages.kept(built)
            if kept.value is not None:
                yield kept
        if number == trials:
            return


def _neighbours(stages: Stages, best: StageResult, model: LocalModel) -> list[_Neighbour]:
    """Assignments that differ by one or two elements, the most promising first."""
    problem = stages.assigned_problem(best, range(len(best.designs)))
    start = problem.variables(np.concatenate(model.base))

    def judged(changes: list[_Change]) -> _Neighbour | None:
        assignment = _with(best.assignment, changes)
        changed = problem.reassigned(assignment)
        vector = best_parts(changed, start, model)
        if vector is None:
            return None
        values = model.values(problem.dataset.split(changed.matrix @ vector))
        return _Neighbour(assignment, vector, float(values.sum()) + changed.cost(vector))

    changes = _changes(best, model, stages)[:_SINGLES]
    singles = [(one, change) for change in changes if (one := judged([change])) is not None]
    singles.sort(key=lambda pair: pair[0].predicted)
    pairs = [
        judged([a, b]) for (_, a), (_, b) in combinations(singles[:_PAIRED], 2) if a[:2] != b[:2]
    ]
    found = [one for one, _ in singles] + [pair for pair in pairs if pair is not None]
    return sorted(found, key=lambda one: one.predicted)


def _changes(best: StageResult, model: LocalModel, stages: Stages) -> list[_Change]:
    """All changes of one element's part or variant, in the order of what the model says with the
    parts as they are."""
    offsets, design_of = stages.dataset.offsets, stages.dataset.group_designs
    slopes = model.slopes(model.base)
    found: list[tuple[float, _Change]] = []
    for g, group in enumerate(best.assignment.groups):
        if not len(group.indices):
            continue
        ways = part_kind(group.kind).variants_of(group.indices.shape[1])
        n = int(design_of[g])
        candidates = np.einsum("vek,mk->mve", ways.matrices, best.kit[group.kind])
        m, n_ways, k = candidates.shape
        candidates = candidates.reshape(-1, k)
        if ways.reach is not None:
            width = np.einsum("vek,mk->mve", ways.reach, best.kit[group.kind]).reshape(-1, k)
        chosen = best.assignment.part[g] * n_ways + best.assignment.variant[g]
        for e, own in enumerate(group.indices - offsets[n]):
            d = candidates - model.base[n][own]
            block = model.hessians[n][np.ix_(own, own)]
            if ways.reach is not None:
                _, gains = best_in_boxes(d, d + width, slopes[n][own], block)
            else:
                gains = d @ slopes[n][own] + 0.5 * np.einsum("ci,ij,cj->c", d, block, d)
            found += [
                (float(gains[c]), (g, e, c // n_ways, c % n_ways))
                for c in range(m * n_ways)
                if c != chosen[e]
            ]
    return [change for _, change in sorted(found)]


def _with(assignment: Assignment, changes: list[_Change]) -> Assignment:
    parts, variants = (
        [array.copy() for array in arrays] for arrays in (assignment.part, assignment.variant)
    )
    for g, e, part, variant in changes:
        parts[g][e], variants[g][e] = part, variant
    return replace(assignment, part=tuple(parts), variant=tuple(variants))


def _key(result: StageResult) -> bytes:
    """Which elements are made of one part, and how they are turned against each other: the same
    for assignments that differ by the parts' numbers, or by which end of a beam is its first."""
    names: dict[tuple[str, int], tuple[int, int]] = {}
    found: list[int] = []
    for group, part, variant in zip(
        result.assignment.groups, result.assignment.part, result.assignment.variant
    ):
        turns = has_joint(part_kind(group.kind))
        for p, v in zip(part.tolist(), variant.tolist()):
            name, first = names.setdefault((group.kind, p), (len(names), v if turns else 0))
            found += [name, v ^ first]
    return np.array(found, np.int32).tobytes()
