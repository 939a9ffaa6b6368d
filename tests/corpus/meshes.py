"""Meshes as programs write them, as OBJ, PLY, STL and COMPAS files, and what must come out of
each.

Most show the same surface: the square [0, 2] x [0, 2] in four quads, its middle raised by 1, and
each quad bent along one of its diagonals: 9 vertices, 8 faces.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from drawings import Refused

VERTICES = np.array([[x, y, float(x == y == 1)] for y in range(3) for x in range(3)], float)
QUADS = [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]]
# along the diagonals through the middle
FACES = [[0, 1, 4], [0, 4, 3], [1, 2, 4], [2, 5, 4], [3, 4, 6], [4, 7, 6], [4, 5, 8], [4, 8, 7]]
ROOF = (
    8 * 0.5 * np.sqrt(2.0)
)  # each triangle: legs 1 along an edge, height sqrt(2) up to the middle


@dataclass(frozen=True)
class Surface:
    """What must come out of a mesh file: numbers, area, whether it is a disc; words of notes."""

    vertices: int = 9
    faces: int = 8
    area: float | None = ROOF
    disc: bool = True
    notes: int = 0


CASES: dict[str, tuple[Callable[[], bytes], Surface | Refused]] = {}


def case(name: str, expected: Surface | Refused) -> Callable:
    """Decorator: a file of the corpus and what must come out of it."""

    def add(make: Callable[[], bytes | str]) -> Callable:
        def content() -> bytes:
            made = make()
            return made.encode() if isinstance(made, str) else made

        CASES[name] = (content, expected)
        return make

    return add


def obj(vertices: Any, faces: Any, head: str = "", corner: str = "{}") -> str:
    text = [head] if head else []
    text += [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(vertices, float).tolist()]
    text += ["f " + " ".join(corner.format(k + 1) for k in face) for face in faces]
    return "\n".join([*text, ""])


def apart(faces: Any = FACES, noise: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """The same faces, each with vertices of its own."""
    corners = VERTICES[np.array(faces)].reshape(-1, 3)
    corners = corners + noise * np.random.default_rng(2).uniform(-1, 1, corners.shape)
    return corners, np.arange(len(corners)).reshape(-1, 3)


@case("triangles.obj", Surface())
def _triangles() -> str:
    return obj(VERTICES, FACES)


@case("mesh_of_quads.obj", Surface(area=None))
def _quads() -> str:
    return obj(VERTICES, QUADS)


@case("mesh_unwelded.obj", Surface(notes=1))
def _unwelded() -> str:
    return obj(*apart())


@case("mesh_unwelded_with_noise.obj", Surface(notes=1))
def _noise() -> str:
    return obj(*apart(noise=1e-7))


@case("mesh_uv_seam.obj", Surface())
def _seam() -> str:
    """Texture coordinates that differ on both sides of a seam: corners share positions only."""
    text = obj(VERTICES, []) + "".join(f"vt {k / 16} 0\n" for k in range(16))
    for n, face in enumerate(FACES):
        text += "f " + " ".join(f"{k + 1}/{(k + n) % 16 + 1}" for k in face) + "\n"
    return text


@case("mesh_flat_normals.obj", Surface())
def _normals() -> str:
    text = obj(VERTICES, []) + "".join(f"vn 0 {k / 8} 1\n" for k in range(8))
    for n, face in enumerate(FACES):
        text += "f " + " ".join(f"{k + 1}//{n + 1}" for k in face) + "\n"
    return text


@case("mesh_groups_and_materials.obj", Surface(notes=1))
def _groups() -> str:
    """Two objects with vertices of their own along their border."""
    left, right = (
        [f for f in FACES if max(VERTICES[f, 0]) <= 1],
        [f for f in FACES if min(VERTICES[f, 0]) >= 1],
    )
    text = obj(VERTICES, left, "mtllib no.mtl\no left\nusemtl a\ns off")
    second = obj(VERTICES, [], "o right\nusemtl b")
    return text + second + "".join("f " + " ".join(str(k + 10) for k in f) + "\n" for f in right)


@case("mesh_negative_numbers.obj", Surface())
def _negative() -> str:
    return obj(VERTICES, []) + "".join(
        "f " + " ".join(str(k - 9) for k in face) + "\n" for face in FACES
    )


@case("mesh_triangles_as_quads.obj", Surface())
def _as_quads() -> str:
    """As Rhino writes triangles among quads: the last corner twice."""
    return obj(VERTICES, [[*face, face[2]] for face in FACES])


@case("mesh_vertex_colours.obj", Surface())
def _colours() -> str:
    return (
        obj(VERTICES, FACES)
        .replace("\nv ", " 0.5 0.5 1.0\nv ")
        .replace("v 0.0 0.0 0.0\n", "v 0.0 0.0 0.0\n")
    )


@case("mesh_windows_line_ends.obj", Surface())
def _crlf() -> str:
    return obj(VERTICES, FACES).replace("\n", "\r\n")


@case("mesh_faces_twice.obj", Surface(notes=1))
def _twice() -> str:
    return obj(VERTICES, [*FACES, FACES[0][1:] + FACES[0][:1], FACES[5]])


@case("mesh_half_turned.obj", Surface(notes=1))
def _turned() -> str:
    return obj(VERTICES, [face[::-1] if k % 3 == 0 else face for k, face in enumerate(FACES)])


@case("mesh_empty_faces.obj", Surface(11, 11, ROOF + 0.5, notes=1))
def _empty() -> str:
    """A face without area, whose middle corner lies on its neighbour's side."""
    vertices = np.concatenate([VERTICES, [[1.0, -1.0, 0.0], [1.5, 0.0, 0.0]]])
    return obj(vertices, [*FACES, [1, 9, 10], [10, 9, 2], [1, 10, 2]])


