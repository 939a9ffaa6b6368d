"""Nets that are drawn as meshes or graphs: the edges of faces in OBJ and PLY files, of COMPAS
meshes and graphs."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..checks import LARGEST
from ..errors import InputError
from ..files.files import read_bytes
from ..geometry.obj_files import parse_obj
from ..geometry.ply_files import parse_ply
from ..units import LENGTHS
from .curve_files import MOST_CURVES, SIZE_LIMIT, said_unit
from .drawing import Drawing, DrawnCurve
from .outlines import place_of

EDGE_SUFFIXES = (".obj", ".ply", ".json")
Edges = tuple[np.ndarray, list[tuple[int, int]]]


def edges_of(path: Path) -> Drawing:
    """Every edge of a file's faces, or of its graph, as a curve of its own: those that go on in
    each other become one lath as pieces of a drawing do.

    Raises InputError when the file can't be read, is too large, or has no edges.
    """
    suffix = path.suffix.lower()
    if suffix not in EDGE_SUFFIXES:
        raise InputError(
            f"edges are read of {', '.join(EDGE_SUFFIXES)} files: save the mesh as OBJ, with "
            "its quads as they are",
            source=path,
            field="--edges",
        )
    content = read_bytes(path, SIZE_LIMIT)
    try:
        points, pairs = _READERS[suffix](content)
    except InputError as error:
        raise error.at(path) from None
    if not pairs:
        raise InputError("contains no faces, nor a graph, whose edges are laths", source=path)
    if len(pairs) > MOST_CURVES:
        raise InputError(
            f"has {len(pairs):,} edges, at most {MOST_CURVES:,} are read as laths", source=path
        )
    curves = [
        DrawnCurve(
            points[[a, b]], False, f"edge from {place_of(points[a])} to {place_of(points[b])}"
        )
        for a, b in pairs
    ]
    unit, doubts = said_unit(content) if suffix == ".obj" else (None, [])
    kept = [curve for curve in curves if np.ptp(curve.points, axis=0).any()]
    if not kept:
        raise InputError(
            f"all its {len(pairs):,} edges are without length: have its nodes no coordinates?",
            source=path,
        )
    return Drawing(kept, unit, None if unit is None else LENGTHS[unit], doubts=doubts)


def holds_edges(data: Any) -> bool:
    """Whether the content of a JSON file has a mesh or graph of COMPAS."""
    return any(True for _ in _structures(data))


def _of_obj(content: bytes) -> Edges:
    found = parse_obj(content)
    return found.vertices, _sides(face for face, _ in found.faces)


def _of_ply(content: bytes) -> Edges:
    """Its own edges; of files without any, those of its faces."""
    found = parse_ply(content)
    own = sorted({(min(pair), max(pair)) for pair in found.edges if pair[0] != pair[1]})
    return found.vertices, own or _sides(found.polygons)


def _of_compas(content: bytes) -> Edges:
    """Of the one mesh or graph in the file."""
    try:
        found = list(_structures(json.loads(content.decode("utf-8-sig"))))
        if len(found) != 1:
            raise InputError(f"expected one COMPAS mesh or graph, found {len(found)}")
        return _mesh_edges(found[0]) if "face" in found[0] else _graph_edges(found[0])
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"can't be read as JSON of COMPAS: {str(error)[:100]}") from None


def _mesh_edges(data: Mapping[str, Any]) -> Edges:
    names, points = _nodes(data, data["vertex"])
    return points, _sides([names[_key(k)] for k in face] for face in data["face"].values())


def _graph_edges(data: Mapping[str, Any]) -> Edges:
    names, points = _nodes(data, data["node"])
    pairs = {
        tuple(sorted((names[_key(u)], names[_key(v)])))
        for u, others in data["edge"].items()
        for v in others
    }
    return points, sorted((a, b) for a, b in pairs if a != b)


def _nodes(
    data: Mapping[str, Any], nodes: Mapping[str, Mapping[str, Any]]
) -> tuple[dict[str, int], np.ndarray]:
    """Numbers of nodes by their keys, and their places (n, 3)."""
    given = (data.get(name) for name in ("default_vertex_attributes", "default_node_attributes"))
    default: dict[str, Any] = {"x": 0.0, "y": 0.0, "z": 0.0}
    for attributes in (data.get("dva"), data.get("dna"), *given):
        default |= attributes or {}
    points = np.array(
        [[float(own.get(axis, default[axis])) for axis in "xyz"] for own in nodes.values()]
    ).reshape(-1, 3)
    if not (np.abs(points) <= LARGEST).all():
        raise InputError("has a node without finite coordinates")
    return {_key(key): k for k, key in enumerate(nodes)}, points


def _key(key: Any) -> str:
    """A node's key; early versions wrote texts within texts."""
    return str(key).strip("'\"")


def _sides(polygons: Iterable[Sequence[int]]) -> list[tuple[int, int]]:
    """Pairs of vertices that polygons join, each once."""
    pairs = {
        (min(a, b), max(a, b))
        for polygon in polygons
        for a, b in zip(polygon, [*polygon[1:], polygon[0]])
        if a != b
    }
    return sorted(pairs)


_READERS: dict[str, Callable[[bytes], Edges]] = {
    ".obj": _of_obj,
    ".ply": _of_ply,
    ".json": _of_compas,
}


def _structures(data: Any) -> Iterator[Mapping[str, Any]]:
    """All meshes and graphs among the objects of a COMPAS file."""
    if isinstance(data, list):
        for item in data:
            yield from _structures(item)
    elif isinstance(data, dict):
        pairs = (("vertex", "face"), ("node", "edge"))
        if any(all(isinstance(data.get(name), dict) for name in pair) for pair in pairs):
            yield data
        else:
            for item in data.values():
                yield from _structures(item)
