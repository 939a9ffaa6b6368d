"""Centre lines of rods as OBJ polylines, and rod solids as PLY."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..files.files import write_bytes, write_text
from .meshes import RodMesh


def obj_polylines(
    polylines: Sequence[np.ndarray],
    names: Sequence[str] | None = None,
    unit: str | None = None,
) -> str:
    """Polylines (k, 3) as OBJ, one line element each, in a group of its own where names are given.

    unit : of length, which a comment says; OBJ has no field for it
    """
    lines, count = _unit_comment(unit), 0
    for number, points in enumerate(polylines):
        if names is not None:
            lines.append(f"g {'_'.join(names[number].split())}")
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(points, float).tolist()]
        lines.append("l " + " ".join(str(count + k + 1) for k in range(len(points))))
        count += len(points)
    return "\n".join([*lines, ""])


def write_obj(
    path: str | Path,
    polylines: Sequence[np.ndarray],
    names: Sequence[str] | None = None,
    *,
    unit: str | None = None,
    overwrite: bool = False,
) -> Path:
    """Write polylines, see `obj_polylines`. Raises InputError when the file exists or can't be
    written."""
    return write_text(path, obj_polylines(polylines, names, unit), overwrite=overwrite)


def write_mesh_obj(
    path: str | Path,
    vertices: np.ndarray,
    faces: np.ndarray,
    *,
    unit: str | None = None,
    overwrite: bool = False,
) -> Path:
    """Write a triangle mesh, vertices (V, 3) and faces (F, 3), as OBJ.

    unit : of length, which a comment says

    Raises InputError when the file exists or can't be written.
    """
    lines = _unit_comment(unit)
    lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(vertices, float).tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (np.asarray(faces) + 1).tolist()]
    return write_text(path, "\n".join([*lines, ""]), overwrite=overwrite)


def _unit_comment(unit: str | None) -> list[str]:
    return [] if unit is None else [f"# unit: {unit}"]


def ply_bytes(mesh: RodMesh, colours: np.ndarray) -> bytes:
    """Rod solids as binary PLY: colours (V, 3) in [0, 1] by vertex, and the rod piece that each
    vertex belongs to."""
    head = "\n".join(
        [
            "ply",
            "format binary_little_endian 1.0",
            f"element vertex {len(mesh.vertices)}",
            *(f"property double {axis}" for axis in "xyz"),
            *(f"property uchar {name}" for name in ("red", "green", "blue")),
            "property int rod",
            f"element face {len(mesh.faces)}",
            "property list uchar int vertex_indices",
            "end_header",
            "",
        ]
    )
    vertices = np.empty(len(mesh.vertices), [("x", "<f8", 3), ("colour", "u1", 3), ("rod", "<i4")])
    vertices["x"], vertices["rod"] = mesh.vertices, mesh.chains
    vertices["colour"] = np.round(
        255 * np.clip(np.broadcast_to(colours, mesh.vertices.shape), 0, 1)
    )
    faces = np.empty(len(mesh.faces), [("n", "u1"), ("k", "<i4", 3)])
    faces["n"], faces["k"] = 3, mesh.faces
    return head.encode("ascii") + vertices.tobytes() + faces.tobytes()


def write_ply(
    path: str | Path, mesh: RodMesh, colours: np.ndarray, *, overwrite: bool = False
) -> Path:
    """Write rod solids. Raises InputError when the file exists or can't be written."""
    return write_bytes(path, ply_bytes(mesh, colours), overwrite=overwrite)
