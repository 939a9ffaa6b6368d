"""Design files at another size."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files.files import as_path, make_folder
from ..files.json_files import read_json, write_json
from ..structures.base import rescaled


def save_rescaled(files: Sequence[Path], scales: Sequence[float], folder: str | Path) -> list[Path]:
    """Write designs at other sizes to a folder, under their own names; returns the new files.

    files : design files; scales : how many times as large each becomes

    Files that they name, relative to themselves, are named relative to the new folder. Raises
    InputError where a design can't be rescaled or a file exists.
    """
    folder = as_path(folder)
    content = []
    for file, scale in zip(files, scales):
        data = read_json(file)
        try:
            content.append(rescaled(data, scale) if scale != 1 else dict(data))
        except InputError as error:
            raise error.at(file) from None
    check_rescaled(files, folder)
    made = make_folder(folder)
    return [
        write_json(_new_file(file, made), relocated(data, file.parent, made))
        for file, data in zip(files, content)
    ]


def check_rescaled(files: Sequence[Path], folder: str | Path) -> None:
    """Raise InputError unless `save_rescaled` can write all of these to the folder, before any work
    is done for it."""
    folder = as_path(folder)
    if os.path.exists(folder) and not os.path.isdir(folder):
        raise InputError("is a file, expected a folder to write to", source=folder)
    for file in files:
        path = _new_file(file, folder)
        if os.path.exists(path):
            raise InputError("exists already: take another folder", source=path)


def _new_file(file: Path, folder: Path) -> Path:
    return folder / file.name.removesuffix(".gz")


def relocated(value: Any, old: Path, new: Path) -> Any:
    """The content of a design file with the paths in fields "file" relative to another folder.

    old, new : folders that paths are, and become, relative to
    """
    if isinstance(value, dict):
        return {
            key: Path(os.path.relpath(old / item, new)).as_posix()
            if key == "file" and isinstance(item, str)
            else relocated(item, old, new)
            for key, item in value.items()
        }
    return [relocated(item, old, new) for item in value] if isinstance(value, list) else value
