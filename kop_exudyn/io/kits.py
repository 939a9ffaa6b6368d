"""Kit files: JSON in the format "kop_exudyn/kit", to project other designs onto a kit that
exists."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..checks import check_kind
from ..errors import InputError
from ..files.documents import check_envelope, check_range, check_schema
from ..files.json_files import read_json, write_json
from ..kit.kinds import part_kind
from ..kit.parts import Kit
from ..units import units_from_dict

KIT_VERSION = 1


def load_kit(path: str | Path) -> Kit:
    """The kit of a file.

    path : of a file of `save_kit`, such as the kit.json of a finished run

    Raises InputError when it is damaged or its parts can't be parts.
    """
    data = read_json(path)
    check_envelope(data, "kit", KIT_VERSION, source=path)
    check_range(data, source=path)
    check_schema(data, "kit", source=path)
    kit = Kit.from_dict(data["parts"], source=str(path))
    try:
        check_lengths(kit)
    except InputError as error:
        raise error.at(str(path)) from None
    return replace(kit, units=units_from_dict(data.get("units")))


def check_lengths(kit: Kit) -> None:
    """Raise InputError for a part all of whose lengths are zero: there is no such piece."""
    for kind, parts in kit.parts.items():
        nothing = np.flatnonzero(~parts.any(axis=1))
        if len(nothing) and not part_kind(kind).angular:
            raise InputError(
                "is a part without any length",
                field=f"kit.{kind}[{nothing[0]}]",
                value=parts[nothing[0]].tolist(),
            )


def save_kit(path: str | Path, kit: Kit, *, overwrite: bool = False) -> Path:
    """Write a kit, exactly: `load_kit` gives the same numbers. Returns the path.

    path : of the file, .json
    kit : lengths in its own units, angles in rad
    overwrite : replace a file that exists

    Raises InputError when the file exists and may not be replaced, or can't be written.
    """
    check_kind("kit", kit, Kit, "see Kit, or the field kit of a KitResult")
    data: dict[str, Any] = {"format": "kop_exudyn/kit", "version": KIT_VERSION}
    if kit.units is not None:
        data["units"] = kit.units.to_dict()
    data["parts"] = kit.to_dict()
    return write_json(path, data, overwrite=overwrite)
