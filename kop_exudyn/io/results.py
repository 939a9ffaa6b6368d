"""Result files: what a kit optimisation found, as JSON that other programs read, and its states as
arrays."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..equilibrium.equilibria import Equilibrium
from ..errors import InputError
from ..files.arrays import load_arrays, save_arrays, sealed, unsealed
from ..files.documents import check_envelope, check_schema
from ..files.json_files import plain, read_json, write_json

RESULT_VERSION = 1


def save_result(path: str | Path, result: Mapping[str, Any], *, overwrite: bool = False) -> Path:
    """Write `KitResult.to_dict()` with the format's name and version in front.

    Raises InputError when the file exists already or can't be written, ValueError when the content
    isn't a result.
    """
    data = {"format": "kop_exudyn/result", "version": RESULT_VERSION, **plain(result)}
    try:
        check_schema(data, "result")
    except InputError as error:
        raise ValueError(f"not a result: {error}") from None
    return write_json(path, data, overwrite=overwrite)


def load_result(path: str | Path) -> dict[str, Any]:
    """The content of a result file.

    path : of the result.json of a finished run

    Raises InputError when it is damaged or of another format.
    """
    data = read_json(path)
    check_envelope(data, "result", RESULT_VERSION, source=path)
    check_schema(data, "result", source=path)
    return data


def save_states(
    path: str | Path, found: Mapping[tuple[str, str, str], Equilibrium], *, overwrite: bool = False
) -> Path:
    """Write states as one .npz file: entries ``DESIGN/STAGE/ROLE/positions``, ``.../rotations``,
    ``.../angles``, ``.../parameters`` (q) and ``.../torque`` (the actuation's multiplier, one
    number).

    found : (design, stage, role) -> equilibrium
    """
    arrays: dict[str, np.ndarray] = {}
    for key, equilibrium in found.items():
        state = equilibrium.state
        values = {
            "positions": state.positions,
            "rotations": state.rotations,
            "angles": state.angles,
            "parameters": equilibrium.q,
            "torque": np.array(equilibrium.torque),
        }
        arrays |= {"/".join([*key, field]): array for field, array in values.items()}
    return save_arrays(path, sealed(arrays), overwrite=overwrite)


def load_states(path: str | Path) -> dict[tuple[str, str, str], dict[str, np.ndarray]]:
    """What `save_states` wrote: (design, stage, role) -> {"positions", "rotations", "angles",
    "parameters", "torque"}.

    Files of earlier versions lack the last two, and the seal that tells damage. Raises InputError.
    """
    found: dict[tuple[str, str, str], dict[str, np.ndarray]] = {}
    for name, array in unsealed(load_arrays(path), path, needed=False).items():
        pieces = name.split("/")
        if len(pieces) != 4:
            raise InputError("not a file of final states", source=path, field=name)
        design, stage, role, field = pieces
        found.setdefault((design, stage, role), {})[field] = array
    return found
