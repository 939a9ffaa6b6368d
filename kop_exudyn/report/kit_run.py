"""A search with all that a user sees of it: progress, checkpoints, results and a report in one
folder."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from tqdm import tqdm
from tqdm.contrib.logging import logging_redirect_tqdm

from ..analysis.verdict import Buildable, VerdictSettings
from ..fabrication.limits import part_bounds, short_sides
from ..io.checkpoint import Job
from ..io.run_folder import RunFolder
from ..kit.parts import Kit
from ..kit.stock import Stock
from ..search.events import StageEvent
from ..search.job import described_job, design_digest
from ..search.pool import DesignPool
from ..search.request import check_request, check_types, kinds_of
from ..search.result import KitResult
from ..search.run import optimize_kit
from ..search.settings import JobSettings
from ..structures.base import Design
from ..structures.serving import served_by
from .kit_report import write_kit_report
from .verdicts import give_verdicts, given_verdicts, warning_lines

log = logging.getLogger(__name__)


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
    verdict: VerdictSettings = VerdictSettings(),
) -> KitResult:
    """Find a kit for these designs; write checkpoints on the way, and results, a verdict on each
    design and a report in the end.

    What stops an input design, and so no kit can mend, is said by a warning before the search.
    Parts have sides long enough for their holes and corners that strips can be joined at, unless
    the settings bound these kinds of parts otherwise, see `part_bounds`.

    Parameters
    ----------
    designs, parts, kit, settings : see `optimize_kit`
    out : folder for all files; see `RunFolder` for what it may hold
    inputs : files that the designs were read from; a run is resumed only while they are the same
    resume : go on from the checkpoints in `out`
    overwrite : replace what another job left in `out`
    progress : show accepted steps on standard error
    verdict : tolerances and samples of the verdicts; their safety is that of the requirements

    Raises
    ------
    InputError
        for impossible requests and unusable folders, before anything is simulated
    SimulationFailure
        when an input design can't be simulated
    """
    check_types(designs, kit, settings)
    designs = served_by(designs, kinds_of(parts, kit))
    if kit is None:
        settings = within_workshop(designs, settings)
        tell_short_sides(designs, settings)
    check_request(designs, parts, kit, settings)
    job = described_job(designs, parts, kit, settings)
    if not inputs:
        job |= {"content": {design.name: design_digest(design) for design in designs}}
    folder = RunFolder.open(out, Job.of(job, inputs), resume=resume, overwrite=overwrite)
    required = settings.stages.requirements
    verdict = replace(verdict, safety=required.safety)
    given: list[Buildable] = []
    with progress_bar(progress) as bar:

        def examine(pool: DesignPool) -> None:
            given.extend(given_verdicts(pool, verdict, required))
            for line in warning_lines(given):
                log.warning("%s", line)

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
            examine=examine,
        )
        result.given = [one.to_dict() for one in given]
        result.warnings = warning_lines(given)
        bar.set_description_str("verdicts")
        verdicts = give_verdicts(result, verdict, settings.jobs, settings.scheduler)
    write_kit_report(result, folder.path, verdicts)
    return result


def within_workshop(designs: Sequence[Design], settings: JobSettings) -> JobSettings:
    """The settings with bounds that keep parts long enough for their holes, see `part_bounds`, for
    kinds that they bound in no other way."""
    bounds = {**part_bounds(designs), **(settings.stages.bounds or {})}
    return replace(settings, stages=replace(settings.stages, bounds=bounds or None))


def tell_short_sides(designs: Sequence[Design], settings: JobSettings) -> None:
    """Warn of designs that no part of these settings suits, see `short_sides`."""
    for text in short_sides(designs, settings.stages.bounds or {}):
        log.warning("%s", text)


@contextmanager
def progress_bar(shown: bool) -> Iterator[tqdm]:
    """A bar of accepted steps on standard error; log messages appear above it."""
    look = "{desc}: {n_fmt} steps, {elapsed}{postfix}"
    with (
        logging_redirect_tqdm([logging.getLogger("kop_exudyn")]),
        tqdm(unit=" steps", disable=not shown, bar_format=look) as bar,
    ):
        yield bar
