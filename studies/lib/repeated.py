"""The same search again with inputs that differ by rounding."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from kop_exudyn.analysis.sizes import deviation
from kop_exudyn.io.designs import load_design
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings
from kop_exudyn.structures.base import Design

from .study_tasks import stages_of

PERTURBATION = 1e-9  # relative, standard deviation


def perturbed(design: Design, seed: int, size: float = PERTURBATION) -> Design:
    """The design with every parameter changed by a random share of it; seed 0: as it is.

    size : standard deviation of the shares
    """
    found = copy(design)
    if seed:
        rng = np.random.default_rng([seed, len(design.parameters)])
        found.parameters = design.parameters * (1 + size * rng.normal(size=len(design.parameters)))
    return found


def repeated_task(
    files: Sequence[Path], parts: Mapping[str, int], stages: Mapping[str, Any], seed: int, jobs: int
) -> dict[str, Any]:
    """One search with the inputs of a seed: J (None where a design failed), largest deviation as
    kept and as opened in %, pieces to make, equilibria, wall time in s."""
    begin = perf_counter()
    designs = [perturbed(load_design(file), seed) for file in files]
    settings = JobSettings(stages=stages_of(stages), jobs=jobs, baselines=False)
    result = optimize_kit(designs, parts, settings=settings)
    largest = deviation(result)
    return {
        "J": result.stages["assigned"].value,
        "max %": largest if np.isfinite(largest) else None,
        "pieces": result.piece_count().fabricated,
        "equilibria": result.equilibria,
        "seconds": perf_counter() - begin,
    }


def spread_percent(values: Sequence[float | None]) -> float | None:
    """By how much the largest is above the smallest, %; None where one is missing."""
    known = [value for value in values if value is not None]
    if not known or len(known) < len(values):
        return None
    return 100 * (max(known) / min(known) - 1)
