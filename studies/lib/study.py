"""The frame that all studies share: arguments, sweep with progress, and a report with its data
beside it.

A study says in its docstring what it tries and on what, lists its tasks, and reports what came of
them:

    study = Study.from_command_line(__doc__, __file__)
    results = study.sweep([Task("a", function, {"size": 3}), ...])
    report = study.report("what came out, in a sentence or two")
    report.figure("name", figure, "caption", alt="what it shows").table("name", rows, "caption")
    report.save({"data": ...})
"""

from __future__ import annotations

import argparse
import logging
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import date
from functools import cached_property
from pathlib import Path
from time import perf_counter
from typing import Any

from matplotlib.figure import Figure
from tqdm import tqdm
from tqdm.contrib.logging import logging_redirect_tqdm

from kop_exudyn.drawing.style import figure_bytes, save_figure, with_palette
from kop_exudyn.files.files import make_folder, write_bytes
from kop_exudyn.files.json_files import read_json, write_json
from kop_exudyn.files.tables import write_csv
from kop_exudyn.provenance import usable_cores
from kop_exudyn.report.environment import environment
from kop_exudyn.report.page import Page
from kop_exudyn.wording import counted

from .sweep import Task, TaskResult, run_sweep
from .sweep_store import SweepStore

_SWEEP = "sweep"
# seconds of the runs so far, so that the report of a resumed study counts them all
_CLOCK = "wall.json"
_LARGEST_SVG = 1_000_000  # bytes: reports are kept in the repository


@dataclass
class Study:
    """One run of a study.

    title, about : of its docstring: the first line, and the paragraphs below the command
    out : folder for everything that it writes
    quick : the smallest settings that show that it works
    jobs : processes; scheduler : address of a Dask scheduler, or None
    resume : keep the results that an interrupted run left in `out`
    redraw : make the page anew from the data beside it, without computing anything; for studies
        that ask for `stored`
    kits_s : seconds that each kit took which several studies share, whether in this run or in an
        earlier one
    """

    title: str
    about: str
    out: Path
    quick: bool = False
    jobs: int = 1
    scheduler: str | None = None
    resume: bool = False
    redraw: bool = False
    results: dict[str, TaskResult] = field(default_factory=dict)
    computed: set[str] = field(default_factory=set)
    kits_s: dict[str, float] = field(default_factory=dict)
    _begin: float = field(default_factory=perf_counter, repr=False)
    _earlier_s: float = field(default=0.0, repr=False)

    @classmethod
    def from_command_line(
        cls,
        doc: str,
        file: str | Path,
        arguments: Sequence[str] | None = None,
        *,
        can_redraw: bool = False,
    ) -> Study:
        """The study of a script: its docstring, its `__file__`, and the arguments (default: the
        program's).

        can_redraw : whether its page needs no more than its data: it then has the option --redraw

        Raises InputError when the folder can't be written to.
        """
        title, about = described(doc)
        script = Path(file).resolve()
        parser = argparse.ArgumentParser(description=title)
        parser.add_argument(
            "--quick", action="store_true", help="the smallest settings that show that it works"
        )
        parser.add_argument(
            "--out",
            type=Path,
            default=script.parents[1] / "reports" / script.stem,
            metavar="DIR",
            help=f"folder for the report and its data (default: reports/{script.stem})",
        )
        parser.add_argument(
            "--jobs",
            type=_positive,
            default=usable_cores(),
            metavar="N",
            help="processes (default: one a core)",
        )
        parser.add_argument(
            "--scheduler", metavar="ADDRESS", help="Dask scheduler whose workers compute the sweep"
        )
        parser.add_argument(
            "--resume", action="store_true", help="go on where an interrupted run stopped"
        )
        if can_redraw:
            parser.add_argument(
                "--redraw",
                action="store_true",
                help="make the page anew from its data.json, with the times and versions there",
            )
        return cls(title, about, **vars(parser.parse_args(arguments))).started()

    def started(self) -> Study:
        """The same study with its folder made ready."""
        make_folder(self.out)
        if self.redraw:
            return self
        clock = self.out / _SWEEP / _CLOCK
        if not self.resume:
            SweepStore(self.out / _SWEEP).clear()
        elif clock.exists():
            self._earlier_s = float(read_json(clock)["wall_s"])
        return self

    @cached_property
    def stored(self) -> Mapping[str, Any] | None:
        """With `redraw`, the data of the report that is there; else None."""
        return read_json(self.out / "data.json") if self.redraw else None

    @property
    def reused(self) -> int:
        """How many of the results were there before this run."""
        return len(self.results.keys() - self.computed)

    @property
    def wall_s(self) -> float:
        """Seconds so far, those of the interrupted runs included."""
        return self._earlier_s + perf_counter() - self._begin

    def sweep(
        self,
        tasks: Sequence[Task],
        *,
        also: Sequence[str | Path] = (),
        jobs: int | None = None,
    ) -> dict[str, Mapping[str, Any]]:
        """Values of all tasks by name: {"failed": why} where a simulation failed. See `run_sweep`.

        also : folders of other sweeps, such as those of other studies; results of the same tasks
            are taken from there
        jobs : processes for this sweep, default: the study's; 1 for tasks that start processes
            themselves
        """
        store = SweepStore(self.out / _SWEEP, also)
        with self._progress(len(tasks)) as bar:

            def observe(result: TaskResult, is_new: bool) -> None:
                self.computed |= {result.name} if is_new else set()
                bar.set_postfix_str(result.name, refresh=False)
                bar.update()
                if is_new:
                    write_json(self.out / _SWEEP / _CLOCK, {"wall_s": self.wall_s}, overwrite=True)

            found = run_sweep(
                tasks, store, jobs=jobs or self.jobs, scheduler=self.scheduler, observer=observe
            )
        self.results |= found
        return {name: result.value for name, result in found.items()}

    def report(self, outcome: str) -> StudyReport:
        """The report's beginning: what was found; then what was tried, and on what."""
        return StudyReport(self, Page(self.title, outcome).text(self.about), outcome)

    @contextmanager
    def _progress(self, total: int) -> Iterator[tqdm]:
        """A bar of tasks on standard error, where that is a terminal; log messages appear above
        it."""
        logging.basicConfig(format="%(name)s: %(message)s", level=logging.WARNING)
        with (
            logging_redirect_tqdm(),
            tqdm(total=total, unit=" tasks", desc=self.title[:40], disable=None) as bar,
        ):
            yield bar


