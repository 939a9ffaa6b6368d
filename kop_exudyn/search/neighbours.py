"""From a kit to one with a part more or less of some kind: splitting and merging parts.

A split gives some of a part's elements a copy of it. Nothing changes at first, so that the larger
kit is never worse; then both may move apart. Which elements get the copy is told by the objective's
slope: those that want to go one way along its principal direction. A merge gives one part's
elements another part; those pairs are tried that cost least after Ward ("Hierarchical grouping to
optimize an objective function", J. American Statistical Association 58, 1963). Both are judged by
a quadratic model of the objective, with the assignment improved and the parts at its minimum
(reassign.py).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..kit.kinds import part_kind
from ..kit.parts import Assignment, Kit
from .problems import AssignedProblem
from .reassign import LocalModel, Reassignment, improved
from .stage_results import StageResult
from .stages import Stages

_DAMPING = 1e-3  # of the model; as that of moderate reassignments
_PAIRS = 6  # of parts whose merge is judged by the model


def resized(stages: Stages, result: StageResult, sizes: Mapping[str, int]) -> StageResult:
    """The designs of a result built from a kit of other sizes, part by part split or merged; not
    confirmed yet.

    result : in which every element is its part, and no design failed
    sizes : kind -> number of parts
    """
    for kind, size in sizes.items():
        while len(result.kit[kind]) != size:
            model = _model_at(stages, result)
            if len(result.kit[kind]) > size:
                found = merged(stages, model, result.kit, result.assignment, kind)
            else:
                found = split(stages, model, result.kit, result.assignment, kind)
            kit, assignment, free = (
                (*_with_copy(result, kind), None)
                if found is None
                else (found.kit, found.assignment, found.free)
            )
            built = stages.built_from(kit, assignment, result.evaluations, free)
            larger = len(kit[kind]) > len(result.kit[kind])
            if larger and found is not None and built.merit > result.merit:
                built = stages.built_from(*_with_copy(result, kind), result.evaluations)
            if built.value is None:
                return built
            result = built
    return result


def merged(
    stages: Stages, model: LocalModel, kit: Kit, assignment: Assignment, kind: str
) -> Reassignment | None:
    """The best kit with one part of a kind less; None where it has one only, or constraints can't
    be met."""
    parts = kit[kind]
    counts = assignment.pieces(kit)[kind]
    pairs = [(i, j) for i in range(len(parts)) for j in range(i + 1, len(parts))]

    def ward(pair: tuple[int, int]) -> float:
        i, j = pair
        weight = counts[i] * counts[j] / max(counts[i] + counts[j], 1)
        return float(weight * np.sum((parts[i] - parts[j]) ** 2))

    found = []
    for i, j in sorted(pairs, key=ward)[:_PAIRS]:
        total = max(counts[i] + counts[j], 1)
        mean = (counts[i] * parts[i] + counts[j] * parts[j]) / total if counts[i] else parts[j]
        rows = np.delete(np.where(np.arange(len(parts))[:, None] == i, mean, parts), j, axis=0)
        number = np.arange(len(parts))
        number[j] = i
        number = np.where(np.arange(len(parts)) > j, number - 1, number)
        fewer = Kit({**kit.parts, kind: rows}, kit.units)
        found.append(_judged(stages, model, fewer, _renumbered(assignment, kind, number)))
    return _best(found)


def split(
    stages: Stages, model: LocalModel, kit: Kit, assignment: Assignment, kind: str
) -> Reassignment | None:
    """The best kit with one part of a kind more; None where no part serves two elements that want
    different ones."""
    parts = kit[kind]
    wanted = _in_part_frames(assignment, kind, np.concatenate(model.gradients))
    found = []
    for i in range(len(parts)):
        own = [
            np.flatnonzero(part == i) if group.kind == kind else np.empty(0, dtype=int)
            for group, part in zip(assignment.groups, assignment.part)
        ]
        steps = np.concatenate([of[rows] for of, rows in zip(wanted, own)])
        if len(steps) < 2:
            continue
        centred = steps - steps.mean(axis=0)
        axis = np.linalg.svd(centred, full_matrices=False)[2][0]
        side = centred @ axis > 0
        if side.all() or not side.any():
            continue
        rows = np.concatenate([parts, parts[i : i + 1]])
        given = [part.copy() for part in assignment.part]
        first = 0
        for n, chosen in enumerate(own):
            given[n][chosen[side[first : first + len(chosen)]]] = len(parts)
            first += len(chosen)
        trial = Assignment(assignment.groups, tuple(given), assignment.variant, assignment.n_q)
        more = Kit({**kit.parts, kind: rows}, kit.units)
        found.append(_judged(stages, model, more, trial))
    return _best(found)


def _model_at(stages: Stages, result: StageResult) -> LocalModel:
    dataset = stages.dataset
    derivatives = dataset.derivatives(result.evaluations, hessian=True)
    scales = dataset.split(dataset.scales())
    return LocalModel.of(derivatives, dataset.design_weights, scales, _DAMPING)


def _judged(
    stages: Stages, model: LocalModel, kit: Kit, assignment: Assignment
) -> Reassignment | None:
    settings = stages.settings
    problem = AssignedProblem(
        stages.dataset,
        kit,
        assignment,
        settings.bounds,
        settings.constraints,
        costs=stages.costs,
    )
    return improved(problem, model)


def _best(found: list[Reassignment | None]) -> Reassignment | None:
    there = [one for one in found if one is not None]
    return min(there, key=lambda one: one.total) if there else None


def _with_copy(result: StageResult, kind: str) -> tuple[Kit, Assignment]:
    """The same kit with one part of a kind twice."""
    parts = result.kit[kind]
    kit = Kit({**result.kit.parts, kind: np.concatenate([parts, parts[-1:]])}, result.kit.units)
    return kit, result.assignment


def _renumbered(assignment: Assignment, kind: str, number: np.ndarray) -> Assignment:
    part = tuple(
        number[part] if group.kind == kind else part
        for group, part in zip(assignment.groups, assignment.part)
    )
    return Assignment(assignment.groups, part, assignment.variant, assignment.n_q)


def _in_part_frames(assignment: Assignment, kind: str, slope: np.ndarray) -> list[np.ndarray]:
    """By group (n, k_p): how the elements would move their parts, downhill; empty for other
    kinds."""
    found = []
    for group, variant in zip(assignment.groups, assignment.variant):
        if group.kind != kind or not len(group.indices):
            found.append(np.empty((0, part_kind(kind).n_parameters)))
            continue
        ways = part_kind(kind).variants_of(group.indices.shape[1]).matrices
        found.append(-np.einsum("nek,ne->nk", ways[variant], slope[group.indices]))
    return found
