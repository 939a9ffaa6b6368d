"""A search with all that a user sees of it: progress, checkpoints, results and a report in one
folder."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from tqdm import tqdm
from tqdm.contrib.logging import logging_redirect_tqdm

from ..io.checkpoint import Job
from ..io.run_folder import RunFolder
from ..kit.parts import Kit
from ..kit.stock import Stock
from ..search.result import KitResult
from ..search.run import check_request, described_job, digest, optimize_kit
from ..search.settings import JobSettings
from ..search.stage_results import StageEvent
from ..structures.base import Design
from .kit_report import write_kit_report


def optimize_and_report(
    designs: Sequence[Design],
    parts: Mapping[str, int] | None = None,
    *,
    out: str | Path,
    kit: Kit | Stock | None = None,
    settings: JobSettings = JobSettings(),
    inputs: Sequence[str | Path] = (),
    resume: bool = False,
    overwrite: bool = False,
    progress: bool = False,
) -> KitResult:
    """Find a kit for these designs; write checkpoints on the way, and results and a report in the
    end.

    Parameters
    ----------
    designs, parts, kit, settings : see `optimize_kit`
    out : folder for all files; see `RunFolder` for what it may hold
    inputs : files that the designs were read from; a run is resumed only while they are the same
    resume : go on from the checkpoints in `out`
    overwrite : replace what another job left in `out`
    progress : show accepted steps on standard error

    Raises
    ------
    InputError
        for impossible requests and unusable folders, before anything is simulated
    SimulationFailure
        when an input design can't be simulated
    """
    check_request(designs, parts, kit, settings)
    job = described_job(designs, parts, kit, settings)
    if not inputs:
        job |= {"parameters": {design.name: digest(design.parameters) for design in designs}}
    folder = RunFolder.open(out, Job.of(job, inputs), resume=resume, overwrite=overwrite)
    with progress_bar(progress) as bar:

        def observe(event: StageEvent) -> None:
            bar.set_postfix_str(f"{event.sqp}: J = {event.record.value:.4g}", refresh=False)
            bar.update()

        result = optimize_kit(
            designs,
            parts,
            kit=kit,
            settings=settings,
            store=folder.store,
            observer=observe,
            announce=bar.set_description_str,
        )
    write_kit_report(result, folder.path)
    return result


@contextmanager
def progress_bar(shown: bool) -> Iterator[tqdm]:
    """A bar of accepted steps on standard error; log messages appear above it."""
    look = "{desc}: {n_fmt} steps, {elapsed}{postfix}"
    with (
        logging_redirect_tqdm([logging.getLogger("kop_exudyn")]),
        tqdm(unit=" steps", disable=not shown, bar_format=look) as bar,
    ):
        yield bar
