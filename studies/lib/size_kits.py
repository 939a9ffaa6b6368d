"""Kits of many sizes for the same designs, computed once by what `kop tradeoff` calls, and kept
beside the reports for all studies that look at them; and what other methods make of as many
parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kop_exudyn.errors import SimulationFailure
from kop_exudyn.files.json_files import read_json
from kop_exudyn.io.datasets import select_files
from kop_exudyn.io.designs import load_design
from kop_exudyn.io.saved_runs import load_run
from kop_exudyn.report.sizes_run import tradeoff_and_report, tradeoff_job
from kop_exudyn.search.checkpoints import NoStore
from kop_exudyn.search.dataset import Dataset
from kop_exudyn.search.evaluation import Evaluation
from kop_exudyn.search.pool import DesignPool
from kop_exudyn.search.published import published_method
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.result import KitResult, summary_of
from kop_exudyn.search.settings import JobSettings, StageSettings
from kop_exudyn.search.stages import Stages
from kop_exudyn.search.weights import Weights
from kop_exudyn.structures.base import Design

from .study import Study
from .study_kits import is_run_of, run_folder
from .study_tasks import QUICK, changed, stages_of
from .sweep import Task

# many kits, each of which goes on from a neighbour: fewer rounds than one from scratch
FULL = StageSettings(reassignments=2, leaps=0)


@dataclass(frozen=True)
class SizedCase:
    """Designs whose kits are sought in several sizes.

    name : as a reader knows them
    files : of the designs
    kind, sizes : what there is more and more of, and how many
    others : kind -> number of parts, always the same
    compared : sizes at which the other methods are run as well
    """

    name: str
    files: Sequence[Path]
    kind: str
    sizes: Sequence[int]
    others: Mapping[str, int]
    compared: Sequence[int]

    def parts(self, size: int) -> dict[str, int]:
        """Kind -> number of parts."""
        return {self.kind: size, **self.others}


@dataclass(frozen=True)
class KeptKit:
    """A kit of one size: figures as `kop tradeoff` has them, and the result of its search."""

    size: int
    row: Mapping[str, Any]
    result: KitResult

    def pieces(self) -> list[dict[str, list[int]]]:
        """By design: kind -> how many pieces of each part."""
        return [
            {kind: counts.tolist() for kind, counts in own.items()} for own in self.result.pieces()
        ]


def sized_cases(models: Path, quick: bool = False) -> list[SizedCase]:
    """The classes of the repository's models, C-shells first; quick: two small shells."""
    if quick:
        small = select_files(models / "small", 2)
        return [SizedCase("small C-shells", small, "linear", (2, 3), {"angular": 2}, (3,))]
    few = (1, 2, 3, 4, 6, 8, 12)
    shells = select_files(models / "conformals", 5)
    grids, umbrellas = (select_files(models / name) for name in ("grids", "umbrellas"))
    return [
        SizedCase(
            "five C-shells", shells, "linear", (2, 3, 4, 6, 8, 12, 25), {"angular": 5}, (2, 6, 12)
        ),
        SizedCase("umbrella meshes", umbrellas, "cell", few, {}, (1, 4, 12)),
        SizedCase("grids", grids, "linear", few, {"angular": 5}, (1, 4, 12)),
    ]


def kits_by_size(study: Study, case: SizedCase) -> list[KeptKit]:
    """The kits of a case, the smallest first: those of a finished run of the same job, or of a new
    run, which goes on from checkpoints."""
    folder = run_folder(f"{case.name} by size", study)
    designs, files = [load_design(file) for file in case.files], list(case.files)
    stages = QUICK if study.quick else FULL
    settings = JobSettings(stages=stages, jobs=study.jobs, baselines=False)
    sizes = [case.parts(size) for size in case.sizes]
    page = folder / "index.html"  # which is written last
    same = is_run_of(folder, tradeoff_job(designs, sizes, settings=settings, inputs=files))
    if not (same and page.exists()):
        page.unlink(missing_ok=True)
        tradeoff_and_report(
            designs,
            sizes,
            out=folder,
            settings=settings,
            inputs=files,
            resume=same,
            overwrite=True,
        )
    rows = read_json(folder / "tradeoff.json")["kits"]
    study.kits_s |= {f"{case.name}, {row[case.kind]}": row["seconds"] for row in rows}
    return [KeptKit(row[case.kind], row, _kept(folder, case, row, designs)) for row in rows]


def _kept(
    folder: Path, case: SizedCase, row: Mapping[str, Any], designs: Sequence[Design]
) -> KitResult:
    names = [f"{count}_{kind}" for kind, count in case.parts(row[case.kind]).items()]
    return load_run(folder / "-".join(names), designs)


def compared_tasks(study: Study, case: SizedCase) -> dict[int, Task]:
    """By size, the task that runs the other methods."""
    stages = QUICK if study.quick else FULL
    jobs = 1 if study.scheduler else study.jobs  # workers of a cluster start no processes
    return {
        size: Task(
            f"{case.name}, {size} parts by other methods",
            compared_task,
            {"files": list(case.files), "parts": case.parts(size), "stages": changed(stages)},
            {"jobs": jobs},
        )
        for size in case.compared
    }


def compared_task(
    files: Sequence[Path], parts: Mapping[str, int], stages: Mapping[str, Any], jobs: int
) -> dict[str, Any]:
    """The largest deviation of any design, % of its size, as the designs open from their assembly
    (None where one doesn't): of the direct projection and of the published method."""
    designs, settings = [load_design(file) for file in files], stages_of(stages)
    with DesignPool(designs, jobs) as pool:
        pool.prepare()
        dataset = Dataset.of_pool(pool, Weights.suiting(designs))
        own = Stages(
            dataset, parts, StageSettings(requirements=Requirements.none(), bounds=settings.bounds)
        )
        direct = own.redeployed(own.direct())
        published = published_method(dataset, parts, settings, NoStore())
    return {
        "direct": _largest(designs, dataset, direct),
        "published": _largest(designs, dataset, published.opened.designs),
        "published seconds": published.seconds,
    }


def _largest(
    designs: Sequence[Design],
    dataset: Dataset,
    opened: Sequence[Evaluation | SimulationFailure],
) -> float | None:
    """Of all designs' joints."""
    found = [
        summary_of(outcome, design, reference)
        for design, reference, outcome in zip(designs, dataset.references, opened)
    ]
    if any("failed" in one for one in found):
        return None
    return float(max(one["fit"]["max_percent"] for one in found))
