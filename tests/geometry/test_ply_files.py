"""PLY files as text and binary: faces, strips, edges, and what is damaged."""

import io

import numpy as np
import pytest
from plyfile import PlyData, PlyElement

from kop_exudyn.errors import InputError
from kop_exudyn.exchange.mesh_edges import edges_of
from kop_exudyn.geometry.mesh_files import read_mesh
from kop_exudyn.geometry.ply_files import parse_ply, triangles_of_strip

WAYS = ({"text": True}, {"byte_order": "<"}, {"byte_order": ">"})
N = 4


def vertices():
    return np.array([(i, j, 0.1 * i * j) for i in range(N) for j in range(N)], float)


def ply(way, **elements):
    """A file of a net of N x N vertices; elements: name -> lists of vertices, or pairs of edges."""
    points = vertices().astype(np.float32)
    found = [np.array([tuple(p) for p in points], [("x", "f4"), ("y", "f4"), ("z", "f4")])]
    described = [PlyElement.describe(found[0], "vertex")]
    for name, rows in elements.items():
        if name == "edge":
            data = np.array(rows, [("vertex1", "i4"), ("vertex2", "i4")])
        else:
            data = np.empty(len(rows), [("vertex_indices", "O")])
            data["vertex_indices"] = [np.array(row, np.int32) for row in rows]
        described.append(PlyElement.describe(data, name))
    out = io.BytesIO()
    PlyData(described, **way).write(out)
    return out.getvalue()


QUADS = [
    [i * N + j, (i + 1) * N + j, (i + 1) * N + j + 1, i * N + j + 1]
    for i in range(N - 1)
    for j in range(N - 1)
]
STRIP = [
    k
    for i in range(N - 1)
    for k in [*sum(([i * N + j, (i + 1) * N + j] for j in range(N)), []), -1]
]


@pytest.mark.parametrize("way", WAYS)
def test_strips_are_the_surface_of_their_quads(way, tmp_path):
    area = []
    for name, rows in (("face", QUADS), ("tristrips", [STRIP])):
        (tmp_path / "a.ply").write_bytes(ply(way, **{name: rows}))
        points, faces = read_mesh(tmp_path / "a.ply")
        assert len(faces) == 2 * (N - 1) ** 2
        normals = np.cross(*(points[faces[:, k]] - points[faces[:, 0]] for k in (1, 2)))
        assert (normals[:, 2] > 0).all() or (normals[:, 2] < 0).all()  # all face alike
        area.append(0.5 * np.linalg.norm(normals, axis=1).sum())
    assert area[0] == pytest.approx(area[1], rel=0.02)  # quads are cut along either diagonal


def test_a_strip_goes_on_elsewhere():
    assert triangles_of_strip([0, 1, 2, 3]) == [[0, 1, 2], [2, 1, 3]]
    assert triangles_of_strip([0, 1, 2, -1, 4, 5, 6]) == [[0, 1, 2], [4, 5, 6]]
    assert triangles_of_strip([0, 1, 2, 2, 4, 4, 5]) == [[0, 1, 2]]


@pytest.mark.parametrize("way", WAYS)
def test_a_net_by_its_quads_or_its_own_edges(way, tmp_path):
    sides = {tuple(sorted(p)) for q in QUADS for p in zip(q, [*q[1:], q[0]])}
    for name, elements in (("quads", {"face": QUADS}), ("edges", {"edge": sorted(sides)})):
        (tmp_path / f"{name}.ply").write_bytes(ply(way, **elements))
        curves = edges_of(tmp_path / f"{name}.ply").curves
        found = {tuple(map(tuple, np.round(c.points, 6))) for c in curves}
        points = np.round(vertices().astype(np.float32).astype(float), 6)
        assert found == {(tuple(points[a]), tuple(points[b])) for a, b in sides}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("end", [3, 60, 150, 200])
def test_a_file_that_is_cut_off_is_refused(way, end):
    content = ply(way, face=QUADS, edge=[(0, 1)])
    with pytest.raises(InputError, match="PLY|cut off"):
        parse_ply(content[:end])
    with pytest.raises(InputError):
        parse_ply(content[:-2])


def test_what_a_file_claims_is_not_believed(tmp_path):
    content = ply({"byte_order": "<"}, tristrips=[STRIP])
    with pytest.raises(InputError, match="ends before its 900,000,000,000 elements vertex"):
        parse_ply(content.replace(b"element vertex 16", b"element vertex 900000000000"))
    with pytest.raises(InputError, match="names a vertex that isn't there"):
        parse_ply(ply({"text": True}, edge=[(0, 99)]))
    with pytest.raises(InputError, match="without finite coordinates"):
        text = ply({"text": True}, edge=[(0, 1)]).replace(b"\n0 1 0", b"\n0 nan 0", 1)
        parse_ply(text)
