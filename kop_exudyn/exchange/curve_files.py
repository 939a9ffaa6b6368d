"""Curves from drawings: the polylines and splines of an OBJ file; what DXF, Rhino and JSON files
draw, see `dxf_curves`, `rhino_curves` and `json_curves`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..files.files import as_path, read_bytes
from ..geometry.nurbs import spline_points
from ..geometry.obj_files import ObjContent, first_words, parse_obj
from ..units import LENGTHS
from ..wording import counted
from .drawing import SAG, Drawing, DrawnCurve
from .dxf_curves import dxf_drawing
from .json_curves import holds_curves, json_drawing
from .other_formats import is_really
from .rhino_curves import rhino_drawing

SIZE_LIMIT = 64 * 2**20  # bytes: nets have some thousand points
MOST_CURVES = 20_000
_HEAD = 4096  # bytes of an OBJ file in which its unit may be said
_UNIT_COMMENT = re.compile(r"\s*#\s*(?:file\s+)?units?\s*[:=]\s*([a-z]+)", re.IGNORECASE)
_UNIT_WORDS = {
    "millimeters": "mm",
    "millimetres": "mm",
    "centimeters": "cm",
    "centimetres": "cm",
    "meters": "m",
    "metres": "m",
    "inches": "in",
    "feet": "ft",
}
_WITH_LAYERS = (".dxf", ".3dm", ".json")


def is_drawing(path: Path) -> bool:
    """Whether a file's name is that of a drawing that can be read; JSON files, which may be much
    else, by their content. Raises InputError when that can't be read."""
    suffix = path.suffix.lower()
    if suffix == ".json":
        return holds_curves(read_bytes(path, SIZE_LIMIT))
    return suffix in CURVE_READERS


def read_drawing(path: str | Path, layers: Sequence[str] = ()) -> Drawing:
    """All curves of an OBJ, DXF, 3dm or JSON file, told apart by the name's ending.

    layers : of DXF and 3dm files, those to read, hidden ones included; default: all that can be
        seen. Of JSON files, keys of the outermost dictionary

    Raises InputError when the file can't be read, is too large, or has no curves.
    """
    path = as_path(path)
    suffix = path.suffix.lower()
    if suffix not in CURVE_READERS:
        raise InputError(f"is no file of curves (known: {', '.join(CURVE_READERS)})", source=path)
    if layers and suffix not in _WITH_LAYERS:
        raise InputError(
            "only DXF, 3dm and JSON files have layers", source=path, field="layer", value=layers[0]
        )
    content = read_bytes(path, SIZE_LIMIT)
    other = is_really(content)
    if other is not None:
        raise InputError(other, source=path)
    try:
        drawing = CURVE_READERS[suffix](content, layers)
    except InputError as error:
        raise error.at(path) from None
    if not drawing.curves:
        said = [*drawing.skipped, *drawing.doubts]
        skipped = f" ({'; '.join(said)})" if said else ""
        raise InputError(f"contains no curves{skipped}", source=path)
    if len(drawing.curves) > MOST_CURVES:
        raise InputError(
            f"contains {len(drawing.curves):,} curves, at most {MOST_CURVES:,} are read",
            source=path,
        )
    return drawing


def is_surface(path: str | Path) -> bool:
    """Whether an OBJ file has faces and no curves, so that it is a surface and no drawing. Raises
    InputError when it can't be read."""
    if not str(path).lower().endswith(".obj"):
        return False
    words = first_words(read_bytes(path, SIZE_LIMIT))
    return bool(words & {"f", "fo"}) and not words & {"l", "curv"}


def _obj_drawing(content: bytes, layers: Sequence[str]) -> Drawing:
    """The `l` and `curv` elements of an OBJ file."""
    found = parse_obj(content)
    curves = []
    for picked, line in found.lines:
        closed = len(picked) > 3 and picked[0] == picked[-1]
        points = found.vertices[picked[: len(picked) - closed]]
        curves.append(DrawnCurve(points, closed, f"line {line}"))
    curves += _free_forms(found)
    skipped = [counted(n, f"{name} element") for name, n in found.left_out.items()]
    if found.faces:
        skipped.append(
            f"{counted(len(found.faces), 'face, which is', 'faces, which are')} a "
            "surface's: --edges "
            "reads them"
        )
    unit, doubts = said_unit(content)
    return Drawing(curves, unit, None if unit is None else LENGTHS[unit], skipped, doubts)


def said_unit(content: bytes) -> tuple[str | None, list[str]]:
    """The unit of length that a comment before an OBJ file's elements says, as "# unit: mm" or, of
    Rhino, "# File units = millimeters"; None where none does, it isn't known here, or comments say
    different ones. And what is doubtful about it."""
    words = []
    for line in content[:_HEAD].decode("utf-8", "replace").splitlines():
        if line.strip() and not line.lstrip().startswith("#"):
            break
        if found := _UNIT_COMMENT.match(line):
            words.append(found.group(1).lower())
    units = [word if word in LENGTHS else _UNIT_WORDS.get(word) for word in words]
    if len(set(units)) > 1:
        said = ", ".join(dict.fromkeys(words))
        return None, [f"its comments say different units ({said}): give --scale and --unit"]
    if None in units:
        return None, [f"its unit is called {words[0]}, which isn't known: give --scale and --unit"]
    return (units[0] if units else None), []


def _free_forms(found: ObjContent) -> Iterator[DrawnCurve]:
    """The curves in free form, by points. Raises InputError naming the line."""
    if not found.curves:
        return
    used = [n for picked, _ in found.lines for n in picked]
    used += [n for curve in found.curves for n in curve.picked]
    size = float(np.linalg.norm(np.ptp(found.vertices[used], axis=0))) if used else 0.0
    for curve in found.curves:
        control = found.vertices[curve.picked]
        weights = found.weights[curve.picked].tolist() if curve.rational else None
        try:
            points = spline_points(
                control, curve.knots, curve.degree, weights, SAG * size, curve.between
            )
        except InputError as error:
            raise InputError(error.message, field=f"line {curve.line}") from None
        closed = len(points) > 3 and np.linalg.norm(points[0] - points[-1]) <= 1e-9 * size
        yield DrawnCurve(points[: len(points) - closed], bool(closed), f"line {curve.line}")


CURVE_READERS: dict[str, Callable[[bytes, Sequence[str]], Drawing]] = {
    ".obj": _obj_drawing,
    ".dxf": dxf_drawing,
    ".3dm": rhino_drawing,
    ".json": json_drawing,
}
