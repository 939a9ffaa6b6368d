"""Checkpoints: a folder of named arrays, and the record of the job that they belong to."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, OccupiedError
from ..files.arrays import load_arrays, save_arrays, sealed, unsealed
from ..files.documents import check_envelope
from ..files.files import is_temporary, make_folder, read_bytes
from ..files.json_files import plain, read_json, write_json
from ..provenance import __version__, code_digest

CHECKPOINT_VERSION = 1
_JOB_FILE = "job.json"
_CODE = "code"
_NAME = re.compile(r"[A-Za-z0-9_.+-]+")


@dataclass(frozen=True)
class Job:
    """What a run computes: two runs of the same job give the same result.

    settings : plain data, as JSON has it
    inputs : name -> SHA-256 of the content of every input file
    """

    settings: Mapping[str, Any]
    inputs: Mapping[str, str]

    @classmethod
    def of(cls, settings: Mapping[str, Any], files: Iterable[str | Path]) -> Job:
        """The job of these settings (numbers, texts, lists, mappings) and input files, told apart
        by their names."""
        return cls(
            {"kop_exudyn": __version__, _CODE: code_digest(), **plain(settings)},
            {Path(path).name: hashlib.sha256(read_bytes(path)).hexdigest() for path in files},
        )

    def difference(self, other: Job, *, code: bool = True) -> str | None:
        """The first thing in which the jobs differ, in words; None when they are the same.

        other : the later one
        code : whether jobs that were run by different sources of this package differ
        """
        mine, theirs = _flat(self.settings), _flat(other.settings)
        if mine.pop(_CODE, None) != theirs.pop(_CODE, None) and code:
            return "kop_exudyn itself has changed since"
        for name in [*mine, *theirs]:
            if mine.get(name) != theirs.get(name):
                return f"{name} was {_shown(mine, name)} and is now {_shown(theirs, name)}"
        for name in [*self.inputs, *other.inputs]:
            if self.inputs.get(name) != other.inputs.get(name):
                changed = name in self.inputs and name in other.inputs
                what = "has changed" if changed else "belongs to one of them only"
                return f"the input file {name} {what}"
        if list(self.inputs) != list(other.inputs):
            return "the input files have another order"
        return None

    def to_dict(self) -> dict[str, Any]:
        return {
            "format": "kop_exudyn/job",
            "version": CHECKPOINT_VERSION,
            "settings": dict(self.settings),
            "inputs": dict(self.inputs),
        }

    @classmethod
    def load(cls, path: str | Path) -> Job:
        """The job that `to_dict` described in a file."""
        data = read_json(path)
        check_envelope(data, "job", CHECKPOINT_VERSION, source=path)
        if not isinstance(data.get("settings"), dict) or not isinstance(data.get("inputs"), dict):
            raise InputError("expected settings and inputs", source=path)
        return cls(data["settings"], data["inputs"])


class CheckpointStore:
    """Named sets of arrays in a folder, each saved in one go: a run killed at any moment leaves the
    last whole one.

    Make it with `open`, which sees to it that the folder's checkpoints belong to the job at hand.
    """

    def __init__(self, folder: Path):
        self.folder = folder

    @classmethod
    def open(cls, folder: str | Path, job: Job, *, resume: bool = False) -> CheckpointStore:
        """Checkpoints for a job: with `resume` those that are there, otherwise none (older ones are
        removed).

        Raises InputError when the folder can't be written, or when it is to be resumed but belongs
        to another job.
        """
        folder = make_folder(folder)
        for left in filter(is_temporary, list(folder.iterdir())):
            left.unlink(missing_ok=True)
        record = folder / _JOB_FILE
        if resume and record.exists():
            difference = Job.load(record).difference(job)
            if difference is not None:
                raise OccupiedError(
                    f"can't resume, the checkpoints belong to a different job: {difference}",
                    source=folder,
                )
            return cls(folder)
        store = cls(folder)
        store.clear()
        write_json(record, job.to_dict(), overwrite=True)
        return store

    def load(self, name: str) -> dict[str, np.ndarray] | None:
        """The arrays saved under a name, None when there are none. InputError when the file is
        damaged: a run that went on from changed numbers would end in another kit."""
        path = self._path(name)
        return unsealed(load_arrays(path), path) if path.exists() else None

    def save(self, name: str, arrays: Mapping[str, np.ndarray]) -> None:
        """Keep arrays under a name, in place of those before."""
        save_arrays(self._path(name), sealed(arrays), overwrite=True)

    def names(self) -> list[str]:
        """What is kept, sorted."""
        return sorted(path.stem for path in self.folder.glob("*.npz"))

    def clear(self) -> None:
        """Forget all checkpoints; other files in the folder stay."""
        for name in self.names():
            self._path(name).unlink()

    def _path(self, name: str) -> Path:
        if not _NAME.fullmatch(name):
            raise ValueError(f"not a name for a checkpoint: {name!r}")
        return self.folder / f"{name}.npz"


def _flat(settings: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested settings by dotted name."""
    found: dict[str, Any] = {}
    for name, value in settings.items():
        found |= (
            _flat(value, f"{prefix}{name}.")
            if isinstance(value, Mapping)
            else {f"{prefix}{name}": value}
        )
    return found


def _shown(settings: Mapping[str, Any], name: str) -> str:
    return repr(settings[name]) if name in settings else "not given"
