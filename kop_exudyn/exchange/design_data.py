"""The content of design files that are made of drawings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..files.documents import check_schema
from ..io.designs import DESIGN_VERSION
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


def section_doubts(rods: Rods, spans: np.ndarray) -> list[str]:
    """What looks as if it were given in other units than the net, in words.

    spans : the lengths between neighbouring joints
    """
    found = []
    length = "" if rods.units is None else f" {rods.units.length}"
    sides = [float(rods.section[name]) for name in ("width", "height")]
    median = float(np.median(spans))
    if max(sides) > 0.5 * median:
        found.append(
            f"the section of {sides[0]:g} x {sides[1]:g}{length} is thick beside spans of "
            f"{median:.3g}{length}: is it in the net's unit (--scale, --unit)?"
        )
    elif max(sides) < 2e-4 * median:
        found.append(
            f"the section of {sides[0]:g} x {sides[1]:g}{length} is very thin beside spans of "
            f"{median:.3g}{length}: is it in the net's unit (--scale, --unit)?"
        )
    if rods.units is None:
        return found
    young, density = rods.material["young"], rods.material.get("density")
    modulus = rods.units.stress_si(young)
    if not 1e5 <= modulus <= 2e12:
        found.append(
            f"a Young's modulus of {young:g} is {modulus:.3g} Pa in {rods.units}: is it in these "
            "units?"
        )
    if density is not None and not 1.0 <= rods.units.density_si(density) <= 3e4:
        found.append(
            f"a density of {density:g} is {rods.units.density_si(density):.3g} kg/m³ in "
            f"{rods.units}: is it in these units?"
        )
    return found