@dataclass
class StudyReport:
    """A report that is filled from top to bottom; its figures and tables are files beside the page
    as well. What was found stands in its data, too, from where the page of all reports has it."""

    study: Study
    page: Page
    finding: str = ""

    def section(self, heading: str, text: str = "") -> StudyReport:
        self.page.section(heading, text)
        return self

    def text(self, text: str) -> StudyReport:
        self.page.text(text)
        return self

    def figure(
        self, name: str, figure: Figure, caption: str, *, alt: str, colours: int | None = 256
    ) -> StudyReport:
        """A figure, in the page as pixels, beside it as NAME.pdf and, unless it is too large for
        that, NAME.svg.

        colours : of the pixels; None: all, for renderings, which are in the page only
        """
        pixels = figure_bytes(figure, "png")
        if colours is not None:
            self._drawing(name, figure)
            pixels = with_palette(pixels, colours)
        self.page.figure(pixels, caption, alt=alt, suffix="png")
        return self

    def _drawing(self, name: str, figure: Figure) -> None:
        save_figure(figure, self.study.out / name, ("pdf",), overwrite=True)
        drawing = figure_bytes(figure, "svg")
        if len(drawing) <= _LARGEST_SVG:
            write_bytes(self.study.out / f"{name}.svg", drawing, overwrite=True)

    def table(self, name: str, rows: Sequence[Mapping[str, Any]], caption: str = "") -> StudyReport:
        """A table of rows with the same keys, beside the page as NAME.csv."""
        headings = list(rows[0])
        write_csv(self.study.out / f"{name}.csv", rows, overwrite=True)
        self.page.table(headings, [[row[key] for key in headings] for row in rows], caption)
        return self

    def save(self, data: Mapping[str, Any], settings: Mapping[str, Any] | None = None) -> Path:
        """Write data.json and index.html, with settings, versions, machine and times at the end;
        the page's path.

        settings : of the study; default: those of its tasks

        Of a page that is drawn anew, settings, times, versions and machine are those of the data.
        """
        study = self.study
        made = {
            "settings": settings
            or {name: result.described for name, result in study.results.items()},
            "times": {
                "wall_s": study.wall_s,
                "tasks": len(study.results),
                "tasks_s": sum(result.seconds for result in study.results.values()),
                "reused": study.reused,
                "kits_s": study.kits_s,
            },
            "environment": environment(),
        }
        if study.stored is not None:
            made = {name: study.stored[name] for name in made}
            made["redrawn"] = date.today().isoformat()
        write_json(
            study.out / "data.json",
            {
                "study": study.title,
                "quick": study.quick if study.stored is None else study.stored["quick"],
                "finding": self.finding,
                **data,
                **made,
            },
            overwrite=True,
        )
        self.page.section("How it was made", self._times(made))
        self.page.details("Settings", made["settings"])
        self.page.details("Versions and machine", made["environment"])
        return self.page.save(study.out / "index.html", overwrite=True)

    def _times(self, made: Mapping[str, Any]) -> str:
        times, kits_s = made["times"], made["times"].get("kits_s") or {}
        setting = "Quick settings" if self.study.quick else "Full settings"
        sweep = (
            f"; {counted(times['tasks'], 'task')} of {times['tasks_s']:.0f} s in all"
            if times["tasks"]
            else ""
        )
        reused = f", {times['reused']} of them computed earlier" if times.get("reused") else ""
        kits = (
            f" Its {len(kits_s)} kits took {sum(kits_s.values()):.0f} s, once for all studies that "
            "look at them."
            if kits_s
            else ""
        )
        redrawn = (
            f" The page was drawn anew from these numbers on {made['redrawn']}."
            if "redrawn" in made
            else ""
        )
        return (
            f"{setting}, {times['wall_s']:.0f} s of wall time on {made['environment']['cores']} "
            f"cores{sweep}{reused}.{kits} Drawings are beside this page as PDF files, the smaller "
            f"ones as SVG too, its numbers in data.json and CSV files.{redrawn}"
        )


def described(doc: str) -> tuple[str, str]:
    """Title and text of a study's docstring: its first line, and its paragraphs without the
    indented commands."""
    title, *paragraphs = doc.strip().split("\n\n")
    texts = [" ".join(p.split()) for p in paragraphs if not p.startswith("    ")]
    return title.strip().rstrip("."), "\n\n".join(texts)


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a positive number")
    return value
