"""Meshes as CAD programs write them: one surface comes of all of them."""

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.errors import InputError
from kop_exudyn.geometry import mesh_files
from kop_exudyn.geometry.mesh_cleaning import cleaned, triangles_of, turned_alike, without_empty
from kop_exudyn.geometry.mesh_files import read_mesh
from kop_exudyn.geometry.mesh_surface import is_disc
from kop_exudyn.geometry.triangles import TriangleSurface


def grid(n: int = 5):
    """(n + 1)^2 vertices over the unit square, 2 n^2 faces that look upwards."""
    at = np.linspace(0, 1, n + 1)
    x, y = (a.ravel() for a in np.meshgrid(at, at, indexing="ij"))
    k = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = (q.ravel() for q in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return np.stack([x, y, 0.3 * x * y], axis=1), faces


def area(vertices, faces) -> float:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def disc(vertices, faces) -> bool:
    return is_disc(TriangleSurface(vertices, faces))


def test_a_clean_mesh_stays_as_it_is():
    vertices, faces = grid()
    places, kept, notes = cleaned(vertices, faces)
    np.testing.assert_array_equal(places, vertices)
    np.testing.assert_array_equal(kept, faces)
    assert notes == []


@settings(deadline=None, max_examples=25)
@given(seed=st.integers(0, 10**6), noise=st.sampled_from([0.0, 1e-7]), offset=st.floats(-1e3, 1e3))
def test_corners_of_their_own_are_welded(seed, noise, offset):
    """Every face with its own three vertices, in any order, with noise, anywhere."""
    rng = np.random.default_rng(seed)
    vertices, faces = grid(4)
    corners = vertices[faces].reshape(-1, 3) + offset
    corners += noise * rng.uniform(-1, 1, corners.shape)
    order = rng.permutation(len(corners))
    mixed = np.argsort(order)[np.arange(len(corners))].reshape(-1, 3)
    places, kept, notes = cleaned(corners[order], mixed)
    assert len(places) == 25 and len(kept) == 32 and disc(places, kept)
    assert area(places, kept) == pytest.approx(area(vertices, faces), rel=1e-5)
    assert notes == ["96 corners welded into 25 vertices"]


def test_faces_turned_round_and_there_twice():
    vertices, faces = grid()
    mixed = faces.copy()
    mixed[::3] = mixed[::3, ::-1]
    _, kept, notes = cleaned(vertices, np.concatenate([mixed, mixed[:4, [1, 2, 0]]]))
    assert len(kept) == 50
    a, b, c = (vertices[kept[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()
    assert notes == [
        "4 faces that are there twice left out",
        "17 faces turned round, to face like the others",
    ]


def test_most_faces_tell_which_side_is_up():
    _, faces = grid()
    assert (turned_alike(faces[:, ::-1])[0] == faces[:, ::-1]).all()


def test_a_face_without_area_leaves_no_slit():
    """The middle corner of a flat face lies on its neighbour's side: that one is cut in two."""
    vertices = np.array([[0, 0, 0], [2, 0, 0], [1, 2, 0], [1, 0, 0], [1, -2, 0]], float)
    faces = np.array([[0, 1, 2], [0, 3, 1], [0, 4, 3], [3, 4, 1]])
    kept, left_out = without_empty(vertices, faces)
    assert left_out == 1 and len(kept) == 4
    places, found, _ = cleaned(vertices, faces)
    assert disc(places, found) and area(places, found) == pytest.approx(4.0)


def test_concave_polygons():
    outline = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0]], float)
    for shift in range(6):
        faces = triangles_of([np.roll(np.arange(6), shift).tolist()], outline)
        assert len(faces) == 4 and area(outline, faces) == pytest.approx(3.0)
        assert disc(outline, faces)


def test_triangles_written_as_quads():
    """Some programs repeat the last corner."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    assert triangles_of([[0, 1, 2, 2]], vertices).tolist() == [[0, 1, 2]]


class TestObj:
    HEAD = "mtllib {}\nv 0 0 0\nv 1 0 0 1.0 0.5 0.2\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n"

    def test_seams_normals_groups_and_materials(self, tmp_path):
        path = tmp_path / "mesh.obj"
        path.write_text(
            self.HEAD.format("no.mtl")
            + "o a\nusemtl red\ns 1\nf 1/1/1 2/1/1 3/1/1\ng b\nusemtl blue\n"
            + "f -4//1 -2//1 \\\n -1//1\n"
            + "v 1 0 0\nv 1 1 0\nv 2 0 0\nf 5/1 7/1 6/1\ncurv 0 1 1 2\n"
        )
        vertices, faces = read_mesh(path)
        assert len(vertices) == 5 and len(faces) == 3 and disc(vertices, faces)

    def test_material_files_are_not_opened(self, tmp_path):
        """A pipe that nobody writes to would be waited for, for good."""
        import os

        os.mkfifo(tmp_path / "pipe.mtl")
        path = tmp_path / "mesh.obj"
        path.write_text(self.HEAD.format("pipe.mtl") + "usemtl a\nf 1 2 3\nf 1 3 4\n")
        assert len(read_mesh(path)[1]) == 2

    @pytest.mark.parametrize(
        "text, message",
        [
            ("v 0 0 0\nf 1 2 3\n", "line 2: no such vertex"),
            ("v 0 0 zero\n", "line 1: expected three coordinates"),
            ("v 0 0 0\nv 1 0 0\nf 1 2\n", "line 3: a face needs at least three"),
            ("v 0 0 0\nv 1 0 0\nl 1 2\n", "contains no faces"),
            ("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "contains no faces with an area"),
        ],
    )
    def test_mistakes(self, text, message, tmp_path):
        path = tmp_path / "mesh.obj"
        path.write_text(text)
        with pytest.raises(InputError, match=f"surface.file = 'mesh.obj': {message}"):
            read_mesh(path)


class TestLimits:
    def test_a_binary_stl_says_how_many_faces_it_has(self, tmp_path, monkeypatch):
        path = tmp_path / "mesh.stl"
        monkeypatch.setattr(mesh_files, "MOST_FACES", 10)
        # the limit has to act before the faces are made: these can't be read
        path.write_bytes(bytes(80) + struct.pack("<I", 11) + b"\xff" * 550)
        with pytest.raises(InputError, match="has 11 faces, at most 10 are read"):
            read_mesh(path)

    def test_large_files(self, tmp_path, monkeypatch):
        path = tmp_path / "mesh.ply"
        path.write_bytes(b"ply\n" * 100)
        monkeypatch.setattr(mesh_files, "_SIZE_LIMIT", 300)
        with pytest.raises(InputError, match="is larger than"):
            read_mesh(path)


@pytest.mark.parametrize("far", [1e61, -1e300, np.inf, np.nan])
def test_corners_that_are_nowhere_are_refused_by_name(far):
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, far, 0], [0, 0, far]])
    faces = np.array([[0, 1, 2], [1, 3, 2]])
    with pytest.raises(InputError, match="corner 3 is no place") as caught:
        cleaned(corners, faces)
    assert caught.value.field == "vertices"
    places, kept, _ = cleaned(corners, faces[:1])  # who isn't used may be anywhere
    assert len(places) == 3 and len(kept) == 1


def test_the_file_of_a_corner_without_place_is_named(tmp_path):
    path = tmp_path / "far.ply"
    path.write_text(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\n"
        "property double z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n1 1e300 0\n3 0 1 2\n3 1 3 2\n"
    )
    with pytest.raises(InputError, match=r"'far.ply': vertices = \[1.0, 1e\+300, 0.0\]: corner 3"):
        read_mesh(path)
