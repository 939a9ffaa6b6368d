"""Starts for the assigned stage, found under a quadratic model of the objective alone.

Clustering sees an element by its distance to a part. The designs' objective, however, hardly
changes along most directions, and a kit that follows these is better than the nearest one. Under a
quadratic model at designs that are known (the inputs, the relaxed ones), assignments cost nothing
but linear algebra: from several clusterings they are improved (reassign.py), shaken and improved
again (iterated local search: Lourenço, Martin and Stützle 2003), and the best of them are built.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..kit.cluster import cluster
from ..kit.kinds import part_kind
from ..kit.parts import Assignment, Kit
from .objective import Evaluation
from .problems import AssignedProblem
from .reassign import LocalModel, Reassignment, improved
from .stage_results import StageResult
from .stages import Stages

log = logging.getLogger(__name__)

_DAMPINGS = (1e-3, 1e-5)  # of the models
_SHAKEN = 0.05  # of the elements get any other part, at least two
_SAME = 1e-6  # relative; starts whose predictions are that close are one


@dataclass(frozen=True)
class StartOptions:
    """How many starts are looked for.

    clusterings : seeds that each model's search begins with
    shakes : of each
    built : starts of each model that are built
    """

    clusterings: int = 6
    shakes: int = 20
    built: int = 3


def model_starts(
    stages: Stages, bases: Sequence[Sequence[Evaluation]], options: StartOptions
) -> list[StageResult]:
    """Designs built of kits that quadratic models at the bases prefer; not confirmed yet, in the
    order of J. Those of which a design failed are left out.

    bases : evaluations of all designs, one list a base
    """
    found: list[StageResult] = []
    for base in bases:
        derivatives = stages.dataset.derivatives(list(base), hessian=True)
        confirmed = [d.evaluation for d in derivatives]
        for damping in _DAMPINGS:
            model = LocalModel.of(
                derivatives,
                stages.dataset.design_weights,
                stages.dataset.split(stages.dataset.scales()),
                damping,
            )
            for start in _best_under(stages, model, options):
                built = stages.built_from(
                    start.kit, start.assignment, confirmed, start.free,
                    (stages.settings.path_steps + 1) // 2,
                )  # fmt: skip
                log.info(
                    "a start under the model (damping %g): J = %s, predicted %.5g",
                    damping,
                    built.value,
                    sum(e.value for e in confirmed) + start.predicted.sum(),
                )
                found.append(built)
    whole = [built for built in found if built.value is not None]
    return sorted(whole, key=lambda built: built.value or 0.0)


def _best_under(stages: Stages, model: LocalModel, options: StartOptions) -> list[Reassignment]:
    """The best kits under one model that differ, by iterated local search from some clusterings."""
    settings, dataset = stages.settings, stages.dataset
    q = np.concatenate(model.base)
    ends: list[Reassignment] = []
    for number in range(options.clusterings):
        rng = np.random.default_rng([settings.seed, number])
        first = cluster(
            dataset.groups,
            q,
            stages.rule.sizes,
            bounds=settings.bounds,
            restarts=1,
            seed=settings.seed + number,
        )
        best = _improved(stages, model, first.kit, first.assignment)
        for _ in range(options.shakes):
            if best is None:
                break
            shaken = _shaken(best.assignment, best.kit, rng)
            trial = _improved(stages, model, best.kit, shaken)
            if trial is not None and trial.predicted.sum() < best.predicted.sum():
                best = trial
        ends += [best] if best is not None else []
    ends.sort(key=lambda end: float(end.predicted.sum()))
    kept: list[Reassignment] = []
    for end in ends:
        value, values = end.predicted.sum(), [k.predicted.sum() for k in kept]
        if all(abs(value - other) > _SAME * abs(other) for other in values):
            kept.append(end)
    return kept[: options.built]


def _improved(
    stages: Stages, model: LocalModel, kit: Kit, assignment: Assignment
) -> Reassignment | None:
    problem = AssignedProblem(
        stages.dataset, kit, assignment, stages.settings.bounds, stages.settings.constraints
    )
    return improved(problem, model)


def _shaken(assignment: Assignment, kit: Kit, rng: np.random.Generator) -> Assignment:
    """Some elements with any other part, in any variant."""
    n = sum(len(part) for part in assignment.part)
    wanted = max(2, round(_SHAKEN * n))
    parts, variants = (
        [a.copy() for a in arrays] for arrays in (assignment.part, assignment.variant)
    )
    sizes = np.array([len(part) for part in parts])
    ends = np.cumsum(sizes)
    for element in rng.choice(n, size=min(wanted, n), replace=False):
        number = int(np.searchsorted(ends, element, side="right"))
        k = int(element - (ends[number] - sizes[number]))
        group = assignment.groups[number]
        ways = part_kind(group.kind).variants_of(group.indices.shape[1])
        parts[number][k] = rng.integers(len(kit[group.kind]))
        variants[number][k] = rng.integers(len(ways.names))
    return Assignment(assignment.groups, tuple(parts), tuple(variants), assignment.n_q)
