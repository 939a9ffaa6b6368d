"""Wavefront OBJ files: their vertices, faces and polylines. Materials, textures, normals and groups
are passed over, and no other file is opened."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InputError

_LARGEST = 1e60  # of coordinates, whose powers stay within double precision


@dataclass(frozen=True)
class ObjContent:
    """What an OBJ file draws.

    vertices (V, 3)
    faces, lines : numbers of vertices, and the line of the file that each stands in
    left_out : elements of other kinds -> how many there are
    """

    vertices: np.ndarray
    faces: list[tuple[list[int], int]]
    lines: list[tuple[list[int], int]]
    left_out: dict[str, int]


# curves and surfaces in free form, and points, which nothing here uses
_OTHER_ELEMENTS = ("p", "curv", "curv2", "surf")


def parse_obj(text: str) -> ObjContent:
    """The content of an OBJ file. Raises InputError naming the line that can't be read."""
    vertices: list[list[float]] = []
    faces: list[tuple[list[int], int]] = []
    lines: list[tuple[list[int], int]] = []
    left_out: dict[str, int] = {}
    for number, line in _lines(text):
        keyword, *values = line.split("#")[0].split() or [""]
        place = f"line {number}"
        if keyword == "v":
            vertices.append(_vertex(values, place))
        elif keyword in ("f", "fo", "l"):
            picked = [_index(value, len(vertices), place) for value in values]
            least, what = (2, "a polyline") if keyword == "l" else (3, "a face")
            if len(picked) < least:
                raise InputError(
                    f"{what} needs at least {('two', 'three')[least - 2]} vertices",
                    field=place,
                    value=line.strip(),
                )
            (lines if keyword == "l" else faces).append((picked, number))
        elif keyword in _OTHER_ELEMENTS:
            left_out[keyword] = left_out.get(keyword, 0) + 1
    return ObjContent(np.array(vertices, float).reshape(-1, 3), faces, lines, left_out)


def _lines(text: str) -> Iterator[tuple[int, str]]:
    """Lines with their numbers; one that ends in a backslash goes on in the next."""
    begun, first = "", 1
    for number, line in enumerate(text.splitlines(), 1):
        if not begun:
            first = number
        begun += line.removesuffix("\\") + " "
        if not line.endswith("\\"):
            yield first, begun
            begun = ""
    if begun:
        yield first, begun


def _vertex(values: Sequence[str], place: str) -> list[float]:
    """A vertex's place; a weight or a colour may follow."""
    try:
        point = [float(value) for value in values[:3]]
    except ValueError:
        point = []
    if len(point) != 3 or not all(abs(value) <= _LARGEST for value in point):
        raise InputError(
            "expected three coordinates of a vertex, within 1e60",
            field=place,
            value=" ".join(values),
        )
    return point


def _index(text: str, n_vertices: int, place: str) -> int:
    """The vertex that an element names: from 1, or from -1 backwards; what follows a slash is its
    texture and its normal."""
    try:
        number = int(text.split("/")[0])
    except ValueError:
        raise InputError("expected numbers of vertices", field=place, value=text) from None
    if not 1 <= abs(number) <= n_vertices:
        raise InputError(
            f"no such vertex ({n_vertices} are given before)", field=place, value=number
        )
    return number - 1 if number > 0 else n_vertices + number
