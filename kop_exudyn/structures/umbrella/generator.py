"""Makes umbrella designs of our own: a target surface, a patch of triangles laid on it, initial arm
lengths.

The surface is flattened conformally, so that triangles of the base mesh only grow or shrink on it.
A cell that has to grow by s when it opens gets arms of length L, L^2 = (s r_c - r_p)^2 + (h/2 -
t/2)^2 with r_c and r_p the inradii of base triangle and plate, h the deployed spacing of the
plates, t the thickness: the rule of the published designs.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
import shapely

from ...errors import InputError
from ...geometry.triangles import TriangleSurface
from .layout import BaseMesh, Plates

# The shortest published arms (32 mm on plates of 30 mm) belong to about this growth.
LEAST_GROWTH = 4.0
_MAX_ADJUSTMENTS = 60
_FEWEST_FACES = 500
_ON_SURFACE = 1e-9  # of the plane's size: round-off of points on its border


def hexagon_patch(rings: int, edge: float) -> tuple[np.ndarray, np.ndarray]:
    """A hexagon of 6 rings^2 triangles: vertices (V, 2), faces (F, 3)."""
    return _patch(
        [(i, j) for i in range(-rings, rings) for j in range(-rings, rings)],
        edge,
        lambda corner: max(abs(corner[0]), abs(corner[1]), abs(corner[0] + corner[1])) <= rings,
    )


def parallelogram_patch(m: int, n: int, edge: float) -> tuple[np.ndarray, np.ndarray]:
    """A parallelogram of 2 m n triangles: vertices (V, 2), faces (F, 3)."""
    return _patch([(i, j) for i in range(m) for j in range(n)], edge, lambda corner: True)


def triangle_patch(n: int, edge: float) -> tuple[np.ndarray, np.ndarray]:
    """A triangle of n^2 triangles: vertices (V, 2), faces (F, 3)."""
    return _patch(
        [(i, j) for i in range(n) for j in range(n - i)],
        edge,
        lambda corner: corner[0] + corner[1] <= n,
    )


def height_field(
    height: Callable[[np.ndarray, np.ndarray], np.ndarray],
    size: float,
    n: int = 32,
) -> tuple[np.ndarray, np.ndarray]:
    """The surface z = height(x, y) over the square |x|, |y| <= size / 2: vertices ((n + 1)^2, 3),
    faces (2 n^2, 3)."""
    return parametric_patch(lambda u, v: (u * size, v * size, height(u * size, v * size)), n)


def parametric_patch(
    surface: Callable[[np.ndarray, np.ndarray], Any], n: int = 32
) -> tuple[np.ndarray, np.ndarray]:
    """Points surface(u, v) = (x, y, z) for u and v in [-1/2, 1/2]: vertices ((n + 1)^2, 3), faces
    (2 n^2, 3)."""
    u, v = np.meshgrid(np.linspace(-0.5, 0.5, n + 1), np.linspace(-0.5, 0.5, n + 1), indexing="ij")
    vertices = np.stack([np.broadcast_to(c, u.shape).ravel() for c in surface(u, v)], axis=1)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    a, b, c, d = corner, corner + n + 1, corner + n + 2, corner + 1
    return vertices, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def design_on_surface(
    name: str,
    base: BaseMesh,
    vertices: np.ndarray,
    faces: np.ndarray,
    *,
    plates: Plates = Plates(),
    least_growth: float = LEAST_GROWTH,
    turn: float = 0.0,
    density: float | None = None,
    limits: tuple[float, float] | None = None,
) -> dict[str, Any]:
    """The content of a design file: a base mesh laid on the middle of a surface.

    vertices (V, 3), faces (F, 3) : surface, disc-like; its scale matters: it decides how strongly
        the cells curve
    least_growth : of the cell that grows least; it fixes how large a part of the surface is covered
    turn : rad, of the base mesh on the surface
    density : of arms and plates, tonnes / mm^3, for their weight
    limits : elastic limits of arms and plates, N / mm^2, for their utilisation

    Raises InputError where the surface can't be flattened or the base mesh reaches beyond it.
    """
    vertices, faces = _fine_enough(vertices, faces)
    flat = _Flattened(vertices, faces)
    c, s = np.cos(turn), np.sin(turn)
    points = (base.vertices - base.vertices.mean(axis=0)) @ np.array([[c, s], [-s, c]])
    scale = least_growth / 2  # small enough to lie within the surface
    for _ in range(_MAX_ADJUSTMENTS):  # how much the cells grow depends on where they come to lie
        growth = _growth(base, flat.lift(scale * points))
        if abs(growth.min() / least_growth - 1) < 1e-6:
            break
        # growth that falls outwards makes full steps overshoot
        scale *= (least_growth / growth.min()) ** 0.8
    inradius_plate = base.inradius - plates.thickness / 2
    rise = (plates.spacing - plates.thickness) / 2
    lengths = np.sqrt((growth * base.inradius - inradius_plate) ** 2 + rise**2)
    crossings = flat.lift(scale * points[base.inner].mean(axis=1))
    middles = flat.lift(scale * points[base.faces].mean(axis=1))
    near = flat.around(scale * points)
    kept, where = np.unique(faces[near], return_inverse=True)
    weighing = {} if density is None else {"density": density}
    arms, plate_rods = ({"elastic_limit": limit} for limit in limits) if limits else ({}, {})
    return {
        "format": "kop_exudyn/design",
        "version": 1,
        "class": "umbrella",
        "name": name,
        "units": {"length": "mm", "force": "N"},
        "base": {
            "vertices": base.vertices.round(6).tolist(),
            "faces": base.faces.tolist(),
            "flipped": base.flipped,
        },
        "lengths": np.repeat(lengths[:, None], 2, axis=1).round(4).tolist(),
        "plates": {
            "arm_position": plates.arm_position,
            "thickness": plates.thickness,
            "width": plates.width,
            "spacing": plates.spacing,
        },
        "materials": {
            "arms": {"young": 1400.0, "poisson": 0.35, **weighing, **arms},
            "plates": {"young": 14000.0, "poisson": 0.35, **weighing, **plate_rods},
        },
        "target": {
            "vertices": vertices[kept].round(3).tolist(),
            "faces": where.reshape(-1, 3).tolist(),
            "crossings": crossings.round(3).tolist(),
            "plates": middles.round(3).tolist(),
        },
    }


def _fine_enough(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same surface in more faces where it has few, so that one of its vertices is near to its
    middle and the faces below the design can be told from others."""
    from trimesh.remesh import subdivide

    vertices, faces = np.asarray(vertices, float), np.asarray(faces)
    while len(faces) < _FEWEST_FACES:
        vertices, faces = subdivide(vertices, faces)
    return vertices, faces


