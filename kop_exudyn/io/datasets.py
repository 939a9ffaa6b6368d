"""Several designs at once: those of a folder, or of a study file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..structures.base import Design
from .designs import design_files, load_all, select_among
from .studies import is_study, load_study


def load_designs(folder: str | Path, select: int | Sequence[str] | None = None) -> list[Design]:
    """The designs of a folder in the natural order of their file names (design_2 before design_10),
    or of a study file.

    select : the first so many, or the names of files without their ending, in the order wanted;
        default: all

    Raises InputError when there aren't that many, for unknown names, and when two designs have the
    same name.
    """
    return load_all(select_files(folder, select), folder)


def select_files(folder: str | Path, select: int | Sequence[str] | None = None) -> list[Path]:
    """The files that `load_designs` reads, without reading them; raises its errors about the
    selection."""
    return (
        list(load_study(folder, select).files)
        if is_study(folder)
        else select_among(design_files(folder), select, folder)
    )
