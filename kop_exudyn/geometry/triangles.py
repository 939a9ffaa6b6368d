"""Closest points on a triangulated surface, with the derivative of the projection onto it."""

from __future__ import annotations

import atexit
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Any
from weakref import WeakSet

import numpy as np

from ..errors import InputError
from .extent import size_of_points

# Barycentric coordinates below this are zero: the closest point lies on an edge or a vertex.
_ON_EDGE = 1e-10
_NEXT, _LAST = [1, 2, 0], [2, 0, 1]  # of three, from each on
_LARGEST = 1e150  # of coordinates, whose squares don't overflow
# A point belongs to a face when its offset from the surface is normal to the face up to these
# errors.
_NORMAL_ABSOLUTE, _NORMAL_RELATIVE = 1e-12, 1e-9


class Feature(IntEnum):
    """What a closest point lies on; the value is its dimension."""

    VERTEX = 0
    EDGE = 1
    FACE = 2


@dataclass(frozen=True)
class Closest:
    """Closest points of n query points.

    points (n, 3) : the projections P(x) onto the surface
    normals (n, 3) : unit normals of the faces they lie in
    faces (n,) : those faces
    squared_distances (n,)
    features (n,) : `Feature` that each lies on
    edges (n, 3) : unit direction of the edge, where the feature is one; else zero
    """

    points: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    squared_distances: np.ndarray
    features: np.ndarray
    edges: np.ndarray

    @cached_property
    def derivative(self) -> np.ndarray:
        """(n, 3, 3) dP/dx: I - n n^T on a face, e e^T on an edge, 0 at a vertex.

        It is exact unless the surface's closest feature changes at x, where it is the derivative
        from one side.
        """
        out = np.eye(3) - self.normals[:, :, None] * self.normals[:, None, :]
        others = np.flatnonzero(self.features != Feature.FACE)
        edges = self.edges[others]  # zero at vertices
        out[others] = edges[:, :, None] * edges[:, None, :]
        return out


_BY_ZEROS = np.array([Feature.FACE, Feature.EDGE, Feature.VERTEX, Feature.VERTEX])

# libigl complains of trees that are left when the process ends, as they are where surfaces belong
# to cycles of objects and garbage isn't looked for any more.
_WITH_TREES: WeakSet[TriangleSurface] = WeakSet()


@atexit.register
def _without_trees() -> None:
    for surface in list(_WITH_TREES):
        vars(surface).pop("_tree", None)


