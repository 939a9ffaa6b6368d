"""Design files: JSON in the format "kop_exudyn/design", one design a file, a dataset a folder or a
study file."""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files.documents import check_envelope, check_range, is_own
from ..files.files import as_path, reason_of
from ..files.json_files import JSON_ENDINGS, json_stem, read_json
from ..structures.base import Design, design_from_dict, foreign_format
from ..units import common_units, unnamed_units

log = logging.getLogger(__name__)

DESIGN_VERSION = 2


def load_design(path: str | Path) -> Design:
    """The design that a file describes: our own format, or one that a structure class knows.

    path : of a file .json or .json.gz

    Raises InputError naming the file, the field and the value when anything is wrong with it.
    """
    data = read_json(path)
    own = is_own(data)
    if own:
        check_envelope(data, "design", DESIGN_VERSION, source=path)  # or another file of ours
    # to look for other programs' formats takes all classes' modules, which take long to import
    if not own and (foreign := foreign_format(data)) is not None:
        check_range(data, source=path)
        try:
            return foreign.read(data, str(path))
        except InputError as error:
            raise error.at(path) from None
    check_envelope(data, "design", DESIGN_VERSION, source=path)
    try:
        return design_from_dict(data, str(path))
    except InputError as error:
        raise error.at(path) from None


def own_content(path: str | Path) -> dict[str, Any]:
    """The content of a design file, in our own format whatever its own is.

    Raises InputError as `load_design` does, and for formats that can only be read.
    """
    load_design(path)  # refuses what is no design
    data = read_json(path)
    foreign = None if is_own(data) else foreign_format(data)
    if foreign is None:
        return data
    if foreign.rewrite is None:
        raise InputError("can be read, but not written as a design file of our own", source=path)
    return foreign.rewrite(data, json_stem(Path(path)), str(path))


def load_all(files: Iterable[Path], source: str | Path) -> list[Design]:
    """The designs of these files; InputError, naming the source, when two have the same name or
    different units."""
    files = list(files)
    designs = [load_design(path) for path in files]
    seen: dict[str, Path] = {}
    for design, path in zip(designs, files):
        if design.name in seen:
            raise InputError(
                f"{seen[design.name].name} and {path.name} have the same name: results and files "
                "are told apart by it, so give one of them another",
                source=source,
                field="name",
                value=design.name,
            )
        seen[design.name] = path
    units = {design.name: design.units for design in designs}
    try:
        common_units(units)
    except InputError as error:
        raise error.at(source) from None
    if doubt := unnamed_units(units):
        log.warning("%s: %s", source, doubt)
    return designs


def design_files(folder: str | Path) -> list[Path]:
    """The design files of a folder, in natural order. Raises InputError when there is none."""
    folder = as_path(folder)
    if not os.path.isdir(folder):
        raise InputError(
            "is a file, expected a folder of designs"
            if os.path.exists(folder)
            else "no such folder",
            source=folder,
        )
    try:
        names = os.listdir(folder)
    except OSError as error:
        raise InputError(f"can't be read: {reason_of(error)}", source=folder) from None
    found = [
        folder / name for name in names if name.endswith(JSON_ENDINGS) and not name.startswith(".")
    ]
    if not found:
        raise InputError("contains no designs (files that end in .json or .json.gz)", source=folder)
    return sorted(found, key=_natural)


def select_among(
    paths: Sequence[Path], select: int | Sequence[str] | None, folder: str | Path
) -> list[Path]:
    """Some of these files, see `load_designs`; errors name the folder."""
    paths = list(paths)
    if select is None:
        return paths
    if isinstance(select, (str, bool)) or not isinstance(select, (int, Sequence)):
        raise InputError("expected a number, or a list of names", field="designs", value=select)
    if isinstance(select, int):
        if not 1 <= select <= len(paths):
            raise InputError(
                f"expected a number of designs from 1 to {len(paths)}",
                source=folder,
                field="designs",
                value=select,
            )
        return paths[:select]
    by_name = {_stem(path): path for path in paths}
    for name in select:
        if name not in by_name:
            raise InputError(
                f"no such design (there are {', '.join(by_name)})",
                source=folder,
                field="designs",
                value=name,
            )
    if not select or len(set(select)) < len(select):
        raise InputError(
            "expected one or more different designs",
            source=folder,
            field="designs",
            value=list(select),
        )
    return [by_name[name] for name in select]


def _stem(path: Path) -> str:
    return path.name.removesuffix(".gz").removesuffix(".json")


def _natural(path: Path) -> list[tuple[bool, int | str]]:
    """Sort key under which the numbers in names count as numbers."""
    return [
        (piece.isdigit(), int(piece) if piece.isdigit() else piece)
        for piece in re.split(r"([0-9]+)", _stem(path))
        if piece
    ]
