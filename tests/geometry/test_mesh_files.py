"""Meshes from files of other programs."""

import json
import struct

import numpy as np
import pytest
import trimesh

from kop_exudyn.errors import InputError
from kop_exudyn.geometry.mesh_files import read_mesh

# as Mesh.from_vertices_and_faces(...).to_json() of COMPAS 2.15 writes it
COMPAS_2 = {
    "dtype": "compas.datastructures/Mesh",
    "data": {
        "attributes": {},
        "default_vertex_attributes": {"x": 0.0, "y": 0.0, "z": 0.0},
        "default_edge_attributes": {},
        "default_face_attributes": {},
        "vertex": {
            "0": {"x": 0, "y": 0, "z": 0},
            "1": {"x": 1, "y": 0, "z": 0},
            "2": {"x": 1, "y": 1, "z": 0.5},
            "3": {"x": 0, "y": 1, "z": 0},
            "4": {"x": 2, "y": 0, "z": 0},
        },
        "face": {"0": [0, 1, 2, 3], "1": [1, 4, 2]},
        "facedata": {"0": {}, "1": {}},
        "edgedata": {},
        "max_vertex": 4,
        "max_face": 1,
    },
    "inheritance": [],
    "guid": "920ef0d3-d7e9-457f-a9b1-23bb1a53fd7b",
}
VERTICES = [[0, 0, 0], [1, 0, 0], [1, 1, 0.5], [0, 1, 0], [2, 0, 0]]


def area(vertices, faces) -> float:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


@pytest.mark.parametrize(
    "data",
    [
        COMPAS_2,
        {"dtype": "compas.datastructures/Mesh", "value": COMPAS_2["data"]},  # version 1
        [COMPAS_2],
        {"a mesh": COMPAS_2},  # compas.json_dump of a list, of a dict
        COMPAS_2["data"],
    ],
)
def test_compas_meshes(data, write_json_file):
    vertices, faces = read_mesh(write_json_file("mesh.json", data))
    np.testing.assert_array_equal(vertices, VERTICES)
    # the quad along its shorter diagonal
    assert faces.tolist() == [[0, 1, 3], [1, 2, 3], [1, 4, 2]]


def test_compas_keys_and_default_coordinates(write_json_file):
    """Keys need not be 0, 1, 2, ..., and what is the default need not be written."""
    data = {
        "default_vertex_attributes": {"x": 0.0, "y": 0.0, "z": 3.0},
        "vertex": {
            "7": {},
            "9": {"x": 2.0},
            "11": {"x": 2.0, "y": 1.0},
            "20": {"x": 1.0, "y": 2.0},
            "21": {"y": 1},
        },
        "face": {"3": [7, 9, 11, 20, 21]},
    }
    vertices, faces = read_mesh(write_json_file("mesh.json", data))
    assert vertices[:, 2].tolist() == [3.0] * 5 and faces.tolist() == [
        [0, 1, 2],
        [0, 2, 3],
        [0, 3, 4],
    ]
    assert area(vertices, faces) == pytest.approx(3.0)


@pytest.mark.parametrize("suffix", ["obj", "ply", "stl"])
def test_other_formats_agree(suffix, tmp_path, write_json_file):
    compas = read_mesh(write_json_file("mesh.json", COMPAS_2))
    path = tmp_path / f"mesh.{suffix}"
    trimesh.Trimesh(*compas).export(path)
    assert area(*read_mesh(path)) == pytest.approx(area(*compas), rel=1e-6)


def changed(**changes) -> str:
    return json.dumps(COMPAS_2["data"] | changes)


