"""Searches over kit sizes with all that a user sees of them: progress, checkpoints, a table, a
figure and the chosen kit in one folder."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from ..analysis.sizes import KitCost, SizedKit, smallest_kit, trade_off
from ..analysis.tradeoff import knee
from ..analysis.verdict import Buildable, VerdictSettings
from ..drawing.style import figure_bytes
from ..files.files import write_bytes
from ..files.json_files import plain, write_json
from ..files.tables import write_csv
from ..io.checkpoint import Job
from ..io.run_folder import RunFolder
from ..search.job import described_job, design_digest
from ..search.pool import DesignPool
from ..search.request import check_request
from ..search.result import KitResult
from ..search.settings import JobSettings
from ..structures.base import Design
from ..structures.serving import served_by
from ..wording import counted_parts
from .environment import environment
from .kit_report import write_kit_report
from .kit_run import progress_bar, tell_short_sides, within_workshop
from .page import Page
from .tradeoff_drawing import draw_tradeoff
from .verdicts import give_verdicts, given_verdicts, warning_lines

log = logging.getLogger(__name__)

_EXPLAINED = (
    "Deviations of the designs as they open, in % of their targets' sizes: the largest of all "
    "designs, and the mean over the designs of their means. Pieces: as many of each part as the "
    "design that needs most of it. J: the objective. From: the kit whose parts were split or "
    "merged. A dash: a design could not be built."
)
_COLUMNS = ("parts", "pieces", "kit size %", "cost", "max %", "mean %", "energy ratio", "J", "from")


def smallest_and_report(
    designs: Sequence[Design],
    limit: float,
    first: Mapping[str, int],
    *,
    out: str | Path,
    cost: KitCost = KitCost(),
    settings: JobSettings = JobSettings(),
    accepts: Callable[[KitResult], bool] = lambda result: True,
    inputs: Sequence[str | Path] = (),
    resume: bool = False,
    overwrite: bool = False,
    progress: bool = False,
    verdict: VerdictSettings = VerdictSettings(),
) -> tuple[SizedKit, bool]:
    """Find the smallest kit within a deviation; write its report with all kits looked at.

    Parameters
    ----------
    designs, limit, first, cost, settings, accepts : see `smallest_kit`
    out, inputs, resume, overwrite, progress, verdict : see `optimize_and_report`, also for the
        workshop's bounds on parts

    Returns the kit and whether it keeps the limit; where none does, the one that deviates least.
    Raises InputError and SimulationFailure as `optimize_and_report`.
    """
    designs = served_by(designs, first)
    settings = within_workshop(designs, settings)
    tell_short_sides(designs, settings)
    asked = {"max_deviation": limit, "cost": asdict(cost)}
    with _prepared(
        designs, first, settings, asked, out, inputs, resume, overwrite, progress, verdict
    ) as run:
        found, kits = smallest_kit(
            designs,
            limit,
            first,
            settings=settings,
            cost=cost,
            accepts=accepts,
            store=run.folder.store,
            observer=run.tell,
            announce=run.bar.set_description_str,
            examine=run.examine,
        )
        chosen = found or min(kits, key=lambda kit: kit.max_percent)
        chosen.result.settings = {**chosen.result.settings, **asked}
        rows = _rows(kits, cost)
        figure = _written(run.folder.path, rows)

        def extend(page: Page) -> None:
            text = (
                f"The smallest kit found that keeps every design within {limit:g} %."
                if found is not None
                else f"No kit that was tried keeps every design within {limit:g} %; this one "
                f"comes nearest."
            )
            page.section("Other sizes", text)
            _add_table(page, rows, figure)

        verdicts = give_verdicts(chosen.result, run.verdict, settings.jobs, settings.scheduler)
        write_kit_report(chosen.result, run.folder.path, verdicts, extend)
    return chosen, found is not None


def tradeoff_and_report(
    designs: Sequence[Design],
    sizes: Sequence[Mapping[str, int]],
    *,
    out: str | Path,
    cost: KitCost = KitCost(),
    settings: JobSettings = JobSettings(),
    inputs: Sequence[str | Path] = (),
    resume: bool = False,
    overwrite: bool = False,
    progress: bool = False,
    verdict: VerdictSettings = VerdictSettings(),
) -> list[SizedKit]:
    """Find kits of several sizes; write tradeoff.json, tradeoff.csv, a figure and a page, and every
    kit's own report in a folder of its own.

    Parameters
    ----------
    designs, sizes, settings : see `trade_off`
    cost : shown with every kit
    out, inputs, resume, overwrite, progress, verdict : see `optimize_and_report`, also for the
        workshop's bounds on parts

    Raises InputError and SimulationFailure as `optimize_and_report`.
    """
    designs = served_by(designs, sizes[-1])
    settings = within_workshop(designs, settings)
    tell_short_sides(designs, settings)
    with _prepared(
        designs,
        sizes[-1],
        settings,
        _asked(sizes),
        out,
        inputs,
        resume,
        overwrite,
        progress,
        verdict,
    ) as run:
        kits = trade_off(
            designs,
            sizes,
            settings=settings,
            store=run.folder.store,
            observer=run.tell,
            announce=run.bar.set_description_str,
            examine=run.examine,
        )
        rows = [kit.row(cost) for kit in kits]
        at = knee([row["parts"] for row in rows], [row["max %"] for row in rows])
        figure = _written(run.folder.path, rows, at)
        page = Page(
            "Kit size against fidelity",
            f"Kits of {rows[0]['parts']} to {rows[-1]['parts']} parts for "
            f"{', '.join(design.name for design in designs)}.",
        )
        _add_table(page, rows, figure)
        links = {}
        for kit in kits:
            name = "-".join(f"{count}_{kind}" for kind, count in kit.sizes.items())
            write_kit_report(kit.result, run.folder.path / name)
            links[counted_parts(kit.sizes)] = f"{name}/index.html"
        page.section("The kits").links(links)
        page.details("Settings", kits[-1].result.settings)
        page.details("Versions and machine", environment())
        page.save(run.folder.path / "index.html", overwrite=True)
    return kits


def tradeoff_job(
    designs: Sequence[Design],
    sizes: Sequence[Mapping[str, int]],
    *,
    settings: JobSettings = JobSettings(),
    inputs: Sequence[str | Path] = (),
) -> Job:
    """The job that `tradeoff_and_report` records in its folder, by which a run is known again;
    parameters are its own."""
    designs = served_by(designs, sizes[-1])
    return _job(designs, sizes[-1], within_workshop(designs, settings), _asked(sizes), inputs)


def _asked(sizes: Sequence[Mapping[str, int]]) -> dict[str, Any]:
    return {"sizes": [dict(size) for size in sizes]}


def _job(
    designs: Sequence[Design],
    parts: Mapping[str, int],
    settings: JobSettings,
    asked: Mapping[str, Any],
    inputs: Sequence[str | Path],
) -> Job:
    job = {**described_job(designs, parts, None, settings), **asked}
    if not inputs:
        job["content"] = {design.name: design_digest(design) for design in designs}
    return Job.of(plain(job), inputs)


class _prepared:
    """A folder for the job, and a bar that tells of kits."""

    def __init__(
        self,
        designs: Sequence[Design],
        parts: Mapping[str, int],
        settings: JobSettings,
        asked: Mapping[str, Any],
        out: str | Path,
        inputs: Sequence[str | Path],
        resume: bool,
        overwrite: bool,
        progress: bool,
        verdict: VerdictSettings,
    ):
        check_request(designs, parts, None, settings)
        job = _job(designs, parts, settings, asked, inputs)
        self.folder = RunFolder.open(out, job, resume=resume, overwrite=overwrite)
        self._bar = progress_bar(progress)
        self._required = settings.stages.requirements
        self.verdict = replace(verdict, safety=self._required.safety)
        self._given: list[Buildable] = []

    def __enter__(self) -> _prepared:
        self.bar = self._bar.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self._bar.__exit__(*error)

    def examine(self, pool: DesignPool) -> None:
        """Say what stops the input designs, and so no kit can mend."""
        self._given = given_verdicts(pool, self.verdict, self._required)
        for line in warning_lines(self._given):
            log.warning("%s", line)

    def tell(self, kit: SizedKit) -> None:
        kit.result.given = [one.to_dict() for one in self._given]
        kit.result.warnings = warning_lines(self._given)
        self.bar.set_postfix_str(
            f"{' + '.join(map(str, kit.sizes.values()))} parts: {kit.max_percent:.3g} %",
            refresh=False,
        )
        self.bar.update()


def _rows(kits: Sequence[SizedKit], cost: KitCost) -> list[dict[str, Any]]:
    """One row a kit size, small to large; of several kits of one size the better one."""
    best: dict[tuple[int, ...], SizedKit] = {}
    for kit in kits:
        key = tuple(kit.sizes.values())
        if key not in best or kit.max_percent < best[key].max_percent:
            best[key] = kit
    found = [kit.row(cost) for kit in best.values()]
    return sorted(found, key=lambda row: (row["parts"], -(row["max %"] or float("inf"))))


def _written(folder: Path, rows: Sequence[Mapping[str, Any]], at: int | None = None) -> bytes:
    """Write the table and the figure; gives the figure's SVG."""
    write_json(folder / "tradeoff.json", {"kits": list(rows), "knee": at}, overwrite=True)
    write_csv(folder / "tradeoff.csv", rows, overwrite=True)
    figure = figure_bytes(draw_tradeoff(rows, "parts", at), "svg")
    write_bytes(folder / "tradeoff.svg", figure, overwrite=True)
    return figure


def _add_table(page: Page, rows: Sequence[Mapping[str, Any]], figure: bytes) -> None:
    kinds = [name for name in rows[0] if name not in _COLUMNS][: list(rows[0]).index("parts")]
    header = [*kinds, *_COLUMNS]
    page.figure(
        figure,
        "Figures of every kit against its number of parts.",
        alt="deviation, kit size, energy, time over the number of parts",
    )
    page.table(header, [[row[name] for name in header] for row in rows], _EXPLAINED)
