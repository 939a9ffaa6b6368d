"""Tasks of the studies' sweeps: they read designs from files, and give plain data (see
`kop_exudyn.analysis.sweep`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from kop_exudyn.errors import SimulationFailure
from kop_exudyn.io.datasets import select_files
from kop_exudyn.io.designs import load_design
from kop_exudyn.kit.parts import Kit
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.settings import StageSettings

from .kit_search import find_kit, stages_of
from .new_design import project_design
from .slits import optimised_kit, slit_kit
from .study import Study
from .sweep import Task

# the sweep has ten kits, and each goes on from the one before
FULL = StageSettings(reassignments=2, leaps=0)
SIZES = (2, 3, 4, 6, 8, 10, 12, 16, 20, 25)
QUICK = StageSettings(
    schedule=(1e3, 1e5),
    relaxed_steps=2,
    round_steps=2,
    reassignments=1,
    leaps=0,
    path_steps=2,
    restarts=5,
    effort="quick",
    levelling=0,
    requirements=Requirements(samples=0),
)


def size_tasks(
    files: Sequence[Path],
    sizes: Sequence[int],
    others: Mapping[str, int],
    stages: StageSettings,
    jobs: int,
    kind: str = "linear",
) -> list[Task]:
    """Kits of fewer and fewer parts of one kind, each starting from the one before.

    files : of the designs; sizes : numbers of parts of that kind; others : kind -> number of parts,
        always the same
    """
    tasks: list[Task] = []
    for size in sorted(sizes, reverse=True):
        settings = {
            "files": list(files),
            "parts": {kind: size, **others},
            "stages": changed(stages),
        }
        tasks.append(
            Task(
                f"{size} {kind} parts",
                kit_task,
                settings,
                {"jobs": jobs},
                after=tasks[-1].name if tasks else None,
            )
        )
    return tasks


def kit_task(
    files: Sequence[Path],
    parts: Mapping[str, int],
    stages: Mapping[str, Any],
    jobs: int,
    before: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """See `find_kit`; it starts from the result of the task before, if there is one."""
    start = None if before is None else before["realised"]
    return find_kit([load_design(file) for file in files], parts, stages_of(stages), start, jobs)


def project_task(
    file: Path, factor: float, stages: Mapping[str, Any], before: Mapping[str, Any] | None
) -> dict[str, Any]:
    """See `project_design`, with the kit that the task before found. SimulationFailure where it
    found none."""
    if before is None:
        raise SimulationFailure("there is no kit to project onto")
    return project_design(
        load_design(file), Kit.from_dict(before["kit"]), factor, stages_of(stages)
    )


def slit_task(files: Sequence[Path], parts: int, penalty: float | None) -> dict[str, Any]:
    """See `slit_kit`."""
    return slit_kit([load_design(file) for file in files], parts, penalty)


def slit_search_task(
    files: Sequence[Path],
    kind: str,
    parts: int,
    corners: int,
    stages: Mapping[str, Any],
    jobs: int,
) -> dict[str, Any]:
    """See `optimised_kit`."""
    designs = [load_design(file) for file in files]
    return optimised_kit(designs, kind, parts, corners, stages_of(stages), jobs)


def changed(stages: StageSettings) -> dict[str, Any]:
    """The settings that aren't the default ones, as plain data."""
    usual = asdict(StageSettings())
    return {name: value for name, value in asdict(stages).items() if value != usual[name]}


def shared_kits(
    study: Study, models: Path, also: Sequence[Path] = ()
) -> tuple[list[Task], dict[int, Task]]:
    """The kits of the trade-off study, which other studies look at as well: five C-shells, or two
    small ones.

    Down from the largest kit every one starts from the next larger one. Then, up from the smallest,
    a kit that is worse than a smaller one is sought again from there: what few parts can do, more
    can do as well.

    also : folders of other sweeps that may have the results

    Returns all tasks, and by number of linear parts, the smallest first, the task with the better
    kit.
    """
    jobs = 1 if study.scheduler else study.jobs  # workers of a cluster start no processes
    if study.quick:
        tasks = size_tasks(
            select_files(models / "small", 2), (2, 3, 5), {"angular": 2}, QUICK, jobs
        )
    else:
        tasks = size_tasks(
            select_files(models / "conformals", 5), SIZES, {"angular": 5}, FULL, jobs
        )
    found = study.sweep(tasks, also=also, jobs=1)
    best: dict[int, Task] = {}
    smaller: Task | None = None
    for task in reversed(tasks):
        if smaller is not None and _objective(found[smaller.name]) < _objective(found[task.name]):
            again = Task(
                f"{task.name} from {smaller.name}",
                kit_task,
                task.settings,
                task.options,
                after=smaller.name,
            )
            tasks = [*tasks, again]
            found = study.sweep(tasks, also=also, jobs=1)
            task = min(task, again, key=lambda one: _objective(found[one.name]))
        best[task.settings["parts"]["linear"]] = smaller = task
    return tasks, best


def _objective(found: Mapping[str, Any]) -> float:
    value = found.get("objective")
    return float("inf") if value is None else value