@pytest.mark.parametrize(
    "name, content, message",
    [
        ("mesh.3dm", "", "is no mesh file"),
        ("mesh.json", "{", "can't be read as a mesh"),
        ("mesh.json", "{}", "expected one COMPAS mesh, found 0"),
        ("mesh.json", json.dumps([COMPAS_2, COMPAS_2]), "expected one COMPAS mesh, found 2"),
        ("mesh.json", changed(face={}), "contains no faces"),
        ("mesh.json", changed(face={"0": [0, 1, 77]}), "can't be read as a mesh: '77'"),
        ("mesh.json", changed(face={"0": [0, 1]}), "three or more different vertices"),
        ("mesh.json", changed(face={"0": [0, 1, 2, 1]}), "three or more different vertices"),
        (
            "mesh.json",
            changed(vertex={"0": {"x": "left"}}),
            "can't be read as a mesh: could not convert",
        ),
        (
            "mesh.json",
            changed(vertex={"0": {"x": float("nan")}, "1": {}, "2": {}}, face={"0": [0, 1, 2]}),
            "finite",
        ),
        ("mesh.ply", "ply\nformat", "ends within its head"),
    ],
)
def test_bad_files(name, content, message, tmp_path):
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(InputError, match=message) as caught:
        read_mesh(path)
    assert caught.value.value == name and caught.value.field == "surface.file"


def test_a_missing_file(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_mesh(tmp_path / "mesh.json")


def test_a_grid_on_a_compas_mesh(repository, write_json_file, tmp_path):
    """The same design as on the same mesh in OBJ."""
    from kop_exudyn.io.designs import load_design

    design = json.loads((repository / "models" / "grids" / "06_mesh.json").read_text())
    vertices, faces = read_mesh(repository / "models" / "grids" / "vault.obj")
    write_json_file(
        "vault.json",
        {
            "dtype": "compas.datastructures/Mesh",
            "data": {
                "vertex": {str(k): dict(zip("xyz", x)) for k, x in enumerate(vertices.tolist())},
                "face": {str(k): face for k, face in enumerate(faces.tolist())},
            },
        },
    )
    design["surface"]["file"] = "vault.json"
    again = load_design(write_json_file("design.json", design))
    wanted = load_design(repository / "models" / "grids" / "06_mesh.json")
    np.testing.assert_allclose(again.parameters, wanted.parameters, rtol=1e-12)


SQUARE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], float)


def binary_stl(says=2, behind=b"", order="<"):
    """Two triangles of a square."""
    content = b"made by hand".ljust(80) + struct.pack(f"{order}I", says)
    for face in ((0, 1, 2), (1, 3, 2)):
        content += struct.pack(f"{order}12fH", 0, 0, 1, *SQUARE[list(face)].ravel(), 7)
    return content + behind


def off(head="OFF\n4 2 0\n", faces="3 0 1 2\n3 1 3 2\n"):
    return (head + "".join(f"{x} {y} {z}\n" for x, y, z in SQUARE) + faces).encode()


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("bytes_behind.stl", binary_stl(behind=b"\0" * 7)),
        ("head_like_text.stl", b"solid" + binary_stl()[5:]),
        ("plain.off", off()),
        ("head_in_one_line.off", off("OFF 4 2 0 # four and two\n\n")),
        ("comments.off", off("# made by hand\nOFF\n# numbers\n4 2 0\n")),
    ],
)
def test_what_programs_write_besides_the_faces(name, content, tmp_path):
    (tmp_path / name).write_bytes(content)
    vertices, faces = read_mesh(tmp_path / name)
    assert len(vertices) == 4 and len(faces) == 2


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("cut_off.stl", binary_stl(says=3), "ends after 2 of its 3 faces"),
        ("big_endian.stl", binary_stl(order=">"), "ends after 2 of its 33,554,432 faces"),
        ("damaged_head.stl", binary_stl(says=1), "has 2 faces, but says that it has 1"),
        ("cut_off.off", off("OFF\n4 3 0\n"), "ends after 6 of its 7 vertices and faces"),
        ("no_word.off", off("4 2 0\n"), 'doesn\'t begin with "OFF"'),
        ("no_numbers.off", b"OFF\n", "doesn't say how many"),
        ("binary.off", b"OFF BINARY\n\0\0\0\4", "is a binary OFF file"),
        ("cut_off.ply", b"ply\nformat ascii 1.0\nelement vertex 3\n", "ends within its head"),
        ("deep.json", b"[" * 100_000, "nested too deeply"),
    ],
)
def test_damage_is_called_by_its_name(name, content, message, tmp_path):
    """Some of it was read without what is missing, or told in words of the reader's code."""
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=message):
        read_mesh(tmp_path / name)
