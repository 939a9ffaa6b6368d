"""Kits for sweeps: found from scratch or from a neighbouring kit, and told as plain data."""
from __future__ import annotations

from dataclasses import replace
from typing import Any, Mapping, Sequence

import numpy as np

from ..errors import SimulationFailure
from ..kit.cluster import cluster
from ..kit.parts import Assignment, Kit
from ..optimize.dataset import Dataset
from ..optimize.objective import Evaluation, Weights
from ..optimize.pool import DesignPool
from ..optimize.rounds import in_rounds
from ..optimize.stages import StageResult, Stages, StageSettings
from ..structures.base import Design
from .kit_result import summary_of

_WARM_DECADES = 2  # of the schedule of w_c: relaxed elements of a neighbouring kit are in clusters already


def find_kit(designs: Sequence[Design], parts: Mapping[str, int], stages: StageSettings = StageSettings(),
             start: Sequence[Sequence[float]] | None = None, jobs: int = 1) -> dict[str, Any]:
    """A kit of that many parts a kind by the relaxed and the assigned stage, as plain data.

    start : by design, relaxed elements (nq,) of a neighbouring kit: the relaxed stage begins there, with the last
        values of w_c only. Default: the input elements and all values

    Returns
    kit : kind -> parts; pieces : by design, kind -> how many of each part it uses
    relaxed : by design (nq,) elements at the end of the relaxed stage
    designs : by design, its name, number of elements and `summary_of`
    objective : J, None where a design failed; equilibria : solved in all

    Raises InputError for impossible requests, SimulationFailure when a design can't be simulated at the start.
    """
    with DesignPool(designs, jobs) as pool:
        pool.prepare()
        dataset = Dataset.of_pool(pool, Weights(fit=max(design.fit_weight for design in designs)))
        search = Stages(dataset, parts, stages)
        evaluations = search.inputs()
        if start is not None:
            evaluations = _followed(dataset, evaluations, np.concatenate(list(start)), stages.path_steps)
            search = Stages(dataset, parts, replace(stages, schedule=search.settings.schedule[-_WARM_DECADES:]))
        q = np.concatenate([evaluation.q for evaluation in evaluations])
        kit = cluster(dataset.groups, q, parts, bounds=stages.bounds, restarts=stages.restarts, seed=stages.seed).kit
        relaxed, at_parts = search.to_parts(search.relaxed(kit, evaluations))
        return _plain(dataset, relaxed, in_rounds(search, at_parts))


def pieces_by_design(designs: Sequence[Design], kit: Kit, assignment: Assignment) -> list[dict[str, list[int]]]:
    """By design: kind -> (m,) how many elements each part realises."""
    found, first = [], 0
    for design in designs:
        rows = slice(first, first + len(design.groups))
        own = Assignment(assignment.groups[rows], assignment.part[rows], assignment.variant[rows], assignment.n_q)
        found.append({kind: counts.tolist() for kind, counts in own.pieces(kit).items()})
        first = rows.stop
    return found


def _followed(dataset: Dataset, start: Sequence[Evaluation], q: np.ndarray, steps: int) -> list[Evaluation]:
    """The designs at other elements q, reached on the straight path; those that fail on it stay at the start."""
    paths = dataset.follow(q, start, steps)
    return [first if isinstance(path, SimulationFailure) else path[-1] for first, path in zip(start, paths)]


def _plain(dataset: Dataset, relaxed: StageResult, assigned: StageResult) -> dict[str, Any]:
    designs = [{"name": design.name, "elements": design.n_elements, **summary_of(outcome, design, reference)}
               for design, outcome, reference in zip(dataset.designs, assigned.designs, dataset.references)]
    return {
        "kit": assigned.kit.to_dict(),
        "pieces": pieces_by_design(dataset.designs, assigned.kit, assigned.assignment),
        "relaxed": [evaluation.q for evaluation in relaxed.designs],
        "designs": designs, "objective": assigned.value, "equilibria": dataset.tally.equilibria,
    }
