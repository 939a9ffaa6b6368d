"""The designs that come with the package: in a checkout those of models/, in a wheel copies."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError
from ..files.files import as_path, check_output_file, make_folder, read_bytes, write_bytes

_PACKAGE = Path(__file__).resolve().parents[1]
# Put there when a wheel is built, see setup.py.
_INSTALLED = _PACKAGE / "examples"
_SUFFIXES = (".json", ".obj")


def example_files() -> list[Path]:
    """The files, sorted; each in a folder named after what is in it. Raises InputError where the
    package was installed without them."""
    for folder in (_INSTALLED, _PACKAGE.parent / "models"):
        found = sorted(file for file in folder.glob("*/*") if file.suffix in _SUFFIXES)
        if found:
            return found
    raise InputError("this installation has no example designs", source=_INSTALLED)


def copy_examples(folder: str | Path, *, overwrite: bool = False) -> list[Path]:
    """Copy all example designs into a folder, each group into a folder of its own.

    folder : made where it isn't there yet
    overwrite : replace files that are there

    Returns the copies' paths. Raises InputError, before anything is written, when a file exists and
    `overwrite` is false, or when the folder can't be written to.
    """
    files = example_files()
    folder = as_path(folder)
    copies = [folder / file.parent.name / file.name for file in files]
    for copy in copies:
        if copy.parent.is_dir():
            check_output_file(copy, overwrite=overwrite)
    for file, copy in zip(files, copies):
        make_folder(copy.parent)
        write_bytes(copy, read_bytes(file), overwrite=overwrite)
    return copies
