"""Kits for sweeps: found from scratch or from a neighbouring kit, and told as plain data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from kop_exudyn.search.evaluation import Evaluation
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.result import KitResult
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings, StageSettings
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
    settings = JobSettings(stages=stages, jobs=jobs, baselines=False)
    return _plain(optimize_kit(designs, parts, start=start, settings=settings))


def stages_of(plain: Mapping[str, Any]) -> StageSettings:
    """Settings from the plain data of a task: those that aren't the default ones."""
    given = dict(plain)
    if "requirements" in given:
        given["requirements"] = Requirements(**given["requirements"])
    return StageSettings(**given)


def _plain(result: KitResult) -> dict[str, Any]:
    offsets = np.cumsum([len(design.parameters) for design in result.designs])[:-1]
    q = [
        outcome.q if isinstance(outcome, Evaluation) else design.parameters
        for outcome, design in zip(result.stages["assigned"].designs, result.designs)
    ]
    realised = np.split(result.assignment.realise(result.kit, np.concatenate(q)), offsets)
    return {
        "kit": result.kit.to_dict(),
        "assignment": result.assignment.to_dict(),
        "pieces": result.pieces(),
        "realised": realised,
        "designs": [
            {"name": design.name, "elements": design.n_elements, **result.summary("assigned", n)}
            for n, design in enumerate(result.designs)
        ],
        "objective": result.stages["assigned"].value,
        "equilibria": result.equilibria,
    }
