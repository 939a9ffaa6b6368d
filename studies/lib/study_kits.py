"""The kits that several studies look at: one of each class, computed once and kept beside the
reports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from kop_exudyn.errors import InputError
from kop_exudyn.io.checkpoint import Job
from kop_exudyn.io.datasets import load_designs, select_files
from kop_exudyn.io.saved_runs import load_run
from kop_exudyn.report.kit_run import optimize_and_report, within_workshop
from kop_exudyn.search.result import KitResult
from kop_exudyn.search.run import described_job
from kop_exudyn.search.settings import JobSettings, StageSettings

from .study import Study

QUICK_STAGES = StageSettings(
    relaxed_steps=1,
    assigned_steps=1,
    round_steps=1,
    reassignments=0,
    path_steps=2,
    rescues=0,
    restarts=2,
)


@dataclass(frozen=True)
class KitCase:
    """What a kit is asked for.

    name : of the class, as a reader knows it
    folder : of design files; number : of them, in order of their names (None: all)
    parts : kind -> number of parts
    baselines : whether the unrelaxed baseline is computed as well
    """

    name: str
    folder: Path
    number: int | None
    parts: Mapping[str, int]
    stages: StageSettings = StageSettings()
    baselines: bool = True

    @property
    def files(self) -> list[Path]:
        return select_files(self.folder, self.number)


def three_classes(models: Path, quick: bool = False) -> list[KitCase]:
    """C-shells, grids and umbrella meshes of the repository's models; quick: one design each and
    hardly any steps."""
    stages = QUICK_STAGES if quick else StageSettings()
    beams = {"linear": 12, "angular": 5}
    return [
        KitCase("C-shells", models / "conformals", 1 if quick else 3, beams, stages),
        KitCase("grids", models / "grids", 1 if quick else None, beams, stages),
        KitCase("umbrella meshes", models / "umbrellas", 1 if quick else None, {"cell": 8}, stages),
    ]


def kits(study: Study, models: Path) -> dict[str, KitResult]:
    """The kits of the three classes by name."""
    cases = three_classes(models, study.quick)
    found = {case.name: kit_of(case, run_folder(case, study), study.jobs) for case in cases}
    study.kits_s |= {name: result.wall_s for name, result in found.items()}
    return found


def run_folder(case: KitCase, study: Study) -> Path:
    """Where the run of a case is kept: beside all reports, for all studies that look at it."""
    return (
        study.out.parent / ("quick_runs" if study.quick else "runs") / case.name.replace(" ", "_")
    )


def kit_of(case: KitCase, folder: Path, jobs: int) -> KitResult:
    """The kit of a case: a finished run of the same job in its folder, or a new run, which goes on
    from checkpoints.

    Raises InputError and SimulationFailure as `optimize_and_report` does.
    """
    designs, files = load_designs(case.folder, case.number), case.files
    settings = within_workshop(
        designs, JobSettings(stages=case.stages, jobs=jobs, baselines=case.baselines)
    )
    record = folder / "checkpoints" / "job.json"
    job = Job.of(described_job(designs, case.parts, None, settings), files)
    same = record.exists() and Job.load(record).difference(job) is None
    if same and (folder / "result.json").exists():
        try:
            return load_run(folder, designs)
        except InputError:  # a result of an earlier version: computed anew
            same = False
    (folder / "result.json").unlink(missing_ok=True)
    return optimize_and_report(
        designs,
        case.parts,
        out=folder,
        settings=settings,
        inputs=files,
        resume=same,
        overwrite=True,
    )