def _patch(
    cells: list[tuple[int, int]],
    edge: float,
    inside: Callable[[tuple[int, int]], bool],
) -> tuple[np.ndarray, np.ndarray]:
    """Both triangles of the lattice cells (i, j) whose corners are all inside."""
    numbers: dict[tuple[int, int], int] = {}
    faces = []
    for i, j in cells:
        for corners in (((i, j), (i + 1, j), (i, j + 1)), ((i + 1, j), (i + 1, j + 1), (i, j + 1))):
            if all(inside(corner) for corner in corners):
                faces.append([numbers.setdefault(corner, len(numbers)) for corner in corners])
    lattice = np.array(list(numbers), float)
    vertices = edge * lattice @ np.array([[1.0, 0.0], [0.5, np.sqrt(3) / 2]])
    return vertices - vertices.mean(axis=0), np.array(faces)


def _growth(base: BaseMesh, lifted: np.ndarray) -> np.ndarray:
    """(n_cells,) root of the ratio of areas on the surface (vertices (V, 3)) and in the base
    mesh."""
    a, b, c = (lifted[base.faces[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return np.sqrt(area / (np.sqrt(3) / 4 * base.edge**2))


class _Flattened:
    """A surface and its least-squares conformal map to the plane (Levy et al., ACM TOG 21(3),
    2002).

    The vertex nearest to the surface's middle lies at the origin; there the map keeps lengths.
    """

    def __init__(self, vertices: np.ndarray, faces: np.ndarray):
        import igl

        self.vertices, self.faces = np.asarray(vertices, float), np.asarray(faces, np.int64)
        boundary = igl.boundary_loop(self.faces)
        ends = boundary[[0, len(boundary) // 2]]
        distance = np.linalg.norm(self.vertices[ends[1]] - self.vertices[ends[0]])
        plane = igl.lscm(
            self.vertices,
            self.faces,
            ends.astype(np.int64),
            np.array([[0.0, 0.0], [distance, 0.0]]),
        )[0]
        middle = self.vertices[np.unique(self.faces)].mean(axis=0)
        origin = int(np.argmin(np.linalg.norm(self.vertices - middle, axis=1)))
        star = np.any(self.faces == origin, axis=1)
        plane = plane - plane[origin]
        areas = _signed_areas(plane, self.faces)
        if np.any(areas * areas[0] <= 0):
            raise InputError("can't be flattened without folds", field="surface")
        scale = np.sqrt(_areas(self.vertices, self.faces[star]).sum() / np.abs(areas[star]).sum())
        # the plane's axes are the surface's in the middle, seen from above
        around = self.faces[star].ravel()
        gradient = np.linalg.lstsq(
            plane[around], (self.vertices - self.vertices[origin])[around], rcond=None
        )[0]
        angle = np.arctan2(gradient[1, 0], gradient[0, 0])
        c, s = np.cos(angle), np.sin(angle)
        self.plane = scale * plane @ np.array([[c, -s], [s, c]])
        if areas[0] * _signed_areas(self.vertices, self.faces)[0] < 0:
            self.plane[:, 1] *= -1

    def lift(self, points: np.ndarray) -> np.ndarray:
        """Points (n, 2) of the plane on the surface (n, 3); InputError beyond its edge."""
        face, weights = self._locate(points)
        return np.einsum("nk,nkc->nc", weights, self.vertices[self.faces[face]])

    def around(self, points: np.ndarray) -> np.ndarray:
        """Faces (m,) of the part of the surface that matters: those within a margin of the points'
        extent, and of large faces those that reach into it."""
        extent = np.linalg.norm(points, axis=1).max()
        corners = self.plane[self.faces]
        within = np.linalg.norm(corners.mean(axis=1), axis=1) <= 1.15 * extent
        reaching = shapely.distance(shapely.polygons(corners), shapely.Point(0.0, 0.0)) <= extent
        return np.flatnonzero(within | reaching)

    @cached_property
    def _map(self) -> TriangleSurface:
        """The plane as a mesh, for finding the faces of its points."""
        return TriangleSurface(np.column_stack([self.plane, np.zeros(len(self.plane))]), self.faces)

    def _locate(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Faces (n,) of the plane's points (n, 2), and barycentric coordinates (n, 3) in them."""
        found = self._map.closest(np.column_stack([points, np.zeros(len(points))]))
        if np.sqrt(found.squared_distances.max()) > _ON_SURFACE * self._map.size:
            raise InputError(
                "the base mesh reaches beyond the surface: take fewer cells or smaller plates, or, "
                "where the surface isn't drawn in the design's unit, say so by --scale",
                field="surface",
            )
        corners = self.plane[self.faces[found.faces]]
        edges = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
        local = np.linalg.solve(edges, (points - corners[:, 0])[:, :, None])[:, :, 0]
        return found.faces, np.concatenate([1 - local.sum(axis=1, keepdims=True), local], axis=1)


def _areas(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def _signed_areas(plane: np.ndarray, faces: np.ndarray) -> np.ndarray:
    a, b, c = (plane[faces[:, k], :2] for k in range(3))
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
