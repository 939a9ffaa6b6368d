"""Nets that are drawn as meshes or graphs: the edges of faces in OBJ and PLY files, of COMPAS
meshes and graphs, and of JSON files that list nodes and edges, as networkx and scripts write them.
"""

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
from .outlines import Places

EDGE_SUFFIXES = (".obj", ".ply", ".json")
Edges = tuple[np.ndarray, list[tuple[int, int]]]

# names under which JSON files list nodes, their places, edges and these ones' ends
_NODES, _EDGES = ("nodes", "vertices", "points"), ("links", "edges", "lines")
_PLACES = ("pos", "position", "xyz", "point", "coordinates")
_SAME = 1e-6  # relative: what programs round places to
_FROM_TO = (("source", "target"), ("u", "v"), ("start", "end"), ("from", "to"))


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
        raise InputError(
            "contains no faces, nor a graph, whose edges are laths: leave out --edges where the "
            "laths are drawn as lines",
            source=path,
        )
    if len(pairs) > MOST_CURVES:
        raise InputError(
            f"has {len(pairs):,} edges, at most {MOST_CURVES:,} are read as laths", source=path
        )
    say = Places.of(points)
    curves = [
        DrawnCurve(points[[a, b]], False, f"edge from {say(points[a])} to {say(points[b])}")
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
    """Whether the content of a JSON file has a mesh or graph."""
    return any(True for _ in _structures(data))


def _of_obj(content: bytes) -> Edges:
    found = parse_obj(content)
    return found.vertices, _sides(face for face, _ in found.faces)


def _of_ply(content: bytes) -> Edges:
    """Its own edges; of files without any, those of its faces."""
    found = parse_ply(content)
    return found.vertices, _sides(found.edges, closed=False) or _sides(found.polygons)


def _of_json(content: bytes) -> Edges:
    """Of the one mesh or graph in the file."""
    try:
        found = list(_structures(json.loads(content.decode("utf-8-sig"))))
        if len(found) != 1:
            kinds = "of COMPAS, or lists of nodes and of edges or faces"
            raise InputError(f"expected one mesh or graph ({kinds}), found {len(found)}")
        if (names := _names_of_lists(found[0])) is not None:
            return _listed_edges(found[0], *names)
        return _mesh_edges(found[0]) if "face" in found[0] else _graph_edges(found[0])
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"can't be read as a mesh or graph: {str(error)[:100]}") from None


def _names_of_lists(data: Mapping[str, Any]) -> tuple[str, str] | None:
    """Under which names a graph lists its nodes and its edges (or a mesh its faces); None where it
    doesn't."""
    of_nodes, of_edges = (
        next((name for name in names if isinstance(data.get(name), list)), None)
        for names in (_NODES, (*_EDGES, "faces"))
    )
    return None if of_nodes is None or of_edges is None else (of_nodes, of_edges)


def _listed_edges(data: Mapping[str, Any], of_nodes: str, of_edges: str) -> Edges:
    """Of lists of nodes and edges, or faces, under these names: of the node-link data of networkx,
    and alike."""
    nodes, numbers = data[of_nodes], dict[str, int]()
    points = np.zeros((len(nodes), 3))
    for k, node in enumerate(nodes):
        field = f"{of_nodes}[{k}]"
        points[k] = _place_of_node(node, field)
        given = node.get("id", node.get("key", k)) if isinstance(node, Mapping) else k
        if _key(given) in numbers:
            raise InputError(
                f"has the id of {of_nodes}[{numbers[_key(given)]}]", field=field, value=given
            )
        numbers[_key(given)] = k

    def number(of: Any, field: str) -> int:
        if _key(of) not in numbers:
            raise InputError("ends at a node that isn't there", field=field, value=of)
        return numbers[_key(of)]

    chains = []
    for k, edge in enumerate(data[of_edges]):
        field = f"{of_edges}[{k}]"
        chains.append([number(end, field) for end in _ends(edge, field)])
    return points, _sides(chains, closed=of_edges == "faces")


def _place_of_node(node: Any, field: str) -> np.ndarray:
    """Its coordinates (3,), of two numbers in the plane z = 0. Raises InputError where it has none,
    or several that differ: networkx keeps the places of a drawing beside its users' own."""
    found = []
    for held in _held(node):
        if isinstance(held, Mapping):
            held = [held[axis] for axis in "xyz" if axis in held]
        if not isinstance(held, list) or not 2 <= len(held) <= 3:
            continue
        if all(type(x) in (int, float) and abs(x) <= LARGEST for x in held):
            found.append(np.array([*map(float, held), 0.0][:3]))
    if not found:
        names = f"x, y and z, or {', '.join(_PLACES)}"
        raise InputError(
            f"expected a node with two or three finite coordinates ({names})",
            field=field,
            value=node,
        )
    if any(np.abs(place - found[0]).max() > _SAME * np.abs(found[0]).max() for place in found):
        raise InputError("has places that differ: keep one of them", field=field, value=node)
    return found[0]


def _held(node: Any) -> list[Any]:
    """What of a node may be its coordinates."""
    if not isinstance(node, Mapping):
        return [node]
    return [node, *(node[name] for name in _PLACES if name in node)]


def _ends(edge: Any, field: str) -> Sequence[Any]:
    """The nodes that an edge joins, one after the other."""
    if isinstance(edge, list) and len(edge) > 1:
        return edge
    if isinstance(edge, Mapping):
        for begin, end in _FROM_TO:
            if begin in edge and end in edge:
                return [edge[begin], edge[end]]
    names = " or ".join(f"{begin} and {end}" for begin, end in _FROM_TO)
    raise InputError(f"expected two nodes, or {names}", field=field, value=edge)


def _mesh_edges(data: Mapping[str, Any]) -> Edges:
    names, points = _nodes(data, data["vertex"])
    return points, _sides([names[_key(k)] for k in face] for face in data["face"].values())


def _graph_edges(data: Mapping[str, Any]) -> Edges:
    names, points = _nodes(data, data["node"])
    pairs = [(names[_key(u)], names[_key(v)]) for u, others in data["edge"].items() for v in others]
    return points, _sides(pairs, closed=False)


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
    """A node's key; early versions wrote texts within texts, and tables whole numbers as 3.0."""
    if isinstance(key, float) and key.is_integer():
        key = int(key)
    return str(key).strip("'\"")


def _sides(chains: Iterable[Sequence[int]], closed: bool = True) -> list[tuple[int, int]]:
    """Pairs of vertices that chains join, each once; closed : whether their ends are joined."""
    pairs = {
        (min(a, b), max(a, b))
        for chain in chains
        for a, b in zip(chain, [*chain[1:], *chain[: int(closed)]])
        if a != b
    }
    return sorted(pairs)


_READERS: dict[str, Callable[[bytes], Edges]] = {
    ".obj": _of_obj,
    ".ply": _of_ply,
    ".json": _of_json,
}


def _structures(data: Any) -> Iterator[Mapping[str, Any]]:
    """All meshes and graphs among the objects of a JSON file."""
    if isinstance(data, list):
        for item in data:
            yield from _structures(item)
    elif isinstance(data, dict):
        pairs = (("vertex", "face"), ("node", "edge"))
        if any(all(isinstance(data.get(name), dict) for name in pair) for pair in pairs) or (
            _names_of_lists(data) is not None
        ):
            yield data
        else:
            for item in data.values():
                yield from _structures(item)
