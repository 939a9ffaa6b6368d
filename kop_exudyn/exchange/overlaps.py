"""Curves that lie on each other along a part of their way: every stretch is kept once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import shapely

from .corners import cosines_of_turns
from .drawing import DrawnCurve, Finding
from .outlines import place_of

_GRID = 1e-4  # of the tolerance, that shared stretches are rounded to
_CORNER = np.cos(np.pi / 4)  # cosine of the turn at a sharp corner


def without_overlaps(
    curves: list[DrawnCurve], tolerance: float
) -> tuple[list[DrawnCurve], list[Finding]]:
    """Curves in one level plane, such as closed polygons around the cells of a net, in pieces that
    share no stretch; others are left as they are.

    tolerance : a length; shorter common stretches are left
    """
    z = np.concatenate([curve.points[:, 2] for curve in curves])
    if np.ptp(z) > tolerance:
        return curves, []
    lines = np.array([_line(curve) for curve in curves])
    i, j = shapely.STRtree(lines).query(lines, predicate="intersects")
    i, j = i[i < j], j[i < j]
    # what curves share lies in both their boxes: most neighbours in a net meet in a point
    low, high = np.split(shapely.bounds(lines), 2, axis=1)
    common = np.minimum(high[i], high[j]) - np.maximum(low[i], low[j])
    may_share = np.hypot(*common.T) > tolerance
    i, j = i[may_share], j[may_share]
    if not len(i):
        return curves, []
    grid = _GRID * tolerance
    shared = shapely.length(shapely.intersection(lines[i], lines[j], grid_size=grid))
    some = shared > tolerance
    touched = sorted({*i[some].tolist(), *j[some].tolist()})
    if not touched:
        return curves, []
    first = curves[touched[0]]
    pieces = shapely.get_parts(shapely.unary_union(lines[touched], grid_size=grid))
    merged = [
        replace(first, points=points, closed=False, label=f"piece from {place_of(points[0])}")
        for piece in pieces
        for points in _without_corners(_raised(piece, z[0]))
    ]
    kept = [curve for k, curve in enumerate(curves) if k not in set(touched)]
    longest = int(np.argmax(shared))
    text = (
        f"{len(touched)} curves lie on each other along parts of their way, such as "
        f"{curves[i[longest]].label} and {curves[j[longest]].label}: each part is read once"
    )
    places = np.array([curves[k].points.mean(axis=0) for k in touched])
    return kept + merged, [Finding("suspicious", text, places)]


def _line(curve: DrawnCurve) -> shapely.LineString:
    points = curve.path
    return shapely.LineString(points[:, :2])


def _raised(piece: shapely.LineString, z: float) -> np.ndarray:
    plan = shapely.get_coordinates(piece)
    return np.column_stack([plan, np.full(len(plan), z)])


def _without_corners(points: np.ndarray) -> Iterator[np.ndarray]:
    """A polyline (n, 3) in parts that have no sharp corners."""
    sharp = np.flatnonzero(cosines_of_turns(points[:, :2]) < _CORNER) + 1
    for start, end in zip([0, *sharp], [*sharp, len(points) - 1]):
        yield points[start : end + 1]
