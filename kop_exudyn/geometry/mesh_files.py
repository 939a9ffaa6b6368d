"""Triangle meshes from files: OBJ, PLY and STL, and the JSON files of COMPAS, whose polygons are
split."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError

COMPAS = ".json"
MESH_SUFFIXES = (".obj", ".ply", ".stl", COMPAS)

_SIZE_LIMIT = 512 * 2**20  # bytes


def read_mesh(path: Path, field: str = "surface.file") -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) and triangles (F, 3) of a mesh file. Raises InputError naming the file in
    that field."""
    suffix = path.suffix.lower()
    if suffix not in MESH_SUFFIXES:
        raise InputError(
            f"is no mesh file (known: {', '.join(MESH_SUFFIXES)})", field=field, value=path.name
        )
    if not os.path.isfile(path):
        raise InputError("no such file", field=field, value=str(path))
    try:
        vertices, faces = _compas_mesh(path) if suffix == COMPAS else _trimesh(path, field)
    except InputError:
        raise
    except Exception as error:  # the readers raise whatever the broken file leads them to
        raise InputError(
            f"can't be read as a mesh: {str(error)[:100]}", field=field, value=path.name
        ) from None
    if (
        vertices.ndim != 2
        or vertices.shape[1] != 3
        or not len(faces)
        or not np.isfinite(vertices).all()
    ):
        raise InputError("contains no faces between finite vertices", field=field, value=path.name)
    return vertices, faces


def _trimesh(path: Path, field: str) -> tuple[np.ndarray, np.ndarray]:
    try:
        import trimesh
    except ImportError:
        raise InputError(
            "reading meshes needs trimesh (pip install trimesh)", field=field, value=path.name
        ) from None
    mesh = trimesh.load_mesh(path, process=True)
    return np.array(mesh.vertices, float), np.array(mesh.faces, int)


def _compas_mesh(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """The mesh of a file that COMPAS wrote with `Mesh.to_json` or `json_dump` (versions 1 and 2).

    Coordinates that a vertex doesn't have are the mesh's default ones. Raises ValueError, KeyError
    or TypeError for something else.
    """
    if path.stat().st_size > _SIZE_LIMIT:
        raise ValueError("the file is too large")
    found = list(_meshes(json.loads(path.read_text(encoding="utf-8"))))
    if len(found) != 1:
        raise ValueError(f"expected one COMPAS mesh, found {len(found)}")
    data = found[0]
    default = {
        "x": 0.0,
        "y": 0.0,
        "z": 0.0,
        **data.get("default_vertex_attributes", data.get("dva", {})),
    }
    numbers = {key: k for k, key in enumerate(data["vertex"])}
    vertices = np.array(
        [
            [float(attributes.get(axis, default[axis])) for axis in "xyz"]
            for attributes in data["vertex"].values()
        ]
    )
    polygons = [[numbers[str(key)] for key in keys] for keys in data["face"].values()]
    return vertices, np.array(
        [t for polygon in polygons for t in _triangles(polygon, vertices)], int
    )


def _meshes(data: Any) -> Iterator[Mapping[str, Any]]:
    """All meshes among the objects of a COMPAS file; an object is {"dtype": ..., "data" or "value":
    its content}."""
    if isinstance(data, list):
        for item in data:
            yield from _meshes(item)
    elif isinstance(data, dict):
        if isinstance(data.get("vertex"), dict) and isinstance(data.get("face"), dict):
            yield data
        else:
            for item in data.values():
                yield from _meshes(item)


def _triangles(polygon: Sequence[int], vertices: np.ndarray) -> list[tuple[int, int, int]]:
    """A polygon as triangles: a quad is cut along its shorter diagonal, others from their first
    corner."""
    if len(polygon) < 3 or len(set(polygon)) < len(polygon):
        raise ValueError("a face needs three or more different vertices")
    if len(polygon) == 4:
        a, b, c, d = polygon
        lengths = np.linalg.norm(vertices[[a, b]] - vertices[[c, d]], axis=1)
        return [(a, b, c), (a, c, d)] if lengths[0] <= lengths[1] else [(a, b, d), (b, c, d)]
    return [(polygon[0], b, c) for b, c in zip(polygon[1:], polygon[2:])]
