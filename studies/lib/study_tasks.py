"""Tasks of the studies' sweeps: they read designs from files, and give plain data (see
`kop_exudyn.analysis.sweep`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from kop_exudyn.io.designs import load_design
from kop_exudyn.kit.parts import Kit
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.settings import StageSettings

from .new_design import project_design
from .slits import optimised_kit, slit_kit

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
    # these two are the published method's as well, which takes its steps whatever is said above
    last_tolerance=0.1,
    assigned_tolerance=0.1,
    requirements=Requirements(samples=0),
)


def project_task(
    file: Path, kit: Mapping[str, Any], factor: float, stages: Mapping[str, Any]
) -> dict[str, Any]:
    """See `project_design`; the kit as plain data."""
    return project_design(load_design(file), Kit.from_dict(kit), factor, stages_of(stages))


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


def stages_of(plain: Mapping[str, Any]) -> StageSettings:
    """Settings from the plain data of a task: those that aren't the default ones."""
    given = dict(plain)
    if "requirements" in given:
        given["requirements"] = Requirements(**given["requirements"])
    return StageSettings(**given)
