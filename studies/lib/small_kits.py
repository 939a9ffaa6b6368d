"""Kits so small that the best one is known: every assignment is tried, with the parts solved for.

The designs are strips with marked joints, their ends pinned closer together than they are long, so
that they bulge: planar elasticas. The elements are the strip's pieces about a joint, of two lengths
each. With four pieces and two parts there are 36 assignments that differ by more than names.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any

import numpy as np

from kop_exudyn.kit.cluster import best_parts
from kop_exudyn.kit.elements import Labels, collect
from kop_exudyn.kit.parts import Assignment, Kit
from kop_exudyn.search.dataset import Dataset
from kop_exudyn.search.pool import DesignPool
from kop_exudyn.search.problems import AssignedProblem
from kop_exudyn.search.reassign import LocalModel
from kop_exudyn.search.reassign import best_parts as best_model_parts
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings, StageSettings
from kop_exudyn.search.stages import Stages
from kop_exudyn.search.weights import Weights

from .stress.arch import Arch

_DAMPING = 1e-3  # of the model that parts start from
_SAME = 1e-3  # of J: optima that close are one


def strip_of(seed: int) -> Arch:
    """A random strip of four pieces."""
    rng = np.random.default_rng(seed)
    pieces = rng.uniform(0.08, 0.16, (4, 2))
    return Arch(f"strip {seed}", pieces, rng.uniform(0.75, 0.9) * pieces.sum())


def assignments(n: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Part and variant (n,) of n elements made of two parts; one of each that differ by the names
    of the parts or by their ends."""
    for rest in product(range(4), repeat=n - 1):
        ways = np.array([0, *rest])
        part, variant = ways // 2, ways % 2
        second = np.flatnonzero(part == 1)
        if not len(second) or variant[second[0]] == 0:
            yield part, variant


def compared(seed: int, efforts: Sequence[str] = ("normal",)) -> dict[str, Any]:
    """The search's J and the best of all assignments for one random strip and two parts.

    efforts : of the search, see `StageSettings.effort`

    Returns rows, one an effort: J of the search and of the best assignment, and others over that.
    The optimum is the least of all that was found, the searches' own results included.
    """
    strip = strip_of(seed)
    results = {}
    for effort in efforts:
        settings = StageSettings(requirements=Requirements.none(), effort=effort, levelling=0)
        results[effort] = optimize_kit(
            [strip], {"linear": 2}, settings=JobSettings(jobs=1, stages=settings, baselines=False)
        )
    values = sorted(_all_values(strip))
    searched = {e: _finite(found.stages["assigned"].value) for e, found in results.items()}
    best = min(values[0], *searched.values())
    rows = [
        {
            "seed": seed,
            "effort": effort,
            "assignments": len(values),
            "J of the search": searched[effort],
            "J of the best": best,
            "ratio": searched[effort] / best,
            "found": bool(searched[effort] <= best * (1 + _SAME)),
            "better than all tried": bool(searched[effort] < values[0] * (1 - _SAME)),
            "second best": next((v / best for v in values if v > best * (1 + _SAME)), None),
            "direct": _finite(found.stages["direct"].value) / best,
        }
        for effort, found in results.items()
    ]
    return {"rows": rows}


def _finite(value: float | None) -> float:
    return float("inf") if value is None else value


def _all_values(strip: Arch) -> list[float]:
    """J of every assignment, its parts at their minimum; infinite where the strip fails."""
    found = []
    with DesignPool([strip], 1) as pool:
        pool.prepare()
        dataset = Dataset.of_pool(pool, Weights.suiting([strip]))
        stages = Stages(
            dataset,
            {"linear": 2},
            StageSettings(assigned_tolerance=1e-6, requirements=Requirements.none()),
        )
        derivatives = dataset.derivatives(stages.inputs(), hessian=True)
        inputs = [d.evaluation for d in derivatives]
        model = LocalModel.of(
            derivatives, dataset.design_weights, dataset.split(dataset.scales()), _DAMPING
        )
        elements = collect(dataset.groups, dataset.parameters)["linear"]
        limits = elements.kind.bounds(None)
        for part, variant in assignments(strip.n_elements):
            labels = Labels(part, variant, np.zeros(len(part)))
            nearest = Kit({"linear": best_parts(elements, np.full((2, 2), 0.1), labels, *limits)})
            assignment = Assignment(
                tuple(dataset.groups), (part,), (variant,), len(dataset.parameters)
            )
            # the parts start from where the elements are nearest to them, or the model lowest
            kits = [nearest]
            problem = AssignedProblem(dataset, nearest, assignment)
            moved = best_model_parts(problem, problem.variables(inputs[0].q), model)
            kits += [problem.kit_of(moved)] if moved is not None else []
            starts = [stages.built_from(kit, assignment, inputs, path_steps=3) for kit in kits]
            whole = [start for start in starts if start.value is not None]
            built = min(whole, key=lambda start: start.value) if whole else None
            value = stages.assigned(built).value if built is not None else None
            found.append(float("inf") if value is None else value)
    return found