@case("mesh_concave_polygon.obj", Surface(6, 4, 3.0))
def _concave() -> str:
    outline = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0]]
    return obj(outline, [[3, 4, 5, 0, 1, 2]])


@case("mesh_unused_vertices.obj", Surface())
def _unused() -> str:
    return obj(np.concatenate([VERTICES, [[50, 50, 50], [60, 0, 0]]]), FACES)


@case("mesh_far_away.obj", Surface())
def _far() -> str:
    return obj(VERTICES + [2.6e6, 1.2e6, 400.0], FACES)


@case("mesh_in_two_pieces.obj", Surface(18, 16, 2 * ROOF, disc=False))
def _pieces() -> str:
    faces = [*FACES, *(np.array(FACES) + 9).tolist()]
    return obj(np.concatenate([VERTICES, VERTICES + [5, 0, 0]]), faces)


@case("mesh_with_a_hole.obj", Surface(9, 7, ROOF * 7 / 8))
def _hole() -> str:
    """A triangle missing at the border."""
    return obj(VERTICES, FACES[1:])


@case("mesh_free_form_beside.obj", Surface())
def _free_form() -> str:
    return obj(VERTICES, FACES) + "cstype bezier\ndeg 1\ncurv 0 1 1 2\nparm u 0 1\nend\np 1\n"


@case("mesh_bad_vertex.obj", Refused("line 10: no such vertex"))
def _bad() -> str:
    return obj(VERTICES, [[0, 1, 9]])


@case("mesh_of_lines.obj", Refused("contains no faces"))
def _lines() -> str:
    return obj(VERTICES, []) + "l 1 2 3\n"


@case("mesh_without_area.obj", Refused("contains no faces with an area"))
def _flat() -> str:
    return "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"


def ply(kind: str, faces: Any = FACES, number: str = "float", more: str = "") -> bytes:
    """ASCII or binary PLY; more: a property that comes after the coordinates."""
    head = ["ply", f"format {kind} 1.0", "comment a roof", f"element vertex {len(VERTICES)}"]
    head += [f"property {number} {axis}" for axis in "xyz"]
    head += [f"property uchar {more}"] if more else []
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    text = "\n".join([*head, ""]).encode()
    if kind == "ascii":
        rows = [
            " ".join(f"{v:g}" for v in vertex) + (" 255" if more else "") for vertex in VERTICES
        ]
        rows += [" ".join(map(str, [len(face), *face])) for face in faces]
        return text + "\n".join([*rows, ""]).encode()
    order, code = "<" if "little" in kind else ">", "f" if number == "float" else "d"
    for vertex in VERTICES:
        text += struct.pack(f"{order}3{code}", *vertex) + (b"\xff" if more else b"")
    for face in faces:
        text += struct.pack(f"{order}B{len(face)}i", len(face), *face)
    return text


for _kind in ("ascii", "binary_little_endian", "binary_big_endian"):
    for _number in ("float", "double"):
        case(f"{_kind}_{_number}.ply", Surface())(
            lambda kind=_kind, number=_number: ply(kind, number=number)
        )
case("quads.ply", Surface(area=None))(lambda: ply("ascii", QUADS))
case("colours.ply", Surface())(lambda: ply("binary_little_endian", more="red"))
case("cut_off.ply", Refused("ends within its head"))(lambda: ply("ascii")[:120])


