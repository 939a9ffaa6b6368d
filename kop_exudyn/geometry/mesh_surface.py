"""Triangle meshes as smooth surfaces: a chart of the mesh, and a cubic B-spline surface fitted to
it.

Curvatures of a mesh itself are defined only in the mean. The fit is a penalised tensor-product
spline (P-splines: Eilers, Marx, Statistical Science 11(2), 1996), so that every formula for smooth
surfaces applies; how far it lies from the mesh's vertices is measured, and limited.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..errors import InputError
from .mesh_files import read_mesh
from .surfaces import PLAN_AXES, Surface
from .triangles import TriangleSurface, barycentric

_DEGREE = 3
_MIN_CELLS, _MAX_CELLS = 4, 40
_VERTICES_A_CELL = 4.0
_PENALTY = 1e-5  # of the mean data weight of a coefficient
_MAX_DEVIATION = 0.01  # of its size


class MeshSurface(Surface):
    """A mesh patch with one border.

    vertices (V, 3), faces (F, 3)
    chart : "plane": the parameters are the two coordinates across the axis `up` (x, y for "z"); the
        mesh must not overhang. "conformal": least-squares conformal map (Levy et al., SIGGRAPH
        2002), scaled to the mesh's area, centred, and turned so that u and v follow x and y best.
    Raises InputError for meshes that have no such chart and for such as the smooth surface can't
    follow; `deviation` is its largest distance from the mesh's vertices at equal parameters.
    """

    def __init__(self, vertices: Any, faces: Any, chart: str = "plane", up: str = "z"):
        self.mesh = TriangleSurface(vertices, faces)
        used = np.unique(self.mesh.faces)
        if len(used) < len(self.mesh.vertices):
            self.mesh = TriangleSurface(
                self.mesh.vertices[used], np.searchsorted(used, self.mesh.faces)
            )
        flat = (
            _conformal(self.mesh) if chart == "conformal" else self.mesh.vertices[:, PLAN_AXES[up]]
        )
        self._check_chart(flat, chart, up)
        self._flat = TriangleSurface(np.column_stack([flat, np.zeros(len(flat))]), self.mesh.faces)
        self.lower, self.upper = flat.min(axis=0), flat.max(axis=0)
        self._fit(flat)

    def _check_chart(self, flat: np.ndarray, chart: str, up: str) -> None:
        """Raise _NoChart where parameters (V, 2) don't belong to one place of the mesh each."""
        seen = f"seen along {up}" if chart == "plane" else "in its conformal chart"
        area = _signed_areas(flat, self.mesh.faces)
        turned = area <= 0 if (area > 0).sum() >= (area < 0).sum() else area >= 0
        middles = self.mesh.vertices[self.mesh.faces].mean(axis=1)
        if turned.any():
            text = (
                f"folds over, {seen}: {turned.sum():,} of its {len(area):,} triangles are upright "
                "or turned over"
            )
            if chart == "plane" and is_disc(self.mesh):
                text += (
                    ' (a surface that overhangs needs "chart": "conformal", at import --chart '
                    "conformal with the curves drawn in space on it)"
                )
            else:
                text += ": give one sheet, without sides and other things"
            raise _NoChart(text, middles[int(np.argmax(turned))])
        twice = _covered_twice(flat, self.mesh.faces)
        if twice is not None:
            text = f"has two sheets above each other, {seen}: give one of them"
            raise _NoChart(text, middles[twice])

    @property
    def flat(self) -> np.ndarray:
        """(V, 2) parameters of the mesh's vertices."""
        return self._flat.vertices[:, :2]

    def parameters_of(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Parameters (n, 2) of the mesh's points nearest to points (n, 3), and their distances."""
        found = self.mesh.closest(np.asarray(points, float))
        weights = barycentric(found.points, self.mesh.vertices[self.mesh.faces[found.faces]])
        flat = self.flat[self.mesh.faces[found.faces]]
        return np.einsum("nk,nkc->nc", weights, flat), np.sqrt(found.squared_distances)

    def contains(self, uv: np.ndarray) -> np.ndarray:
        uv = np.asarray(uv, float)
        found = self._flat.closest(np.column_stack([uv, np.zeros(len(uv))]))
        return found.squared_distances <= (1e-6 * self._flat.size) ** 2

    def derivatives(self, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        uv = np.asarray(uv, float)
        rows = [[spline(uv[:, axis]) for spline in self._bases[axis]] for axis in range(2)]

        def value(du: int, dv: int) -> np.ndarray:
            return np.einsum("na,nb,abi->ni", rows[0][du], rows[1][dv], self._coefficients)

        first = np.stack([value(1, 0), value(0, 1)], axis=2)
        mixed = value(1, 1)
        second = np.stack(
            [np.stack([value(2, 0), mixed], axis=2), np.stack([mixed, value(0, 2)], axis=2)], axis=2
        )
        return value(0, 0), first, second

    def _fit(self, flat: np.ndarray) -> None:
        """Penalised least squares through the vertices; the penalty leaves linear functions
        free."""
        extent = self.upper - self.lower
        from scipy.sparse.linalg import spsolve

        cells = np.sqrt(len(flat) / _VERTICES_A_CELL * extent / extent[::-1])
        # halves go down, on whichever side of them rounding leaves a mesh that is moved
        cells = np.clip(np.ceil(cells - 0.5 - 1e-6), _MIN_CELLS, _MAX_CELLS).astype(int)
        knots = [
            np.linspace(low - _DEGREE * step, high + _DEGREE * step, n + 2 * _DEGREE + 1)
            for low, high, n, step in zip(self.lower, self.upper, cells, extent / cells)
        ]
        self._bases = [_basis(t, n + _DEGREE) for t, n in zip(knots, cells)]
        n, m = (int(c) + _DEGREE for c in cells)
        (i, a), (j, b) = (_active(flat[:, axis], knots[axis]) for axis in range(2))
        columns = (i[:, :, None] * m + j[:, None, :]).reshape(len(flat), -1)
        values = (a[:, :, None] * b[:, None, :]).reshape(len(flat), -1)
        starts = np.arange(len(flat) + 1) * columns.shape[1]
        rows = sp.csr_array((values.ravel(), columns.ravel(), starts), shape=(len(flat), n * m))
        bends = [
            sp.kron(_second_difference(n), sp.eye(m)),
            sp.kron(sp.eye(n), _second_difference(m)),
        ]
        weight = _PENALTY * len(flat) / (n * m)
        matrix = rows.T @ rows + weight * sum(bend.T @ bend for bend in bends)
        solution = spsolve(sp.csc_array(matrix), rows.T @ self.mesh.vertices)
        self._coefficients = np.asarray(solution).reshape(n, m, 3)
        off = np.linalg.norm(rows @ np.asarray(solution) - self.mesh.vertices, axis=1)
        self.deviation = float(off.max())
        if not self.deviation <= _MAX_DEVIATION * self.mesh.size:
            raise InputError(
                f"is too rough to be followed by a smooth surface (off by "
                f"{100 * self.deviation / self.mesh.size:.1f} % of its size)",
                field="surface",
            )


class _NoChart(InputError):
    """A mesh without a chart: for what reason, and place (3,) where that shows."""

    def __init__(self, reason: str, place: np.ndarray):
        super().__init__(f"the mesh {reason}", field="surface", value=_shown(place))
        self.reason, self.place = reason, place


def _shown(place: np.ndarray) -> str:
    return f"({', '.join(f'{x:.6g}' for x in place)})"


def load_mesh_surface(
    path: Path,
    chart: str = "plane",
    up: str = "z",
    scale: float = 1.0,
    origin: np.ndarray | float = 0.0,
) -> MeshSurface:
    """The surface of a mesh file, see `read_mesh`, its lengths times the scale, less an origin (3,)
    in scaled lengths. Raises InputError naming the file, and the place in its coordinates."""
    vertices, faces = read_mesh(path)
    try:
        return MeshSurface(scale * vertices - origin, faces, chart, up)
    except InputError as error:
        message = error.message
        if isinstance(error, _NoChart):
            message = f"near {_shown((error.place + origin) / scale)} it {error.reason}"
        raise InputError(message, field="surface.file", value=path.name) from None


def is_disc(mesh: TriangleSurface) -> bool:
    """Whether a mesh, all of whose vertices are in use, is in one piece with exactly one border and
    no handles."""
    import igl

    edges = len(
        np.unique(np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    )
    return (
        len(igl.boundary_loop_all(mesh.faces)) == 1
        and len(mesh.vertices) - edges + len(mesh.faces) == 1
    )


def _basis(knots: np.ndarray, n: int) -> list[Any]:
    """The n basis functions as one vector-valued spline, with its first two derivatives."""
    from scipy.interpolate import BSpline

    spline = BSpline(knots, np.eye(n), _DEGREE)
    return [spline, spline.derivative(1), spline.derivative(2)]


def _active(x: np.ndarray, knots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers and values (n, degree + 1) of the basis functions that don't vanish at x (n,)."""
    from scipy.interpolate import BSpline

    within = np.clip(x, knots[_DEGREE], knots[-_DEGREE - 1])  # round-off in the knots
    matrix = BSpline.design_matrix(within, knots, _DEGREE)
    return matrix.indices.reshape(len(x), -1).astype(int), matrix.data.reshape(len(x), -1)


def _second_difference(n: int) -> sp.sparray:
    return sp.diags_array([1.0, -2.0, 1.0], offsets=[0, 1, 2], shape=(n - 2, n))


def _signed_areas(flat: np.ndarray, faces: np.ndarray) -> np.ndarray:
    a, b, c = (flat[faces[:, k]] for k in range(3))
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def _covered_twice(flat: np.ndarray, faces: np.ndarray) -> int | None:
    """A face whose middle lies in another face as well, in the plane; None where there is none."""
    import shapely

    corners = flat[faces]
    tree = shapely.STRtree(shapely.polygons(corners))
    points, found = tree.query(shapely.points(corners.mean(axis=1)), predicate="within")
    other = points[points != found]
    return int(other[0]) if len(other) else None


def _conformal(mesh: TriangleSurface) -> np.ndarray:
    """(V, 2) least-squares conformal map of a disc."""
    import igl

    if not is_disc(mesh):
        raise InputError(
            "a conformal chart needs a mesh in one piece with exactly one border",
            field="surface.chart",
            value="conformal",
        )
    loop = np.array(igl.boundary_loop_all(mesh.faces)[0])
    ends = loop[
        [0, int(np.argmax(np.linalg.norm(mesh.vertices[loop] - mesh.vertices[loop[0]], axis=1)))]
    ]
    apart = float(np.linalg.norm(np.diff(mesh.vertices[ends], axis=0)))
    flat = np.asarray(
        igl.lscm(mesh.vertices, mesh.faces, ends, np.array([[0.0, 0.0], [apart, 0.0]]))[0]
    )
    faces = mesh.faces
    area3 = 0.5 * np.linalg.norm(
        np.cross(
            mesh.vertices[faces[:, 1]] - mesh.vertices[faces[:, 0]],
            mesh.vertices[faces[:, 2]] - mesh.vertices[faces[:, 0]],
        ),
        axis=1,
    )
    flat = flat * np.sqrt(area3.sum() / np.abs(_signed_areas(flat, faces).sum()))
    flat -= (flat[faces].mean(axis=1) * area3[:, None]).sum(axis=0) / area3.sum()
    xy = mesh.vertices[:, :2] - mesh.vertices[:, :2].mean(axis=0)
    left, _, right = np.linalg.svd(flat.T @ xy)
    return flat @ (left @ np.diag([1.0, np.linalg.det(left @ right)]) @ right)
