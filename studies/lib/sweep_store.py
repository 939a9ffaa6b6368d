"""Results of a sweep as files: one JSON file a task, written in one go as soon as the task has
ended."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from kop_exudyn.files.documents import check_envelope
from kop_exudyn.files.files import is_temporary, make_folder
from kop_exudyn.files.json_files import plain, read_json, write_json

from .sweep import TaskResult

TASK_VERSION = 1
_UNSAFE = re.compile(r"[^A-Za-z0-9_.+-]+")


class SweepStore:
    """Results in a folder, as NAME-DIGEST.json; looks in other folders as well for what other
    sweeps have computed.

    folder : is made when the first result is kept
    also : further folders, which are only read
    """

    def __init__(self, folder: str | Path, also: Sequence[str | Path] = ()):
        self.folder, self.also = Path(folder), tuple(map(Path, also))

    def load(self, name: str, digest: str) -> TaskResult | None:
        """The result of a task, None when there is none. InputError when its file is damaged."""
        for folder in (self.folder, *self.also):
            path = folder / _file_name(name, digest)
            if path.exists():
                data = read_json(path)
                check_envelope(data, "task", TASK_VERSION, source=path)
                return TaskResult(name, digest, data["value"], data["seconds"], data["described"])
        return None

    def save(self, result: TaskResult) -> TaskResult:
        """Keep a result in place of one with the same digest; returned as it will be loaded (arrays
        as lists)."""
        make_folder(self.folder)
        data = {"format": "kop_exudyn/task", "version": TASK_VERSION, **plain(asdict(result))}
        write_json(self.folder / _file_name(result.name, result.digest), data, overwrite=True)
        return TaskResult(
            result.name, result.digest, data["value"], data["seconds"], data["described"]
        )

    def clear(self) -> None:
        """Forget the results in the store's own folder."""
        for path in [*self.folder.glob("*.json")] + [
            p for p in self.folder.glob(".*") if is_temporary(p)
        ]:
            path.unlink(missing_ok=True)


def _file_name(name: str, digest: str) -> str:
    return f"{_UNSAFE.sub('_', name)}-{digest[:16]}.json"
