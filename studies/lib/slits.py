"""Linear parts with slit ends: what slits of which length gain, for how many parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from kop_exudyn.errors import SimulationFailure
from kop_exudyn.kit.cluster import cluster
from kop_exudyn.kit.elements import collect
from kop_exudyn.kit.groups import ElementGroup
from kop_exudyn.kit.parts import Assignment, Kit
from kop_exudyn.search.dataset import Dataset
from kop_exudyn.search.evaluation import Evaluation
from kop_exudyn.search.pool import DesignPool
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.result import summary_of
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings, StageSettings
from kop_exudyn.search.weights import Weights
from kop_exudyn.structures.base import Design


def slit_kit(
    designs: Sequence[Design],
    m: int,
    penalty: float | None,
    *,
    restarts: int = 10,
    seed: int = 0,
    path_steps: int = 5,
    jobs: int = 1,
) -> dict[str, Any]:
    """The best m slit parts for the designs' linear elements, and the designs built of them; other
    elements stay.

    penalty : cost of slits, in units of 1/2 (slit / scale)^2 averaged over the parts, against the
        projection energy; None: plain linear parts
    path_steps : of the straight path on which the designs are followed to their parts

    Returns
    projection_energy : mean of half the squared distances of the linear elements to what their
        parts realise, over the square of the scale (without the cost of slits)
    scale : median length of the linear elements; slits : (m,) lengths in % of it
    rms_percent, largest_percent : distances of lengths to what the parts realise, in % of the scale
    designs : by design, its name and `summary_of`, {"failed": why} where it can't be followed to
        its parts

    Raises InputError for impossible requests, SimulationFailure when an input design can't be
    simulated.
    """
    kind = "linear" if penalty is None else "slit"
    with DesignPool(designs, jobs) as pool:
        pool.prepare()
        dataset = Dataset.of_pool(pool, Weights.suiting(designs))
        q = dataset.parameters
        groups = [
            ElementGroup(kind, group.indices) for group in dataset.groups if group.kind == "linear"
        ]
        scale = collect(groups, q)[kind].scale
        penalties = None if penalty is None else {kind: (0.0, 0.0, penalty)}
        found = cluster(groups, q, {kind: m}, restarts=restarts, seed=seed, penalties=penalties)
        realised = found.assignment.realise(found.kit, q)
        return {
            "scale": scale,
            "kit": found.kit.to_dict(),
            **distances(q, realised, found.assignment, scale),
            "slits": _slits(found.kit, kind) / scale * 100,
            "designs": [
                {"name": design.name, **figures}
                for design, figures in zip(designs, _built(dataset, realised, path_steps))
            ],
        }


def optimised_kit(
    designs: Sequence[Design],
    kind: str,
    m: int,
    corners: int,
    stages: StageSettings,
    jobs: int = 1,
) -> dict[str, Any]:
    """A kit of m plain or slit parts for the linear elements, by both stages of the search; nothing
    is required of the designs but that they are equilibria.

    kind : "linear" or "slit";  corners : number of angular parts

    Returns
    objective : J with the cost of slits, None where a design failed; slit_cost : what they are of
        it
    pieces : of beams to make, so that the designs can be built one after the other
    slits : (m,) lengths in % of the median length of the linear elements
    max_percent : largest deviation of all designs, None where one failed
    outside_percent : by how much the furthest length is outside of what its part realises, in % of
        the median
    seconds : wall time of the search

    Raises as `optimize_kit`.
    """
    settings = JobSettings(
        stages=replace(stages, requirements=Requirements.none()), jobs=jobs, baselines=False
    )
    result = optimize_kit(designs, {kind: m, "angular": corners}, settings=settings)
    assigned = result.stages["assigned"]
    found = [design for design in assigned.designs if isinstance(design, Evaluation)]
    whole = len(found) == len(assigned.designs)
    lengths = [
        design.parameters[group.indices].ravel()
        for design in result.designs
        for group in design.groups
        if group.kind == kind
    ]
    scale = float(np.median(np.concatenate(lengths)))
    deviations = [
        result.summary("assigned", n)["fit"]["max_percent"] for n in range(len(found)) if whole
    ]
    q = np.concatenate([design.q for design in found]) if whole else None
    return {
        "objective": assigned.value,
        "slit_cost": assigned.value - sum(design.value for design in found) if whole else None,
        "pieces": int(np.max([counts[kind] for counts in result.pieces()], axis=0).sum()),
        "slits": _slits(result.kit, kind) / scale * 100,
        "max_percent": max(deviations, default=None),
        "outside_percent": None
        if q is None
        else 100 * float(np.abs(q - assigned.assignment.realise(result.kit, q)).max()) / scale,
        "seconds": result.seconds["search"],
    }


def distances(
    q: np.ndarray, realised: np.ndarray, assignment: Assignment, scale: float
) -> dict[str, float]:
    """Projection energy, root mean square and largest distance of elements q (n_q,) to realised
    ones (n_q,)."""
    squared = [np.sum((q - realised)[group.indices] ** 2, axis=1) for group in assignment.groups]
    lengths = np.concatenate([(q - realised)[group.indices].ravel() for group in assignment.groups])
    return {
        "projection_energy": 0.5 * float(np.mean(np.concatenate(squared))) / scale**2,
        "rms_percent": 100 * float(np.sqrt(np.mean(lengths**2))) / scale,
        "largest_percent": 100 * float(np.abs(lengths).max()) / scale,
    }


def _slits(kit: Kit, kind: str) -> np.ndarray:
    """(m,) slit lengths."""
    return kit[kind][:, 2] if kind == "slit" else np.zeros(len(kit[kind]))


def _built(dataset: Dataset, q: np.ndarray, path_steps: int) -> list[dict[str, Any]]:
    """Every design followed to the elements q, confirmed by Exudyn."""
    start = list(
        dataset.judge(
            {
                n: (design.parameters, dict(reference.equilibria))
                for n, (design, reference) in enumerate(zip(dataset.designs, dataset.references))
            }
        ).values()
    )
    paths = dataset.follow(q, start, path_steps)
    ends: dict[int, Evaluation] = {
        n: path[-1] for n, path in enumerate(paths) if not isinstance(path, SimulationFailure)
    }
    confirmed = dataset.confirm(ends)
    outcomes = [
        path if isinstance(path, SimulationFailure) else confirmed[n]
        for n, path in enumerate(paths)
    ]
    return [
        summary_of(outcome, design, reference)
        for outcome, design, reference in zip(outcomes, dataset.designs, dataset.references)
    ]
