"""Study files: TOML in the format "kop_exudyn/study", which says for what designs a kit is sought,
and how."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..analysis.verdict import VerdictSettings
from ..errors import InputError
from ..files.documents import check_envelope, check_range, check_schema
from ..files.files import as_path, read_bytes
from ..kit.kinds import Bounds, part_kind
from ..search.requirements import Requirements
from ..search.settings import JobSettings, StageSettings
from ..search.weights import Weights
from ..structures.base import Design
from .designs import design_files, load_all, select_among

STUDY_VERSION = 1
_SIZE_LIMIT = 4 * 2**20  # bytes: a study is a page of text
STUDY_SUFFIX = ".toml"


@dataclass(frozen=True)
class Study:
    """What a kit is sought for.

    source : the study's file, or a folder of designs
    files : of the designs, in order
    parts : kind -> number of parts; empty where nothing is said about them
    weights : those of the objective's terms that are given
    counts : how much each design counts, like `files`
    settings : of the stages
    baselines : whether the unrelaxed baseline is computed
    verdict : tolerances that the designs have to forgive, and with how many samples
    """

    source: Path
    files: tuple[Path, ...]
    parts: Mapping[str, int] = field(default_factory=dict)
    weights: Mapping[str, float] = field(default_factory=dict)
    counts: tuple[float, ...] = ()
    settings: StageSettings = StageSettings()
    baselines: bool = True
    verdict: VerdictSettings = VerdictSettings()

    def designs(self) -> list[Design]:
        """The designs; raises InputError as `load_designs`."""
        return load_all(self.files, self.source)

    def job_settings(
        self, designs: Sequence[Design], jobs: int, scheduler: str | None = None
    ) -> JobSettings:
        """Settings of a job for these designs, which are the study's own, with that many
        processes, or the workers of a Dask scheduler."""
        weights = Weights.suiting(designs, self.weights) if self.weights else None
        counts = self.counts if set(self.counts) - {1.0} else None
        return JobSettings(
            weights, counts, self.settings, jobs, self.baselines, scheduler=scheduler
        )


def load_study(path: str | Path, select: int | Sequence[str] | None = None) -> Study:
    """The study of a TOML file, or of all designs of a folder with the usual settings.

    select : of the designs, as for `load_designs`

    Raises InputError naming the file, the field and the value when anything is wrong; designs
    aren't read yet.
    """
    path = as_path(path)
    study = _from_file(path) if is_study(path) else Study(path, tuple(design_files(path)))
    files = tuple(select_among(study.files, select, path))
    counts = dict(zip(study.files, study.counts or (1.0,) * len(study.files)))
    return Study(
        path,
        files,
        study.parts,
        study.weights,
        tuple(counts[file] for file in files),
        study.settings,
        study.baselines,
        study.verdict,
    )


def is_study(path: str | Path) -> bool:
    """Whether this would be a study's file, and no folder of designs."""
    path = as_path(path)
    return path.suffix.lower() == STUDY_SUFFIX and not os.path.isdir(path)


def _from_file(path: Path) -> Study:
    data = _read_toml(path)
    check_envelope(data, "study", STUDY_VERSION, source=path)
    check_range(data, source=path)
    check_schema(data, "study", source=path)
    weights = data.get("weights", {})
    if weights.get("fit") == 0 and weights.get("energy") == 0:
        raise InputError(
            "fit and energy can't both be 0", source=path, field="weights", value=weights
        )
    try:
        Weights.of(weights)
    except InputError as error:
        raise error.at(path) from None
    counts = _files(data["designs"], path)
    settings = dict(data.get("settings", {}))
    errors = {k: v for k, v in data.get("tolerance", {}).items() if k in ("length", "angle")}
    settings["requirements"] = Requirements(**errors, **data.get("requirements", {}))
    if "schedule" in settings:
        settings["schedule"] = tuple(settings["schedule"])
    if "bounds" in settings:
        try:
            settings["bounds"] = _bounds(settings["bounds"])
        except InputError as error:
            raise error.at(path) from None
    return Study(
        path,
        tuple(counts),
        data.get("parts", {}),
        weights,
        tuple(counts.values()),
        StageSettings(**settings),
        data.get("baselines", True),
        VerdictSettings(**data.get("tolerance", {})),
    )


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(read_bytes(path, _SIZE_LIMIT).decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise InputError(f"not UTF-8 text (byte {error.start})", source=path) from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"not TOML: {error}", source=path) from None
    except InputError:
        raise
    except ValueError:  # an integer of thousands of digits
        raise InputError("contains a number with too many digits", source=path) from None


def _files(entries: Sequence[str | Mapping[str, Any]], path: Path) -> dict[Path, float]:
    """Design files with their weights, in order; folders stand for all designs in them."""
    found: dict[Path, float] = {}
    for n, entry in enumerate(entries):
        name, weight = (
            (entry, 1.0)
            if isinstance(entry, str)
            else (entry["file"], float(entry.get("weight", 1.0)))
        )
        place = path.parent / name
        if not os.path.exists(place):
            raise InputError(
                "no such file or folder", source=path, field=f"designs[{n}]", value=name
            )
        for file in design_files(place) if os.path.isdir(place) else [place]:
            if file.name in {other.name for other in found}:
                raise InputError(
                    "two design files have the same name",
                    source=path,
                    field=f"designs[{n}]",
                    value=file.name,
                )
            found[file] = weight
    return found


def _bounds(data: Mapping[str, Mapping[str, Any]]) -> Bounds:
    """By kind (lower, upper); what isn't given is no bound. Raises InputError."""
    for kind, given in data.items():
        names = part_kind(kind).parameter_names
        for side, values in given.items():
            if isinstance(values, list) and len(values) != len(names):
                raise InputError(
                    f"expected one number, or {len(names)} ({', '.join(names)})",
                    field=f"settings.bounds.{kind}.{side}",
                    value=values,
                )
    return {
        kind: tuple(
            np.array(given.get(side, none), float)
            for side, none in (("lower", -np.inf), ("upper", np.inf))
        )
        for kind, given in data.items()
    }
