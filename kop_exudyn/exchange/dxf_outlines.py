"""What one entity of a DXF file draws."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..checks import LARGEST
from ..errors import InputError, shown_place
from ..geometry.nurbs import spline_points
from .outlines import Outline

_FRAME_VERTEX = 16  # flag of a polyline's vertex: of the polygon that controls a spline
_FIT_PIECES = 8  # between two fit points


def outline_of(entity: Any, label: str, matrix: Any = None) -> Outline | None:
    """What an entity draws; None for one of a single point. Raises InputError naming it.

    matrix : of ezdxf, the affine map of the block that it is of into the drawing
    """
    try:
        read = {"SPLINE": _spline, "HELIX": _spline, "MLINE": _middle}.get(entity.dxftype(), _path)
        outline = read(entity, matrix)
    except InputError as error:
        raise InputError(error.message, field=f"{label}{_begin(entity)}") from None
    except Exception as error:
        raise InputError(
            f"can't be read as a curve: {str(error)[:100]}", field=f"{label}{_begin(entity)}"
        ) from None
    corners = outline.corners
    if not (np.abs(corners) <= LARGEST).all():
        raise InputError("is no curve: expected points within 1e60", field=label)
    return outline if len(corners) > 1 and np.ptp(corners, axis=0).any() else None


def _path(entity: Any, matrix: Any) -> Outline:
    """Lines, arcs and polylines; of polylines with a spline through or near their vertices, the
    points on the spline, which such files have beside its control polygon."""
    from ezdxf import path as paths

    if entity.dxftype() == "POLYLINE":
        on_curve = [v for v in entity.vertices if not v.dxf.flags & _FRAME_VERTEX]
        if len(on_curve) > 1:
            entity.vertices[:] = on_curve
    path = paths.make_path(entity)
    if matrix is not None:
        path = path.transform(matrix)
    corners = _points(path.control_vertices())
    if path.has_curves:
        return Outline(corners, lambda sag: _points(path.flattening(sag)), path.is_closed)
    return Outline(corners, lambda sag: corners, path.is_closed)


def _middle(entity: Any, matrix: Any) -> Outline:
    """The middle of a multiline's outermost lines, which a lath of some width is drawn with."""
    points = []
    for vertex in entity.vertices:
        offsets = [line[0] for line in vertex.line_params if len(line)]
        middle = 0.5 * (min(offsets) + max(offsets)) if offsets else 0.0
        points.append(vertex.location + vertex.miter_direction * middle)
    corners = _points(points if matrix is None else matrix.transform_vertices(points))
    closed = bool(entity.is_closed) and len(corners) > 2
    corners = np.concatenate([corners, corners[:1]]) if closed else corners
    return Outline(corners, lambda sag: corners, closed)


def _spline(entity: Any, matrix: Any) -> Outline:
    """A spline by its control points, else through its fit points."""
    control, fit = (
        _points(x if matrix is None else matrix.transform_vertices(x))
        for x in (entity.control_points, entity.fit_points)
    )
    if len(control):
        knots, weights = list(entity.knots), list(entity.weights)

        def points(sag: float) -> np.ndarray:
            return spline_points(control, knots, entity.dxf.degree, weights, sag)

        x = points(np.inf)  # refuses what doesn't fit
        size = float(np.linalg.norm(np.ptp(control, axis=0)))
        return Outline(control, points, float(np.linalg.norm(x[0] - x[-1])) <= 1e-9 * size)
    if len(fit) > 2 and entity.closed:
        if (fit[0] == fit[-1]).all():
            fit = fit[:-1]
        return Outline(fit, lambda sag: _loop_through(fit), True)
    return _path(entity, matrix)


def _loop_through(points: np.ndarray) -> np.ndarray:
    """Points (n, 3), the first one again at the end, on the smooth closed curve through points."""
    from scipy.interpolate import CubicSpline

    loop = np.concatenate([points, points[:1]])
    t = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(loop, axis=0), axis=1))])
    if not (np.diff(t) > 0).all():
        raise InputError("has two fit points in a row that are the same")
    shares = np.linspace(t[:-1], t[1:], _FIT_PIECES, endpoint=False).T.ravel()
    return CubicSpline(t, loop, bc_type="periodic")(np.append(shares, t[-1]))


def _points(points: Iterable[Any]) -> np.ndarray:
    return np.array([tuple(point) for point in points], float).reshape(-1, 3)


def _begin(entity: Any) -> str:
    """Where an entity begins, as far as it says so: handles mean nothing to who draws."""
    for name in ("start", "insert", "center"):
        place = entity.dxf.get(name) if entity.dxf.is_supported(name) else None
        if place is not None:
            return f" at {shown_place(place)}"
    return ""
