"""The content of design files that are made of drawings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..files.documents import check_schema
from ..io.designs import DESIGN_VERSION
from ..rods.sections import material_from_dict
from ..structures.plausibility import material_doubts, section_doubt
from ..units import Units
from .frames import Frame


@dataclass(frozen=True)
class Rods:
    """What the curves become.

    section, material : as a design file has them
    units : of all numbers, None where they aren't known
    """

    section: Mapping[str, Any]
    material: Mapping[str, Any]
    units: Units | None = None


def c_shell_data(
    name: str,
    curves: Sequence[Mapping[str, Any]],
    rods: Rods,
    opening: float,
    *,
    free_ends: bool = False,
    target: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """The content of a C-shell's design file, see c_shell.schema.json.

    target : its field of that name

    Raises InputError for values that can't be.
    """
    data = _head("c_shell", name, rods) | {
        "curves": list(curves),
        "crossings": "find",
        "free_ends": free_ends,
        "opening": {"angle": opening},
    }
    if target is not None:
        data["target"] = dict(target)
    check_schema(data, "c_shell")
    return data


def grid_data(
    name: str,
    curves: Sequence[Mapping[str, Any]],
    rods: Rods,
    surface: Mapping[str, Any],
    held: str | Sequence[int] | None = None,
) -> dict[str, Any]:
    """The content of a grid's design file, see grid.schema.json: curves in the parameters of a
    mesh.

    surface : its field of that name
    held : joints that keep their places, see `Grid`

    Raises InputError for values that can't be.
    """
    data = _head("grid", name, rods) | {
        "surface": dict(surface),
        "network": {"type": "curves", "curves": list(curves)},
    }
    if held is not None:
        data["held"] = held
    check_schema(data, "grid")
    return data


def mesh_target(file: str, frame: Frame, scale: float) -> dict[str, Any]:
    """The field "target" of a mesh that is drawn in the same coordinates as the curves.

    file : relative to the design's
    frame : the plane that the curves were laid into; scale : of the design's units in the drawing's
    """
    target: dict[str, Any] = {"file": file}
    if scale != 1.0:
        target["scale"] = scale
    if not frame.standard:
        target |= {"origin": frame.origin.tolist(), "axes": frame.axes.tolist()}
    return target


def _head(kind: str, name: str, rods: Rods) -> dict[str, Any]:
    units = {} if rods.units is None else {"units": rods.units.to_dict()}
    return {
        "format": "kop_exudyn/design",
        "version": DESIGN_VERSION,
        "class": kind,
        "name": name,
        **units,
        "material": dict(rods.material),
        "section": dict(rods.section),
    }


def rod_doubts(rods: Rods, spans: np.ndarray) -> list[str]:
    """What looks as if it were given in other units than the net, in words.

    spans : the lengths between neighbouring joints
    """
    sides = [float(rods.section[name]) for name in ("width", "height")]
    doubt = section_doubt(sides, spans, rods.units)
    return ([doubt] if doubt else []) + material_doubts(
        [material_from_dict(rods.material)], rods.units
    )
