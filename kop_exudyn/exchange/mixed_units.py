"""Surfaces and targets beside a drawing: whether they are in its unit, and how many times as large
they are."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError
from ..files.files import read_bytes
from ..units import LENGTHS
from .curve_files import SIZE_LIMIT, said_unit
from .drawing import Drawing, Finding

_FAR_LARGER = 50.0  # times a net's size: surfaces so large are hardly in its unit


def scale_beside(path: Path, drawing: Drawing) -> tuple[float, list[Finding]]:
    """How many of a drawing's units one unit of a mesh file is, and what to say of it: 1 where one
    of the two doesn't say its unit.

    path : of the mesh; only OBJ files say their unit, in a comment
    """
    if drawing.metres is None or path.suffix.lower() != ".obj":
        return 1.0, []
    try:
        unit, _ = said_unit(read_bytes(path, SIZE_LIMIT))
    except InputError:  # what reads it as a mesh says what is wrong
        return 1.0, []
    if unit is None or abs(LENGTHS[unit] / drawing.metres - 1) < 1e-9:
        return 1.0, []
    ratio = LENGTHS[unit] / drawing.metres
    text = (
        f"{path.name} says that it is in {unit}, the drawing is in {drawing.unit}: its coordinates "
        f"are taken times {ratio:.6g}"
    )
    return ratio, [Finding("suspicious", text)]


def size_doubts(path: Path, mesh_size: float, net_size: float) -> list[Finding]:
    """A finding where a mesh is as large beside a net as it would be in another unit; sizes in
    one unit."""
    if mesh_size <= _FAR_LARGER * net_size:
        return []
    text = (
        f"{path.name} is {mesh_size / net_size:.3g} times as large as the net: is it in the "
        "drawing's unit?"
    )
    return [Finding("suspicious", text)]
