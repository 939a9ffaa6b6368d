"""The main job with all that a user sees of it: progress, checkpoints, results and a report in one
folder."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import scipy.sparse as sp
from tqdm import tqdm
from tqdm.contrib.logging import logging_redirect_tqdm

from ..errors import InputError
from ..io.checkpoint import Job
from ..io.run_folder import RunFolder
from ..kit.cluster import cluster
from ..kit.parts import Kit
from ..search.job import JobSettings, run_job
from ..search.result import KitResult
from ..search.stage_results import StageEvent
from ..structures.base import Design
from ..units import common_units
from .kit_report import write_kit_report


def optimize_kit(
    designs: Sequence[Design],
    parts: Mapping[str, int],
    *,
    out: str | Path,
    settings: JobSettings = JobSettings(),
    inputs: Sequence[str | Path] = (),
    resume: bool = False,
    overwrite: bool = False,
    progress: bool = False,
    kit: Kit | None = None,
) -> KitResult:
    """Find a kit for these designs; write checkpoints on the way, and results and a report in the
    end.

    parts : kind -> number of parts
    kit : build the designs from this one, whose parts stay as they are (`parts` are then its sizes)
    out : folder for all files; see `RunFolder` for what it may hold
    inputs : files that the designs were read from; a run is resumed only while they are the same
    resume : go on from the checkpoints in `out`

    Raises InputError for impossible requests and unusable folders, before anything is simulated,
    and SimulationFailure when an input design can't be simulated.
    """
    begin = perf_counter()
    units = common_units({design.name: design.units for design in designs})
    if kit is not None:
        common_units({"the kit": kit.units, "the designs": units}, "designs and kits")
        _check_kit(designs, kit)
    else:
        _check_request(designs, parts, settings)
    described = described_job(designs, parts, settings) | (
        {"kit": kit.to_dict()} if kit is not None else {}
    )
    job = (
        described
        if inputs
        else described | {"parameters": {d.name: _digest(d.parameters) for d in designs}}
    )
    folder = RunFolder.open(out, Job.of(job, inputs), resume=resume, overwrite=overwrite)
    events: list[StageEvent] = []
    with _progress_bar(progress) as bar:

        def observe(event: StageEvent) -> None:
            events.append(event)
            bar.set_postfix_str(f"{event.sqp}: J = {event.record.value:.4g}", refresh=False)
            bar.update()

        outcome = run_job(
            designs, parts, settings, folder.store, observe, bar.set_description_str, kit
        )
    result = KitResult(
        list(designs),
        outcome.references,
        outcome.stages,
        events,
        outcome.equilibria,
        outcome.newton_iterations,
        perf_counter() - begin,
        outcome.peak_memory_mb,
        described | {"jobs": settings.jobs},
        outcome.redeployed,
        outcome.clustering,
    )
    write_kit_report(result, folder.path)
    return result


def _check_request(
    designs: Sequence[Design], parts: Mapping[str, int], settings: JobSettings
) -> None:
    """Raise the clustering's InputError for numbers of parts or bounds that can't be met: it needs
    no simulation."""
    offsets = np.cumsum([0, *(len(design.parameters) for design in designs)])
    groups = [
        group.shifted(offset) for design, offset in zip(designs, offsets) for group in design.groups
    ]
    q = np.concatenate([design.parameters for design in designs])
    constraints = settings.stages.constraints
    if constraints is not None and constraints.A.shape[1] != len(q):
        raise InputError(
            f"are on {constraints.A.shape[1]} parameters, the designs have {len(q)}",
            field="constraints",
        )
    cluster(groups, q, parts, bounds=settings.stages.bounds, restarts=1)


def _check_kit(designs: Sequence[Design], kit: Kit) -> None:
    """Raise InputError where a design has elements of a kind that the kit lacks."""
    for design in designs:
        for kind in dict.fromkeys(group.kind for group in design.groups):
            if kind not in kit.sizes:
                raise InputError(
                    f"the kit has no {kind} parts, which {design.name} is made of",
                    field="kit",
                    value=", ".join(kit.sizes),
                )


def described_job(
    designs: Sequence[Design], parts: Mapping[str, int], settings: JobSettings
) -> dict[str, Any]:
    """All that the result depends on, as plain data; the number of processes is not part of it."""
    constraints = settings.stages.constraints
    values = asdict(replace(settings, stages=replace(settings.stages, constraints=None)))
    values["weights"] = settings.weights and settings.weights.to_dict()
    if constraints is not None:
        rows = sp.csr_array(constraints.A)
        rows.sort_indices()
        numbers = (rows.indptr, rows.indices, rows.data, constraints.lower, constraints.upper)
        values["stages"]["constraints"] = {"rows": constraints.rows, "digest": _digest(*numbers)}
    del values["jobs"]
    return {"designs": [design.name for design in designs], "parts": dict(parts), **values}


def _digest(*arrays: np.ndarray) -> str:
    return hashlib.sha256(
        b"".join(np.ascontiguousarray(a, dtype=float).tobytes() for a in arrays)
    ).hexdigest()


@contextmanager
def _progress_bar(shown: bool) -> Iterator[tqdm]:
    """A bar of accepted steps on standard error; log messages appear above it."""
    with (
        logging_redirect_tqdm([logging.getLogger("kop_exudyn")]),
        tqdm(
            unit=" steps", disable=not shown, bar_format="{desc}: {n_fmt} steps, {elapsed}{postfix}"
        ) as bar,
    ):
        yield bar
