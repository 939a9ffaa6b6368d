"""Kits for sweeps: found from scratch or from a neighbouring kit, and told as plain data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from kop_exudyn.errors import SimulationFailure
from kop_exudyn.kit.cluster import Clustering, cluster
from kop_exudyn.kit.parts import Assignment, Kit
from kop_exudyn.search.assigned import assigned_stage
from kop_exudyn.search.dataset import Dataset
from kop_exudyn.search.objective import Weights
from kop_exudyn.search.pool import DesignPool
from kop_exudyn.search.result import summary_of
from kop_exudyn.search.settings import StageSettings
from kop_exudyn.search.stage_results import StageResult
from kop_exudyn.search.stages import Stages
from kop_exudyn.structures.base import Design


def find_kit(
    designs: Sequence[Design],
    parts: Mapping[str, int],
    stages: StageSettings = StageSettings(),
    start: Sequence[Sequence[float]] | None = None,
    jobs: int = 1,
) -> dict[str, Any]:
    """A kit of that many parts a kind by the relaxed and the assigned stage, as plain data.

    start : by design, the elements (nq,) that a neighbouring kit realises. They are clustered anew,
        and the assigned stage begins there: elements that fit a few more or a few less parts need
        not be relaxed once more

    Returns
    kit : kind -> parts; pieces : by design, kind -> how many of each part it uses
    realised : by design (nq,), the elements made of the kit's parts; assignment : see
        `Assignment.to_dict`
    designs : by design, its name, number of elements and `summary_of`
    objective : J, None where a design failed; equilibria : solved in all

    Raises InputError for impossible requests, SimulationFailure when a design can't be simulated at
    the start.
    """
    with DesignPool(designs, jobs) as pool:
        pool.prepare()
        dataset = Dataset.of_pool(pool, Weights.suiting(designs))
        search = Stages(dataset, parts, stages)
        at_parts = (
            _from_inputs(search)
            if start is None
            else _from_neighbour(search, np.concatenate(list(start)))
        )
        return _plain(dataset, assigned_stage(search, at_parts))


def pieces_by_design(
    designs: Sequence[Design], kit: Kit, assignment: Assignment
) -> list[dict[str, list[int]]]:
    """By design: kind -> (m,) how many elements each part realises."""
    found, first = [], 0
    for design in designs:
        rows = slice(first, first + len(design.groups))
        own = Assignment(
            assignment.groups[rows], assignment.part[rows], assignment.variant[rows], assignment.n_q
        )
        found.append({kind: counts.tolist() for kind, counts in own.pieces(kit).items()})
        first = rows.stop
    return found


def _from_inputs(search: Stages) -> StageResult:
    """The state at the parts after the relaxed stage."""
    return search.to_parts(search.relaxed(_clustered(search, search.q0).kit))[1]


def _from_neighbour(search: Stages, q: np.ndarray) -> StageResult:
    """The designs led to the elements of another kit, and from there to the parts that suit these
    best."""
    inputs = search.inputs()
    paths = search.dataset.follow(q, inputs, search.settings.path_steps)
    start = [
        first if isinstance(path, SimulationFailure) else path[-1]
        for first, path in zip(inputs, paths)
    ]
    found = _clustered(search, np.concatenate([evaluation.q for evaluation in start]))
    return search.confirmed(search.built_from(found.kit, found.assignment, start))


def _clustered(search: Stages, q: np.ndarray) -> Clustering:
    settings = search.settings
    return cluster(
        search.dataset.groups,
        q,
        search.rule.sizes,
        bounds=settings.bounds,
        restarts=settings.restarts,
        seed=settings.seed,
    )


def _plain(dataset: Dataset, assigned: StageResult) -> dict[str, Any]:
    realised = dataset.split(assigned.assignment.matrix(assigned.kit) @ assigned.kit.vector)
    designs = [
        {
            "name": design.name,
            "elements": design.n_elements,
            **summary_of(outcome, design, reference),
        }
        for design, outcome, reference in zip(dataset.designs, assigned.designs, dataset.references)
    ]
    return {
        "kit": assigned.kit.to_dict(),
        "assignment": assigned.assignment.to_dict(),
        "pieces": pieces_by_design(dataset.designs, assigned.kit, assigned.assignment),
        "realised": realised,
        "designs": designs,
        "objective": assigned.value,
        "equilibria": dataset.tally.equilibria,
    }
