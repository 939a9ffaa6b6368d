"""Curves that lie on each other along a part of their way: every stretch is kept once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import shapely
import shapely.ops

from .corners import cosines_of_turns
from .drawing import DrawnCurve, Finding
from .frames import Frame
from .outlines import Places

_GRID = 1e-4  # of the tolerance, that shared stretches are rounded to
_ALONG = 20.0  # times the tolerance: two curves that are together so far go along each other
_SAMPLES = 65
_CORNER = np.cos(np.pi / 4)  # cosine of the turn at a sharp corner


def without_overlaps(
    curves: list[DrawnCurve], frame: Frame, tolerance: float, say: Places
) -> tuple[list[DrawnCurve], list[Finding]]:
    """Curves in one plane in pieces that share no stretch; others are left as they are.

    Closed polygons around the cells of a net share their sides, laths drawn in pieces overlap at
    the pieces' ends.

    frame : the plane; tolerance : a length; shorter common stretches are left, curves within it lie
    on each other; say : of places in the drawing
    """
    z = np.concatenate([frame(curve.points)[:, 2] for curve in curves])
    if np.ptp(z) > tolerance:
        return curves, []
    curves, shared = _shared_once(curves, frame, float(np.median(z)), tolerance, say)
    curves, trimmed = _trimmed(curves, frame, float(np.median(z)), tolerance)
    return curves, [*shared, *trimmed]


def _shared_once(
    curves: list[DrawnCurve], frame: Frame, height: float, tolerance: float, say: Places
) -> tuple[list[DrawnCurve], list[Finding]]:
    """Stretches that are the same to rounding, each once."""
    lines = np.array([_line(curve, frame) for curve in curves])
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
        replace(first, points=points, closed=False, label=f"piece from {say(points[0])}")
        for piece in pieces
        for plan in _without_corners(shapely.get_coordinates(piece))
        for points in [_raised(plan, height, frame)]
    ]
    kept = [curve for k, curve in enumerate(curves) if k not in set(touched)]
    longest = int(np.argmax(shared))
    named = (curves[i[longest]].label, curves[j[longest]].label)
    places = np.array([curves[k].points.mean(axis=0) for k in touched])
    return kept + merged, [_told(len(touched), named, places)]


def _told(count: int, named: tuple[str, str], places: np.ndarray) -> Finding:
    text = (
        f"{count} curves lie on each other along parts of their way, such as {named[0]} and "
        f"{named[1]}: each part is read once"
    )
    return Finding("suspicious", text, places)


def _trimmed(
    curves: list[DrawnCurve], frame: Frame, height: float, tolerance: float
) -> tuple[list[DrawnCurve], list[Finding]]:
    """Pieces of one line that overlap at their ends, within the tolerance: the one that begins on
    the other is cut off where that one ends. Curves whose ends touch others and then part from them
    are left as they are."""
    lines = np.array([_line(curve, frame) for curve in curves])
    open_ends = [(k, end) for k, curve in enumerate(curves) if not curve.closed for end in (0, 1)]
    starts = shapely.get_point(lines[[k for k, _ in open_ends]], [-e for _, e in open_ends])
    at, near = shapely.STRtree(lines).query(starts, predicate="dwithin", distance=tolerance)
    changed: dict[int, int] = {}  # curve -> the other that it lay on
    for n, other in zip(at.tolist(), near.tolist()):
        k, end = open_ends[n]
        if other == k or curves[other].closed:
            continue
        own = shapely.reverse(lines[k]) if end else lines[k]
        rest = _beyond(own, lines[other], tolerance)
        if rest is not None:
            lines[k] = shapely.reverse(rest) if end else rest
            changed[k] = other
    if not changed:
        return curves, []
    found = [
        replace(curve, points=_raised(shapely.get_coordinates(line), height, frame))
        if k in changed
        else curve
        for k, (curve, line) in enumerate(zip(curves, lines))
    ]
    first, other = next(iter(changed.items()))
    named = (curves[first].label, curves[other].label)
    touched = sorted({*changed, *changed.values()})
    places = np.array([curves[k].points.mean(axis=0) for k in touched])
    return found, [_told(len(touched), named, places)]


def _beyond(
    own: shapely.LineString, other: shapely.LineString, tolerance: float
) -> shapely.LineString | None:
    """The part of a line past another one that it begins on, away from that one's ends, from where
    that one ends; None where it doesn't, where the two part before, or nothing is left."""
    at = other.project(shapely.get_point(own, 0))
    away = own.interpolate(_ALONG * tolerance)
    if not tolerance < at < other.length - tolerance or other.distance(away) > tolerance:
        return None
    ends = [shapely.get_point(other, n) for n in (0, -1)]
    stations = [own.project(end) for end in ends if own.distance(end) <= tolerance]
    stations = [s for s in stations if tolerance < s < own.length - tolerance]
    if not stations:
        return None
    cut = max(stations)
    common = shapely.ops.substring(own, 0.0, cut)
    steps = common.interpolate(np.linspace(0.0, common.length, _SAMPLES))
    if shapely.distance(other, steps).max() > tolerance:
        return None
    return shapely.ops.substring(own, cut, own.length)


def _line(curve: DrawnCurve, frame: Frame) -> shapely.LineString:
    return shapely.LineString(frame(curve.path)[:, :2])


def _raised(plan: np.ndarray, height: float, frame: Frame) -> np.ndarray:
    return frame.back(np.column_stack([plan, np.full(len(plan), height)]))


def _without_corners(points: np.ndarray) -> Iterator[np.ndarray]:
    """A polyline (n, 2) in parts that have no sharp corners."""
    sharp = np.flatnonzero(cosines_of_turns(points[:, :2]) < _CORNER) + 1
    for start, end in zip([0, *sharp], [*sharp, len(points) - 1]):
        yield points[start : end + 1]
