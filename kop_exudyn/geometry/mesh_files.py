"""Triangle meshes from files: OBJ, PLY, STL and OFF, and the JSON files of COMPAS."""

from __future__ import annotations

import io
import json
import logging
import os
import re
import struct
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from .mesh_cleaning import WELD, cleaned, triangles_of
from .obj_files import parse_obj
from .ply_files import END_OF_HEAD, elements_of, parse_ply

log = logging.getLogger(__name__)

COMPAS = ".json"
_STL_HEAD, _STL_FACE = 84, 50  # bytes
_LOOKED_AT = 4096  # bytes at the beginning of a file that tell whether it is text
MOST_FACES = 1_000_000
_SIZE_LIMIT = 128 * 2**20  # bytes

Mesh = tuple[np.ndarray, np.ndarray]


def read_mesh(
    path: Path,
    field: str = "surface.file",
    *,
    tolerance: float = WELD,
    notes: list[str] | None = None,
) -> Mesh:
    """Vertices (V, 3) and triangles (F, 3) of a mesh file, as one surface (see `cleaned`).

    field : of a design file, that errors name
    tolerance : of the mesh's size, within which corners are welded
    notes : takes what had to be cleaned, in words

    Raises InputError naming the file in that field, also for files that are too large.
    """
    suffix = path.suffix.lower()
    if suffix not in _READERS:
        raise InputError(
            f"is no mesh file (known: {', '.join(MESH_SUFFIXES)})", field=field, value=path.name
        )
    if not os.path.isfile(path):
        raise InputError("no such file", field=field, value=str(path))
    try:
        stat = os.stat(path)
        vertices, faces, found = _read(
            os.path.abspath(path), stat.st_mtime_ns, stat.st_size, tolerance
        )
    except InputError as error:
        raise InputError(error.message, field=field, value=path.name) from None
    for note in found:
        log.info("%s: %s", path.name, note)
    if notes is not None:
        notes += found
    return vertices.copy(), faces.copy()


