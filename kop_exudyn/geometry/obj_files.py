"""Wavefront OBJ files: their vertices, faces, polylines, and curves in free form. Materials,
textures, normals and groups are passed over, and no other file is opened."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..checks import LARGEST
from ..errors import InputError


@dataclass(frozen=True)
class ObjContent:
    """What an OBJ file draws.

    vertices (V, 3); weights (V,) : of rational curves, 1 where none is given
    faces, lines : numbers of vertices, and the line of the file that each stands in
    curves : B-splines and Bezier curves
    left_out : elements of other kinds -> how many there are
    """

    vertices: np.ndarray
    weights: np.ndarray
    faces: list[tuple[list[int], int]]
    lines: list[tuple[list[int], int]]
    curves: list[ObjCurve]
    left_out: dict[str, int]


@dataclass
class ObjCurve:
    """A curve in free form, of pieces of polynomials.

    picked : numbers of its control points; line : of the file, that it begins in
    between : the parameters that it begins and ends at
    kind : "bspline" or "bezier"; rational : whether weights matter
    degree : of the polynomials
    parameters : a B-spline's knots, or where Bezier pieces meet
    """

    picked: list[int]
    line: int
    between: tuple[float, float]
    kind: str
    rational: bool
    degree: int
    parameters: list[float] = field(default_factory=list)

    @property
    def knots(self) -> list[float]:
        """Of the same curve as a B-spline (Piegl, Tiller: The NURBS Book, 1997, section 2.2)."""
        if self.kind == "bspline":
            return self.parameters
        ends = self.parameters[:1] + self.parameters[-1:]
        return sorted([*ends, *(u for u in self.parameters for _ in range(self.degree))])


# surfaces in free form, curves on them, and points, which nothing here uses
_OTHER_ELEMENTS = ("p", "curv2", "surf")
_FREE_FORMS = ("bspline", "bezier")
_WHOLE_AS_FRACTION = re.compile(r"\.0*$")


def parse_obj(content: bytes) -> ObjContent:
    """The content of an OBJ file. Raises InputError naming the line that can't be read."""
    vertices: list[list[float]] = []
    weights: list[float] = []
    faces: list[tuple[list[int], int]] = []
    lines: list[tuple[list[int], int]] = []
    curves: list[ObjCurve] = []
    left_out: dict[str, int] = {}
    form: list[str] = []
    degree = 0
    in_curve = False
    for number, line in _lines(_text(content)):
        keyword, *values = line.split("#")[0].split() or [""]
        place = f"line {number}"
        if keyword == "v":
            vertices.append(_vertex(values, place))
            weights.append(_numbers(values[3:4], place)[0] if len(values) == 4 else 1.0)
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
        elif keyword == "cstype":
            form = values
        elif keyword == "deg":
            degree = _whole(values[0] if values else "", place)
        elif keyword == "curv" and form[-1:] and form[-1] in _FREE_FORMS:
            picked = [_index(value, len(vertices), place) for value in values[2:]]
            begin, end = _numbers(values[:2], place, 2)
            rational = form[0] == "rat"
            curves.append(ObjCurve(picked, number, (begin, end), form[-1], rational, degree))
            in_curve = True
        elif keyword == "parm" and in_curve and values[:1] == ["u"]:
            curves[-1].parameters += _numbers(values[1:], place)
        elif keyword == "end":
            in_curve = False
        elif keyword in (*_OTHER_ELEMENTS, "curv"):
            left_out[keyword] = left_out.get(keyword, 0) + 1
            in_curve = False
    return ObjContent(
        np.array(vertices, float).reshape(-1, 3),
        np.array(weights, float),
        faces,
        lines,
        curves,
        left_out,
    )


def first_words(content: bytes) -> set[str]:
    """The words that lines of an OBJ file begin with, which say what is in it: without reading
    it."""
    return set(re.findall(r"^[ \t]*([a-z]\w*)(?=\s)", _text(content), re.MULTILINE))


def _text(content: bytes) -> str:
    """The text, in the encoding that its first bytes tell."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return content.decode("utf-16", errors="replace")
    return content.decode("utf-8-sig", errors="replace")


def _lines(text: str) -> Iterator[tuple[int, str]]:
    """Lines with their numbers; one that ends in a backslash goes on in the next."""
    begun, first = "", 1
    for number, line in enumerate(text.splitlines(), 1):
        if not begun:
            first = number
        line = line.rstrip()  # editors leave spaces behind the backslash
        begun += line.removesuffix("\\") + " "
        if not line.endswith("\\"):
            yield first, begun
            begun = ""
    if begun:
        yield first, begun


def _vertex(values: Sequence[str], place: str) -> list[float]:
    """A vertex's place, in the xy plane where two numbers are given; a weight or a colour may
    follow three."""
    try:
        point = [float(value) for value in (*values, *["0"] * (len(values) == 2))[:3]]
    except ValueError:
        point = []
    if len(point) != 3 or not all(abs(value) <= LARGEST for value in point):
        raise InputError(
            "expected three coordinates of a vertex, within 1e60",
            field=place,
            value=" ".join(values),
        )
    return point


def _numbers(values: Sequence[str], place: str, count: int | None = None) -> list[float]:
    """Finite numbers, so many."""
    try:
        found = [float(value) for value in values]
    except ValueError:
        found = [np.nan]
    if not np.isfinite(found).all() or count not in (None, len(found)):
        raise InputError(
            "expected " + ("numbers" if count is None else f"{count} numbers"),
            field=place,
            value=" ".join(values),
        )
    return found


def _whole(text: str, place: str) -> int:
    if not text.isdecimal() or len(text) > 3:
        raise InputError("expected a whole number", field=place, value=text)
    return int(text)


def _index(text: str, n_vertices: int, place: str) -> int:
    """The vertex that an element names: from 1, or from -1 backwards; what follows a slash is its
    texture and its normal. Programs that hold all in one array of numbers write 3 as 3.0."""
    try:
        number = (
            int(text) if text.isdecimal() else int(_WHOLE_AS_FRACTION.sub("", text.split("/")[0]))
        )
    except ValueError:
        raise InputError("expected numbers of vertices", field=place, value=text) from None
    if not 1 <= abs(number) <= n_vertices:
        raise InputError(
            f"no such vertex ({n_vertices} are given before)", field=place, value=number
        )
    return number - 1 if number > 0 else n_vertices + number