def stl(vertices: np.ndarray = VERTICES, head: bytes = b"a roof") -> bytes:
    content = head.ljust(80) + struct.pack("<I", len(FACES))
    for face in FACES:
        content += struct.pack("<12fH", 0, 0, 0, *vertices[face].ravel(), 0)
    return content


case("binary.stl", Surface(notes=1))(stl)
case("binary_that_begins_with_solid.stl", Surface(notes=1))(lambda: stl(head=b"solid roof"))
case("far_away.stl", Surface(notes=1))(lambda: stl(VERTICES + [4096.0, 8192.0, 0.0]))


@case("ascii.stl", Surface(notes=1))
def _ascii_stl() -> str:
    text = ["solid roof"]
    for face in FACES:
        text.append(" facet normal 0 0 1\n  outer loop")
        text += [f"   vertex {x:e} {y:e} {z:e}" for x, y, z in VERTICES[face]]
        text.append("  endloop\n endfacet")
    return "\n".join([*text, "endsolid roof", ""])


@case("cut_off.stl", Refused("ends after 2 of its 8 faces"))
def _cut_stl() -> bytes:
    return stl()[:200]


def compas(faces: Any = FACES, key: Callable[[int], Any] = str) -> dict[str, Any]:
    """The content of a COMPAS mesh."""
    return {
        "attributes": {"name": "Mesh"},
        "vertex": {str(key(k)): dict(zip("xyz", v)) for k, v in enumerate(VERTICES.tolist())},
        "face": {str(k): [key(v) for v in face] for k, face in enumerate(faces)},
        "facedata": {},
        "edgedata": {},
        "max_vertex": 8,
        "max_face": 7,
    }


def defaults(name: str) -> dict[str, Any]:
    return {name: {"x": 0.0, "y": 0.0, "z": 0.0}}


@case("compas_0_8.json", Surface())
def _compas_0_8() -> str:
    """Plain data with short names of the defaults, keys as texts in texts."""
    return json.dumps(compas(key=lambda k: f"'{k}'") | defaults("dva") | {"dea": {}, "dfa": {}})


@case("compas_0_16.json", Surface())
def _compas_0_16() -> str:
    data = compas() | defaults("dva")
    return json.dumps({"compas": "0.16.9", "datatype": "compas.datastructures/Mesh", "data": data})


@case("compas_1_17.json", Surface())
def _compas_1() -> str:
    data = compas(key=int) | defaults("dva")
    return json.dumps({"dtype": "compas.datastructures/Mesh", "value": data, "guid": "1"})


@case("compas_2.json", Surface())
def _compas_2() -> str:
    data = compas(key=int) | defaults("default_vertex_attributes")
    whole = {"dtype": "compas.datastructures/Mesh", "data": data, "inheritance": [], "guid": "2"}
    return json.dumps(whole)


@case("compas_2_quads.json", Surface(area=None))
def _compas_quads() -> str:
    return json.dumps({"dtype": "compas.datastructures/Mesh", "data": compas(QUADS, int)})


@case("compas_2_list.json", Surface())
def _compas_list() -> str:
    whole = {"dtype": "compas.datastructures/Mesh", "data": compas(key=int)}
    return json.dumps([{"dtype": "compas.geometry/Point", "data": [0, 0, 0]}, whole])


@case("compas_2_session.json", Surface())
def _compas_session() -> str:
    whole = {"dtype": "compas.datastructures/Mesh", "data": compas(key=int)}
    return json.dumps({"name": "a session", "objects": {"roof": whole}, "settings": {"u": 3}})


@case("compas_closed_faces.json", Surface())
def _compas_closed() -> str:
    data = compas(key=int)
    data["face"] = {k: [*face, face[0]] for k, face in data["face"].items()}
    return json.dumps(data)


@case("compas_default_heights.json", Surface())
def _compas_defaults() -> str:
    data = compas(key=int) | defaults("default_vertex_attributes")
    for vertex in data["vertex"].values():
        for axis in "xyz":
            if vertex[axis] == 0.0:
                del vertex[axis]
    return json.dumps(data)


@case("compas_byte_order_mark.json", Surface())
def _compas_bom() -> bytes:
    return b"\xef\xbb\xbf" + json.dumps(compas(key=int)).encode()


@case("compas_two_meshes.json", Refused("expected one COMPAS mesh, found 2"))
def _compas_two() -> str:
    return json.dumps([compas(), compas()])


@case("compas_bad_face.json", Refused("can't be read as a mesh"))
def _compas_bad() -> str:
    return json.dumps(compas() | {"face": {"0": [0, 1, 99]}})
