"""Curves from drawings: the polylines of an OBJ file, the lines, polylines, arcs and splines of a
DXF file."""

from __future__ import annotations

import io
import logging
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..fabrication.dxf import load_ezdxf
from ..files.documents import LARGEST
from ..files.files import read_bytes

log = logging.getLogger(__name__)

_DRAWN = ("LINE", "LWPOLYLINE", "POLYLINE", "SPLINE", "ARC", "CIRCLE", "ELLIPSE")
# of the drawing's size: how far points of arcs and splines may leave them between each other
_SAG = 1e-4


@dataclass(frozen=True)
class DrawnCurve:
    """One curve of a drawing.

    points (n, 3) : at least two, in order
    closed : whether the last one is joined to the first
    label : what messages call it, as "line 12" or "SPLINE 2F"
    """

    points: np.ndarray
    closed: bool
    label: str


def read_curves(path: str | Path, layers: Sequence[str] = ()) -> list[DrawnCurve]:
    """All curves of an OBJ or DXF file, told apart by the name's ending.

    layers : of DXF files, those to read; default: all

    Raises InputError when the file can't be read or has no curves.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in CURVE_READERS:
        raise InputError(f"is no file of curves (known: {', '.join(CURVE_READERS)})", source=path)
    if layers and suffix != ".dxf":
        raise InputError("only DXF files have layers", source=path, field="layer", value=layers[0])
    content = read_bytes(path)
    try:
        curves = list(CURVE_READERS[suffix](content, layers))
    except InputError as error:
        raise error.at(path) from None
    if not curves:
        raise InputError("contains no curves", source=path)
    return curves


def _obj_curves(content: bytes, layers: Sequence[str]) -> Iterator[DrawnCurve]:
    """The `l` elements of an OBJ file."""
    vertices: list[list[float]] = []
    for number, line in _obj_lines(content.decode("utf-8", errors="replace")):
        keyword, *values = line.split("#")[0].split() or [""]
        place = f"line {number}"
        if keyword == "v":
            vertices.append(_vertex(values, place))
        elif keyword == "l":
            picked = [_index(value, len(vertices), place) for value in values]
            if len(picked) < 2:
                raise InputError(
                    "a polyline needs at least two vertices", field=place, value=line.strip()
                )
            closed = len(picked) > 3 and picked[0] == picked[-1]
            yield DrawnCurve(
                np.array([vertices[k] for k in picked[: len(picked) - closed]]), closed, place
            )


def _obj_lines(text: str) -> Iterator[tuple[int, str]]:
    """Lines with their numbers; one that ends in a backslash goes on in the next."""
    begun = ""
    for number, line in enumerate(text.splitlines(), 1):
        if not begun:
            first = number
        begun += line.removesuffix("\\") + " "
        if not line.endswith("\\"):
            yield first, begun
            begun = ""


def _vertex(values: Sequence[str], place: str) -> list[float]:
    try:
        point = [float(value) for value in values[:3]]
    except ValueError:
        point = []
    if len(point) != 3 or not _usable(point):
        raise InputError(
            "expected three coordinates of a vertex, within 1e60",
            field=place,
            value=" ".join(values),
        )
    return point


def _usable(coordinates: Any) -> bool:
    """Whether they are finite, and their powers as well."""
    return bool((np.abs(coordinates) <= LARGEST).all())


def _index(text: str, n_vertices: int, place: str) -> int:
    """The vertex that an element names: from 1, or from -1 backwards; what follows a slash is its
    texture."""
    try:
        number = int(text.split("/")[0])
    except ValueError:
        raise InputError("expected numbers of vertices", field=place, value=text) from None
    if not 1 <= abs(number) <= n_vertices:
        raise InputError(
            f"no such vertex ({n_vertices} are given before)", field=place, value=number
        )
    return number - 1 if number > 0 else n_vertices + number


def _dxf_curves(content: bytes, layers: Sequence[str]) -> Iterator[DrawnCurve]:
    """The curves of a DXF file's model space, in world coordinates."""
    ezdxf = load_ezdxf()
    from ezdxf import path as paths

    space = _dxf_document(ezdxf, content).modelspace()
    known = {_layer(entity) for entity in space}
    for layer in layers:
        if layer not in known:
            raise InputError(
                f"no such layer (there are {', '.join(sorted(known)) or 'none'})",
                field="layer",
                value=layer,
            )
    entities = [entity for entity in space if not layers or _layer(entity) in layers]
    left = Counter(entity.dxftype() for entity in entities if entity.dxftype() not in _DRAWN)
    if left:
        log.warning(
            "left out what is no curve: %s", ", ".join(f"{n} {name}" for name, n in left.items())
        )
    drawn = [(entity, _path_of(paths, entity)) for entity in entities if entity.dxftype() in _DRAWN]
    corners = np.array(
        [tuple(point) for _, path in drawn for point in path.control_vertices()]
    ).reshape(-1, 3)
    sag = _SAG * float(np.linalg.norm(np.ptp(corners, axis=0))) if len(corners) else 0.0
    for entity, path in drawn:
        points = np.array(
            [tuple(point) for point in path.flattening(sag)]
            if path.has_curves
            else [tuple(point) for point in path.control_vertices()]
        )
        closed = path.is_closed and len(points) > 3
        yield DrawnCurve(
            points[: len(points) - closed], closed, f"{entity.dxftype()} {entity.dxf.handle}"
        )


def _layer(entity: Any) -> str:
    """Its layer; entities that only the drawing's program knows have none."""
    return entity.dxf.layer if entity.dxf.is_supported("layer") else ""


def _path_of(paths: Any, entity: Any) -> Any:
    """An entity as a path of lines and Bezier curves."""
    label = f"{entity.dxftype()} {entity.dxf.handle}"
    try:
        path = paths.make_path(entity)
    except Exception as error:  # meshes among the polylines, splines without knots, ...
        raise InputError(f"can't be read as a curve: {str(error)[:100]}", field=label) from None
    points = np.array([tuple(point) for point in path.control_vertices()]).reshape(-1, 3)
    if len(points) < 2 or not _usable(points):
        raise InputError("is no curve: expected two points or more, within 1e60", field=label)
    return path


def _dxf_document(ezdxf: Any, content: bytes) -> Any:
    try:
        from ezdxf import recover

        document, auditor = recover.read(io.BytesIO(content))
    except Exception as error:  # its readers raise whatever the broken file leads them to
        raise InputError(f"can't be read as DXF: {str(error)[:100]}") from None
    if auditor.has_errors:
        raise InputError(f"damaged DXF file: {auditor.errors[0].message}")
    return document


CURVE_READERS: dict[str, Callable[[bytes, Sequence[str]], Iterator[DrawnCurve]]] = {
    ".obj": _obj_curves,
    ".dxf": _dxf_curves,
}