@lru_cache(maxsize=2)
def _read(
    path: str, changed: int, size: int, tolerance: float
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """The mesh in a file and what had to be cleaned; a file that is read again as it was isn't
    parsed again.

    changed, size : of the file, which tell whether it is as it was
    """
    try:
        vertices, faces = _READERS[Path(path).suffix.lower()](_content(Path(path)))
    except InputError as error:
        place = f"{error.field}: " if error.field else ""
        raise InputError(place + error.message) from None
    except RecursionError:
        raise InputError("is nested too deeply to be a mesh") from None
    except Exception as error:  # the readers raise whatever the broken file leads them to
        raise InputError(f"can't be read as a mesh: {str(error)[:100]}") from None
    if vertices.ndim != 2 or vertices.shape[1] != 3 or not len(faces):
        raise InputError("contains no faces")
    if not np.isfinite(vertices).all():
        raise InputError("contains no faces between finite vertices")
    _check_count(len(faces))
    try:
        vertices, faces, found = cleaned(vertices, faces, tolerance)
    except InputError as error:
        at = "" if error.value is None else f" = {error.value}"
        raise InputError(f"{error.field}{at}: {error.message}") from None
    if not len(faces):
        raise InputError("contains no faces with an area")
    return vertices, faces, found


def _content(path: Path) -> bytes:
    size = path.stat().st_size
    if size > _SIZE_LIMIT:
        raise InputError(
            f"is larger than {_SIZE_LIMIT / 2**20:g} MB: some ten thousand faces are fine enough"
        )
    return path.read_bytes()


def _check_count(n_faces: int) -> None:
    if n_faces > MOST_FACES:
        raise InputError(
            f"has {n_faces:,} faces, at most {MOST_FACES:,} are read: some ten thousand are fine "
            "enough"
        )


def _obj(content: bytes) -> Mesh:
    found = parse_obj(content)
    _check_count(len(found.faces))
    return found.vertices, triangles_of((face for face, _ in found.faces), found.vertices)


def _stl(content: bytes) -> Mesh:
    """Binary files say in their head how many faces they have, 50 bytes each; what some programs
    write after these isn't looked at."""
    if len(content) < _STL_HEAD or b"facet normal" in content[:_LOOKED_AT].lower():
        return _by_trimesh(content, "stl")
    (n_faces,) = struct.unpack("<I", content[80:_STL_HEAD])
    room, behind = divmod(len(content) - _STL_HEAD, _STL_FACE)
    if n_faces > room:
        raise InputError(
            f"ends after {room:,} of its {n_faces:,} faces: it is cut off, or no binary STL file"
        )
    if n_faces < room and not behind:
        raise InputError(
            f"has {room:,} faces, but says that it has {n_faces:,}: its head is damaged"
        )
    _check_count(n_faces)
    return _by_trimesh(content[: _STL_HEAD + _STL_FACE * n_faces], "stl")


def _ply(content: bytes) -> Mesh:
    if END_OF_HEAD not in content:
        raise InputError("ends within its head: it is cut off")
    if "tristrips" not in elements_of(content):
        return _by_trimesh(content, "ply")
    found = parse_ply(content)
    _check_count(len(found.polygons))
    return found.vertices, triangles_of(found.polygons, found.vertices)


def _off(content: bytes) -> Mesh:
    """Text, a vertex or a face a line, after their numbers."""
    text = re.sub(r"#.*", "", content.decode("utf-8", errors="replace"))
    rows = [line for line in text.splitlines() if line.strip()]
    word, *counts = rows[0].split() if rows else [""]
    if not word.upper().endswith("OFF"):
        raise InputError('doesn\'t begin with "OFF", as OFF files do')
    if "BINARY" in counts:
        raise InputError("is a binary OFF file: save it as text, or as PLY")
    first = 1 if counts else 2
    counts = counts or (rows[1].split() if len(rows) > 1 else [])
    if len(counts) < 2 or not all(count.isdecimal() for count in counts[:2]):
        raise InputError("doesn't say how many vertices and faces it has")
    wanted = sum(map(int, counts[:2]))
    if wanted > len(rows) - first:
        raise InputError(
            f"ends after {len(rows) - first:,} of its {wanted:,} vertices and faces: it is cut off"
        )
    return _by_trimesh(content, "off")


def _by_trimesh(content: bytes, kind: str) -> Mesh:
    import trimesh

    # from memory, so that nothing that the file names is opened
    mesh = trimesh.load_mesh(io.BytesIO(content), file_type=kind, process=False)
    return np.array(mesh.vertices, float), np.array(mesh.faces, int)


def _compas(content: bytes) -> Mesh:
    """The mesh of a file that COMPAS wrote with `Mesh.to_json` or `json_dump`, in versions 0 to 2.

    Coordinates that a vertex doesn't have are the mesh's default ones. Raises ValueError, KeyError
    or TypeError for something else.
    """
    found = list(_meshes(json.loads(content.decode("utf-8-sig"))))
    if len(found) != 1:
        raise ValueError(f"expected one COMPAS mesh, found {len(found)}")
    data = found[0]
    default = {
        "x": 0.0,
        "y": 0.0,
        "z": 0.0,
        **data.get("default_vertex_attributes", data.get("dva", {})),
    }
    numbers = {_key(key): k for k, key in enumerate(data["vertex"])}
    vertices = np.array(
        [
            [float(attributes.get(axis, default[axis])) for axis in "xyz"]
            for attributes in data["vertex"].values()
        ]
    )
    _check_count(len(data["face"]))
    polygons = (
        [numbers[_key(key)] for key in (keys[:-1] if keys[:1] == keys[-1:] else keys)]
        for keys in data["face"].values()
    )
    return vertices, triangles_of(polygons, vertices)


def _key(key: Any) -> str:
    """A vertex's key; early versions wrote texts within texts."""
    return str(key).strip("'\"")


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


_READERS: dict[str, Callable[[bytes], Mesh]] = {
    ".obj": _obj,
    ".ply": _ply,
    ".stl": _stl,
    ".off": _off,
    COMPAS: _compas,
}
MESH_SUFFIXES = tuple(_READERS)
