"""The kits that several studies look at: one of each class, computed once and kept beside the
reports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from kop_exudyn.analysis.verdict import VerdictSettings
from kop_exudyn.errors import InputError
from kop_exudyn.io.checkpoint import Job
from kop_exudyn.io.datasets import select_files
from kop_exudyn.io.designs import load_design
from kop_exudyn.io.saved_runs import load_run
from kop_exudyn.report.kit_run import optimize_and_report, within_workshop
from kop_exudyn.search.job import described_job
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.result import KitResult
from kop_exudyn.search.settings import JobSettings, StageSettings

from .study import Study
from .study_tasks import QUICK

RELEASED = ("saddle_5t", "hemisphere_5t", "lilium", "sphere_cap_0.3")
QUICK_STAGES = replace(
    QUICK,
    schedule=(1e4,),
    assigned_steps=3,
    round_steps=1,
    reassignments=0,
    leaps=StageSettings.leaps,  # none without rounds
    rescues=0,
    restarts=2,
    requirements=Requirements(samples=2),
)
QUICK_VERDICT = VerdictSettings(samples=2)


@dataclass(frozen=True)
class KitCase:
    """What a kit is asked for.

    name : of the class or data set, as a reader knows it
    files : of the designs
    parts : kind -> number of parts
    baselines : whether the unrelaxed baseline is computed as well
    published : whether the published method is run as well, for comparison
    verdict : samples of its verdicts
    """

    name: str
    files: Sequence[Path]
    parts: Mapping[str, int]
    stages: StageSettings = StageSettings()
    baselines: bool = True
    published: bool = False
    verdict: VerdictSettings = VerdictSettings()


def three_classes(models: Path, quick: bool = False) -> list[KitCase]:
    """C-shells, grids and umbrella meshes of the repository's models, with the published method
    beside; quick: one design each, a small one, and hardly any steps."""
    stages = QUICK_STAGES if quick else StageSettings()
    verdict = QUICK_VERDICT if quick else VerdictSettings()
    beams = {"linear": 12, "angular": 5}

    def files(folder: str, number: int | None = None) -> list[Path]:
        return select_files(models / folder, 1 if quick else number)

    shells = files("small") if quick else files("conformals", 3)
    asked = [
        ("C-shells", shells, beams),
        ("grids", files("grids"), beams),
        ("umbrella meshes", files("umbrellas"), {"cell": 8}),
    ]
    # one study compares with the published method, others look at the same runs
    return [KitCase(*case, stages, published=True, verdict=verdict) for case in asked]


def data_sets(models: Path, released: Path, quick: bool = False) -> list[KitCase]:
    """As many designs as were published, and more, of outlines and curvatures that differ.

    released : folder of the published umbrella meshes; their set is left out where they aren't at
        hand
    quick : one design each and hardly any steps
    """
    stages = QUICK_STAGES if quick else StageSettings()
    count = 1 if quick else None
    shells = [
        *select_files(models / "conformals", count or 5),
        *select_files(models / "patches", count or ["fan", "hexagon", "ring", "skew", "triangle"]),
    ]
    grids = [
        *select_files(models / "grids", count),
        *([] if quick else select_files(models / "grids_hard")),
    ]
    beams = {"linear": 8, "angular": 5}
    large = select_files(models / "umbrellas" if quick else models / "umbrellas_large", count)
    conformal = select_files(models / "conformals", count)
    cases = [
        *([] if quick else [KitCase("ten conformal C-shells", conformal, beams, stages)]),
        KitCase("nine grids", grids, beams, stages),
        KitCase("large umbrella meshes", large, {"cell": 8}, stages),
    ]
    published = [released / f"{name}.json.gz" for name in RELEASED]
    if not quick and all(file.is_file() for file in published):
        cases.append(KitCase("released umbrella meshes", published, {"cell": 8}, stages))
    # last, as it takes longest: the report is written after every set
    cases.append(KitCase("ten C-shells of all outlines", shells, beams, stages))
    return cases


def kits(study: Study, models: Path) -> dict[str, KitResult]:
    """The kits of the three classes by name."""
    return kits_of(study, three_classes(models, study.quick))


def kits_of(study: Study, cases: Sequence[KitCase]) -> dict[str, KitResult]:
    """The kits of several cases by name."""
    found = {case.name: kit_of(case, run_folder(case.name, study), study.jobs) for case in cases}
    study.kits_s |= {name: result.wall_s for name, result in found.items()}
    return found


def run_folder(name: str, study: Study) -> Path:
    """Where the run of a case of that name is kept: beside all reports, for all studies that look
    at it."""
    return study.out.parent / ("quick_runs" if study.quick else "runs") / name.replace(" ", "_")


def is_run_of(folder: Path, job: Job) -> bool:
    """Whether a folder has the checkpoints of this very job."""
    record = folder / "checkpoints" / "job.json"
    return record.exists() and Job.load(record).difference(job) is None


def kit_of(case: KitCase, folder: Path, jobs: int) -> KitResult:
    """The kit of a case: a finished run of the same job in its folder, or a new run, which goes on
    from checkpoints.

    Raises InputError and SimulationFailure as `optimize_and_report` does.
    """
    designs, files = [load_design(file) for file in case.files], list(case.files)
    settings = within_workshop(
        designs,
        JobSettings(
            stages=case.stages, jobs=jobs, baselines=case.baselines, published=case.published
        ),
    )
    same = is_run_of(folder, Job.of(described_job(designs, case.parts, None, settings), files))
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
        verdict=case.verdict,
    )
