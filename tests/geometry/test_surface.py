"""Closest points on a triangulated surface: against brute force, features and derivatives, bad
meshes."""

import pickle
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.errors import InputError
from kop_exudyn.geometry.triangles import Feature, TriangleSurface

# A roof: two rectangles that meet in a ridge along y at height 1, each split into two triangles.
ROOF = TriangleSurface(
    [[-1, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 3, 0], [0, 3, 1], [1, 3, 0]],
    [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]],
)


def random_surface(seed):
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(5.0), np.arange(4.0), indexing="ij")
    vertices = np.column_stack([x.ravel(), y.ravel(), rng.uniform(-1, 1, 20)])
    corner = (np.arange(4)[:, None] * 4 + np.arange(3)).ravel()
    faces = np.concatenate(
        [
            np.column_stack([corner, corner + 4, corner + 5]),
            np.column_stack([corner, corner + 5, corner + 1]),
        ]
    )
    return TriangleSurface(vertices, faces)


def brute_force(surface, point):
    """Least distance over the inner point of each face's plane and the points of its edges."""
    best = np.inf
    for face, normal in zip(surface.faces, surface.normals):
        a, b, c = surface.vertices[face]
        inner = point - normal * (normal @ (point - a))
        system = np.vstack([np.column_stack([a, b, c]), np.ones(3)])
        weights = np.linalg.lstsq(system, np.append(inner, 1), rcond=None)[0]
        if weights.min() >= 0:
            best = min(best, np.linalg.norm(point - inner))
        for p, q in ((a, b), (b, c), (c, a)):
            t = np.clip((point - p) @ (q - p) / ((q - p) @ (q - p)), 0, 1)
            best = min(best, np.linalg.norm(point - p - t * (q - p)))
    return best


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 10_000))
def test_distances_equal_brute_force(seed):
    surface = random_surface(seed)
    points = np.random.default_rng(seed).uniform(-2, 6, (6, 3))
    found = surface.closest(points)
    np.testing.assert_allclose(
        np.sqrt(found.squared_distances), [brute_force(surface, p) for p in points], rtol=1e-9
    )
    np.testing.assert_allclose(
        np.sum((points - found.points) ** 2, axis=1), found.squared_distances, rtol=1e-12
    )


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 10_000))
def test_derivative_of_the_projection(seed):
    surface = random_surface(seed)
    rng = np.random.default_rng(seed)
    points, direction = rng.uniform(-2, 6, (40, 3)), rng.normal(size=(40, 3))
    h = 1e-6
    here, plus, minus = (
        surface.closest(p) for p in (points, points + h * direction, points - h * direction)
    )
    same = (
        (plus.features == here.features)
        & (minus.features == here.features)
        & (plus.faces == minus.faces)
    )
    assert same.sum() > 30
    slope = (plus.points - minus.points) / (2 * h)
    expected = np.einsum("nij,nj->ni", here.derivative, direction)
    np.testing.assert_allclose(slope[same], expected[same], atol=1e-7)


def test_features_of_a_roof():
    points = [[-0.5, 1, 1], [0, 1, 2], [0.1, 2, 3], [0, -1, 2], [-3, -1, 0]]
    found = ROOF.closest(np.array(points, dtype=float))
    assert [Feature(f) for f in found.features] == [
        Feature.FACE,
        Feature.EDGE,
        Feature.EDGE,
        Feature.VERTEX,
        Feature.VERTEX,
    ]
    np.testing.assert_allclose(found.points[1:4], [[0, 1, 1], [0, 2, 1], [0, 0, 1]], atol=1e-14)
    np.testing.assert_allclose(found.derivative[1], np.diag([0, 1, 0]), atol=1e-14)
    np.testing.assert_allclose(
        found.derivative[0], [[0.5, 0, 0.5], [0, 1, 0], [0.5, 0, 0.5]], atol=1e-14
    )
    assert not found.derivative[3].any()


def test_flat_inner_edges_and_points_on_the_surface_count_as_faces():
    flat = TriangleSurface(
        [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [1, 1, 0]],
        [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
    )
    found = flat.closest(np.array([[0.5, 0.5, 1], [1, 1, -2], [1, 1, 0], [0, 0, 0]]))
    assert np.all(found.features == Feature.FACE)
    np.testing.assert_allclose(
        found.derivative, np.tile(np.diag([1.0, 1, 0]), (4, 1, 1)), atol=1e-14
    )


def test_size_ignores_unused_vertices():
    surface = TriangleSurface([[0, 0, 0], [3, 0, 0], [0, 4, 0], [99, 0, 0]], [[0, 1, 2]])
    assert surface.size == pytest.approx(np.sqrt(3) * (3 + 4 + 5) / 4)


def test_survives_pickling_with_its_tree_built():
    points = np.array([[0.2, 1.0, 4.0]])
    before = ROOF.closest(points)
    after = pickle.loads(pickle.dumps(ROOF)).closest(points)
    np.testing.assert_array_equal(after.points, before.points)


@pytest.mark.parametrize(
    "vertices, faces, message",
    [
        ([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]], "vertices.*shape"),
        ([[0, 0, "x"]], [[0, 0, 0]], "vertices.*points"),
        ([], [[0, 1, 2]], "vertices"),
        ([[0, 0, 0], [1, 0, np.nan], [0, 1, 0]], [[0, 1, 2]], r"vertices\[1\].*finite"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 3]], r"faces\[0\].*doesn't exist"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, -1]], r"faces\[0\].*doesn't exist"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1]], "faces.*shape"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 1]], "faces.*triangles"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0.5, 1, 2]], "faces.*numbers"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [], "faces"),
        (
            [[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]],
            [[0, 1, 2], [0, 1, 3]],
            r"faces\[1\].*without area",
        ),
    ],
)
def test_unusable_meshes(vertices, faces, message):
    with pytest.raises(InputError, match=message):
        TriangleSurface(vertices, faces)


def test_unusable_points():
    with pytest.raises(InputError, match="finite points"):
        ROOF.closest(np.array([[0, 0, np.inf]]))


def test_search_trees_are_gone_when_the_process_ends():
    """Of surfaces in cycles of objects, too, where garbage is no longer looked for: kop optimize
    ended with fifty lines of complaints."""
    script = """
import atexit, gc
import numpy as np
from kop_exudyn.geometry.triangles import TriangleSurface

surface = TriangleSurface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
surface.closest(np.zeros((1, 3)))
surface.itself = surface
atexit.register(gc.freeze)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
