"""The watched path from relaxed designs to their parts, and what rescues those that fail on it."""

from __future__ import annotations

import logging
from collections.abc import Sequence

import numpy as np

from ..errors import SimulationFailure
from ..kit.cluster import cluster
from .stage_results import Jump, StageResult
from .stages import Stages

log = logging.getLogger(__name__)


def to_parts(stages: Stages, relaxed: StageResult) -> tuple[StageResult, StageResult]:
    """Follow all designs along the straight path to their parts.

    stages : of the search
    relaxed : where the path begins

    When a design fails, w_c is raised and the relaxed stage goes on from where it was; also when
    one snaps, unless the rounds of the assigned stage are to make up for that. Returns the relaxed
    result that the path started from in the end, and the state at the parts.
    """
    settings = stages.settings
    attempts = settings.rescues + stages.rule.growth(settings)
    for attempt in range(attempts + 1):
        kit = stages.limited(relaxed.kit)
        built = stages.built_from(kit, relaxed.assignment, relaxed.evaluations)
        failed = [d for d in built.designs if isinstance(d, SimulationFailure)]
        for jump in built.jumps:
            log.warning(
                "%s snaps at %.0f %% of the way to its parts (%.1f %% of its size)",
                jump.design,
                100 * jump.fraction,
                100 * jump.distance,
            )
        for failure in failed:
            log.warning("%s", failure)
        needed = failed or built.jumps and not settings.reassignments
        if not needed or attempt == attempts:
            break
        relaxed = _rescued(stages, relaxed, attempt, built.jumps)
    return relaxed, stages.confirmed(built)


def from_neighbour(stages: Stages, q: np.ndarray) -> StageResult:
    """The designs led to the elements of another kit, and from there to the parts that suit these
    best; a design that fails on the first way starts from its input.

    stages : of the search
    q : (n_q,) the elements
    """
    inputs = stages.inputs()
    paths = stages.dataset.follow(q, inputs, stages.settings.path_steps)
    start = [
        first if isinstance(path, SimulationFailure) else path[-1]
        for first, path in zip(inputs, paths)
    ]
    there = np.concatenate([evaluation.q for evaluation in start])
    kit, assignment = stages.rule.first(
        stages.dataset.groups, there, stages.projection, stages.settings
    )
    return stages.confirmed(stages.built_from(stages.limited(kit), assignment, start))


def _rescued(
    stages: Stages, relaxed: StageResult, attempt: int, jumps: Sequence[Jump]
) -> StageResult:
    """The relaxed stage again from its end: with w_c raised, later with one more part of every
    kind."""
    settings, kit = stages.settings, relaxed.kit
    q = np.concatenate([e.q for e in relaxed.evaluations])
    weight = stages.schedule[-1]
    if attempt < settings.rescues:
        weight *= 10 ** (attempt + 1)
        log.warning("raising w_c to %g", weight)
    else:
        sizes = {kind: count + 1 for kind, count in kit.sizes.items()}
        log.warning("one more part of every kind: %s", sizes)
        kit = cluster(
            stages.dataset.groups,
            q,
            sizes,
            bounds=settings.bounds,
            restarts=settings.restarts,
            seed=settings.seed,
            penalties=stages.projection.penalties,
        ).kit
    result, _ = stages.relaxed_at(f"rescue-{attempt + 1}", weight, q, relaxed.evaluations, kit)
    data = result.point.data
    return StageResult(
        list(data.evaluations),
        data.kit,
        data.assignment,
        relaxed.steps + result.steps,
        result.point.value,
        result.status,
        [*relaxed.jumps, *jumps],
    )
