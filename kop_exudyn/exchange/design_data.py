"""The content of design files that are made of drawings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..files.documents import check_schema, has_schema
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


def design_data(
    class_name: str, name: str, rods: Rods, content: Mapping[str, Any]
) -> dict[str, Any]:
    """The content of a design file.

    class_name, name : of the design
    content : the class's own fields

    Raises InputError for values that can't be.
    """
    units = {} if rods.units is None else {"units": rods.units.to_dict()}
    data = {
        "format": "kop_exudyn/design",
        "version": DESIGN_VERSION,
        "class": class_name,
        "name": name,
        **units,
        "material": dict(rods.material),
        "section": dict(rods.section),
        **content,
    }
    if has_schema(class_name):
        check_schema(data, class_name)
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


def rod_doubts(rods: Rods, spans: np.ndarray) -> list[str]:
    """What looks as if it were given in other units than the net, in words.

    spans : the lengths between neighbouring joints
    """
    sides = [float(rods.section[name]) for name in ("width", "height")]
    doubt = section_doubt(sides, spans, rods.units)
    return ([doubt] if doubt else []) + material_doubts(
        [material_from_dict(rods.material)], rods.units
    )