class TriangleSurface:
    """A triangle mesh with its search tree, built once.

    vertices : (V, 3) coordinates
    faces : (F, 3) vertex indices Raises InputError for wrong shapes, values that aren't finite,
    indices out of range and faces without area.
    """

    def __init__(self, vertices: Any, faces: Any):
        self.vertices = _vertices(vertices)
        self.faces = _faces(faces, len(self.vertices))
        self.normals, self._doubled_areas = _unit_normals(self.vertices, self.faces)

    @cached_property
    def size(self) -> float:
        """See `extent.size_of_points`."""
        used = self.vertices[np.unique(self.faces)]
        return size_of_points(used)

    def closest(self, points: np.ndarray) -> Closest:
        """Closest points of points (n, 3)."""
        points = np.ascontiguousarray(points, dtype=float)
        # beyond that squares overflow, and libigl names faces that don't exist
        near = points.size == 0 or np.abs(points).max() < _LARGEST
        if points.ndim != 2 or points.shape[1] != 3 or not near:
            raise InputError(
                "expected finite points of shape (n, 3)", field="points", value=points.shape
            )
        squared, faces, projected = self._tree.squared_distance(self.vertices, self.faces, points)
        squared, faces, projected = (
            np.atleast_1d(squared),
            np.atleast_1d(faces),
            np.reshape(projected, points.shape),
        )
        features, edges = self._features(points, projected, faces)
        return Closest(projected, self.normals[faces], faces, squared, features, edges)

    @cached_property
    def _tree(self) -> Any:
        import igl

        tree = igl.AABB()
        tree.init(self.vertices, self.faces)
        _WITH_TREES.add(self)
        return tree

    def __getstate__(self) -> dict[str, Any]:
        """The tree isn't picklable; another process builds its own."""
        return {name: value for name, value in self.__dict__.items() if name != "_tree"}

    def _features(
        self, points: np.ndarray, projected: np.ndarray, faces: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Feature (n,) and edge direction (n, 3) of each closest point.

        A point above an inner edge of a flat region, or on the surface itself, is one of a face
        although its projection has a zero barycentric coordinate: there an edge's derivative would
        be wrong.
        """
        features, edges = np.full(len(faces), Feature.FACE), np.zeros((len(faces), 3))
        offset, normals = points - projected, self.normals[faces]
        height = np.einsum("nk,nk->n", offset, normals)
        offset -= height[:, None] * normals
        aside = np.sqrt(np.einsum("nk,nk->n", offset, offset))
        others = np.flatnonzero(
            aside > _NORMAL_ABSOLUTE * self.size + _NORMAL_RELATIVE * np.abs(height)
        )
        if len(others):
            corners = self.vertices[self.faces[faces[others]]]
            starts = corners[:, _NEXT]
            along = corners[:, _LAST] - starts  # the edges opposite to the corners
            across = _cross(along, projected[others, None] - starts)
            shares = np.einsum("nck,nk->nc", across, normals[others])
            zero = np.abs(shares) < _ON_EDGE * self._doubled_areas[faces[others], None]
            count = zero.sum(axis=1)
            features[others] = _BY_ZEROS[count]
            on_edge = count == 1  # opposite to the corner whose barycentric coordinate is zero
            edge = along[on_edge, zero[on_edge].argmax(axis=1)]
            edges[others[on_edge]] = edge / np.linalg.norm(edge, axis=1, keepdims=True)
        return features, edges


def barycentric(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """(n, 3) barycentric coordinates of points (n, 3) in triangles with these corners (n, 3, 3)."""
    second, third = corners[:, _NEXT], corners[:, _LAST]
    inward = points[:, None, :] - second
    area = _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    parts = np.einsum("nck,nk->nc", _cross(third - second, inward), area)
    return parts / np.einsum("nk,nk->n", area, area)[:, None]


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Products (..., 3) of vectors (..., 3); of few of them three times as fast as numpy.cross."""
    return a[..., _NEXT] * b[..., _LAST] - a[..., _LAST] * b[..., _NEXT]


def _vertices(values: Any) -> np.ndarray:
    try:
        vertices = np.array(values, dtype=float, order="C")
    except (TypeError, ValueError):
        raise InputError("expected a list of points (x, y, z)", field="vertices") from None
    if vertices.ndim != 2 or vertices.shape[1] != 3 or len(vertices) == 0:
        raise InputError("expected points of shape (n, 3)", field="vertices", value=vertices.shape)
    if not np.isfinite(vertices).all():
        row = int(np.argwhere(~np.isfinite(vertices))[0, 0])
        raise InputError(
            "coordinates must be finite", field=f"vertices[{row}]", value=vertices[row].tolist()
        )
    return vertices


def _faces(values: Any, n_vertices: int) -> np.ndarray:
    try:
        given = np.array(values)
    except ValueError:
        raise InputError("expected a list of triangles", field="faces") from None
    if (
        given.ndim != 2
        or given.shape[1] != 3
        or len(given) == 0
        or not np.issubdtype(given.dtype, np.integer)
    ):
        raise InputError(
            "expected vertex numbers of shape (n, 3)", field="faces", value=given.shape
        )
    bad = np.any((given < 0) | (given >= n_vertices), axis=1)
    if bad.any():
        row = int(bad.argmax())
        raise InputError(
            f"names a vertex that doesn't exist (there are {n_vertices})",
            field=f"faces[{row}]",
            value=given[row].tolist(),
        )
    return np.ascontiguousarray(given, dtype=np.int64)


def _unit_normals(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(F, 3), and twice the areas (F,); InputError for faces without area."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    longest = np.max([np.sum((p - q) ** 2, axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    bad = lengths <= 1e-12 * longest
    if bad.any():
        row = int(bad.argmax())
        raise InputError("a face without area", field=f"faces[{row}]", value=faces[row].tolist())
    return normals / lengths[:, None], lengths
