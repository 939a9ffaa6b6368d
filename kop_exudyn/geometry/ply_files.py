"""PLY files: vertices, polygons, triangle strips and edges, as text or binary in either order of
bytes."""

from __future__ import annotations

import io
import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks import LARGEST
from ..errors import InputError

_ELEMENT = re.compile(rb"^element\s+(\w+)\s+(\d{1,18})\s*$", re.MULTILINE)
_LISTS = ("vertex_indices", "vertex_index")  # names of lists of vertices, as programs write them
END_OF_HEAD = b"end_header"


@dataclass(frozen=True)
class PlyContent:
    """What a PLY file has.

    vertices (V, 3); polygons : numbers of vertices of every face, those of strips last
    edges : pairs of vertices, of the file's own edges
    """

    vertices: np.ndarray
    polygons: list[list[int]]
    edges: list[tuple[int, int]]


def elements_of(content: bytes) -> dict[str, int]:
    """Names and numbers of elements, as a PLY file's head has them."""
    head = content[: content.find(END_OF_HEAD) + 1]
    return {name.decode(): int(count) for name, count in _ELEMENT.findall(head)}


def parse_ply(content: bytes) -> PlyContent:
    """The content of a PLY file. Raises InputError where it can't be read."""
    for name, count in elements_of(content).items():
        if count > len(content):  # before anything of that size is made
            raise InputError(f"ends before its {count:,} elements {name}: it is cut off")
    from plyfile import PlyData

    try:
        found = PlyData.read(io.BytesIO(content))
        data = {element.name: element.data for element in found.elements}
        vertices = np.stack([np.asarray(data["vertex"][axis], float) for axis in "xyz"], axis=1)
        polygons = [list(map(int, face)) for face in _lists(data.get("face"))]
        for strip in _lists(data.get("tristrips")):
            polygons += triangles_of_strip(list(map(int, strip)))
        edges = data.get("edge")
        pairs = (
            []
            if edges is None
            else list(zip(edges["vertex1"].astype(int).tolist(), edges["vertex2"].tolist()))
        )
    except Exception as error:  # the reader raises whatever the broken file leads it to
        raise InputError(f"can't be read as PLY: {str(error)[:100]}") from None
    if not (np.abs(vertices) <= LARGEST).all():
        raise InputError("has a vertex without finite coordinates")
    for named in (*polygons, *pairs):
        wrong = [k for k in named if not 0 <= k < len(vertices)]
        if wrong:
            raise InputError(
                f"names a vertex that isn't there (there are {len(vertices)})", value=wrong[0]
            )
    return PlyContent(vertices, polygons, pairs)


def triangles_of_strip(strip: list[int]) -> list[list[int]]:
    """The triangles of strips that follow each other, -1 between them: every second one is turned
    round, so that all face alike."""
    found: list[list[int]] = []
    start = 0
    for k, number in enumerate(strip):
        if number < 0:
            start = k + 1
        elif k >= start + 2:
            a, b, c = strip[k - 2 : k + 1]
            if len({a, b, c}) == 3:  # programs repeat vertices to go on elsewhere
                found.append([a, b, c] if (k - start) % 2 == 0 else [b, a, c])
    return found


def _lists(element: Any) -> Any:
    """The lists of vertices of an element; none without it."""
    if element is None:
        return ()
    name = next(name for name in _LISTS if name in element.dtype.names)
    return element[name]
