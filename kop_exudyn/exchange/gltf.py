"""Coloured triangle meshes as glTF 2.0 in one binary file (GLB), for Blender, Rhino, and 3D viewers
of any kind."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..files.files import write_bytes

_FLOAT, _UINT = 5126, 5125  # component types
_VERTICES, _INDICES = 34962, 34963  # buffer targets
# glTF's up is y
_TO_Y_UP = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]


@dataclass(frozen=True)
class Solid:
    """A named mesh.

    vertices (V, 3), faces (F, 3) looking outwards
    colours : (V, 3) linear RGB in [0, 1], or one (3,)
    """

    name: str
    vertices: np.ndarray
    faces: np.ndarray
    colours: np.ndarray


def glb_bytes(solids: Sequence[Solid], metres: float = 1.0) -> bytes:
    """The solids as a GLB file, one node each; z is up here, and told so to the reader by the
    root's matrix, as are the metres that glTF wants.

    metres : of one unit of the vertices

    Vertices are single precision; normals are left to the reader, which makes every face flat, as
    cut boards are.
    """
    binary = _Buffer()
    meshes = [_mesh(solid, binary) for solid in solids]
    nodes: list[dict[str, Any]] = [
        {"name": solid.name, "mesh": k} for k, solid in enumerate(solids)
    ]
    nodes.append({"name": "z up", "matrix": _root(metres), "children": list(range(len(solids)))})
    document = {
        "asset": {"version": "2.0", "generator": "kop_exudyn"},
        "scene": 0,
        "scenes": [{"nodes": [len(solids)]}],
        "nodes": nodes,
        "meshes": meshes,
        "accessors": binary.accessors,
        "bufferViews": binary.views,
        "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.7}}],
        "buffers": [{"byteLength": len(binary.content)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(binary.content), b"BIN\0") + bytes(binary.content)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _root(metres: float) -> list[float]:
    """The root's matrix, column by column."""
    return [metres * value for value in _TO_Y_UP[:15]] + [1.0]


def write_glb(
    path: str | Path, solids: Sequence[Solid], metres: float = 1.0, *, overwrite: bool = False
) -> Path:
    """Write solids. Raises InputError when the file exists or can't be written."""
    return write_bytes(path, glb_bytes(solids, metres), overwrite=overwrite)


class _Buffer:
    """The binary chunk, and where its arrays lie."""

    def __init__(self) -> None:
        self.content = bytearray()
        self.views: list[dict[str, int]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, values: np.ndarray, target: int, kind: str, **limits: Any) -> int:
        """The number of the accessor of an array."""
        integer = values.dtype.kind in "iu"
        data = np.ascontiguousarray(values, "<u4" if integer else "<f4").tobytes()
        self.views.append(
            {
                "buffer": 0,
                "byteOffset": len(self.content),
                "byteLength": len(data),
                "target": target,
            }
        )
        self.content += data  # 4 bytes a number: stays aligned
        self.accessors.append(
            {
                "bufferView": len(self.views) - 1,
                "componentType": _UINT if integer else _FLOAT,
                "count": len(values),
                "type": kind,
                **limits,
            }
        )
        return len(self.accessors) - 1


def _mesh(solid: Solid, binary: _Buffer) -> dict[str, Any]:
    vertices = np.asarray(solid.vertices, "<f4")
    position = binary.add(
        vertices,
        _VERTICES,
        "VEC3",
        min=vertices.min(axis=0).tolist(),
        max=vertices.max(axis=0).tolist(),
    )
    colours = np.broadcast_to(np.asarray(solid.colours, float), vertices.shape)
    colour = binary.add(colours, _VERTICES, "VEC3")
    indices = binary.add(np.asarray(solid.faces).ravel(), _INDICES, "SCALAR")
    return {
        "name": solid.name,
        "primitives": [
            {
                "attributes": {"POSITION": position, "COLOR_0": colour},
                "indices": indices,
                "material": 0,
            }
        ],
    }
