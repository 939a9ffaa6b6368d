"""Where drawn curves meet others than by their ends, and ends that just miss another curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ..geometry.crossings import near_crossings
from ..geometry.curves import Curve
from .drawing import DrawnCurve, path_of

_LEVEL = 1e-3  # of the size: curves farther apart in height pass each other


def plan_lines(
    curves: Sequence[DrawnCurve], flat: Sequence[np.ndarray]
) -> list[shapely.LineString]:
    """The curves as lines in plan.

    flat : their points (n, 2) there
    """
    return [shapely.LineString(path_of(x, curve.closed)) for curve, x in zip(curves, flat)]


def crossing_pieces(
    curves: Sequence[DrawnCurve], flat: Sequence[np.ndarray], tolerance: float, size: float
) -> list[tuple[int, int]]:
    """Pairs of pieces that cross, or one of which ends on the other, but not where their ends meet.

    flat : the curves' points (n, 2) in plan; heights are taken from the curves
    tolerance, size : lengths
    """
    lines = plan_lines(curves, flat)
    if len(lines) < 2:
        return []
    i, j = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=tolerance)
    i, j = i[i < j], j[i < j]
    line = np.array(lines)
    shared = shapely.intersection(line[i], line[j])
    apart = shapely.is_empty(shared)
    shared[apart] = shapely.get_point(shapely.shortest_line(line[i[apart]], line[j[apart]]), 0)
    ends = [
        shapely.MultiPoint([] if curve.closed else x[[0, -1]]) for curve, x in zip(curves, flat)
    ]
    found = []
    for k, (a, b) in enumerate(zip(i.tolist(), j.tolist())):
        for point in shapely.points(shapely.get_coordinates(shared[k])):
            at_ends = [
                not ends[c].is_empty and ends[c].distance(point) <= 3 * tolerance for c in (a, b)
            ]
            if all(at_ends):
                continue
            heights = [_height(curves[c], lines[c], point) for c in (a, b)]
            if abs(heights[0] - heights[1]) <= max(_LEVEL * size, tolerance):
                found.append((a, b))
                break
    return found


def _height(curve: DrawnCurve, line: shapely.LineString, point: shapely.Point) -> float:
    """z of a curve above the place in plan nearest to a point."""
    steps = np.diff(shapely.get_coordinates(line), axis=0)
    stations = np.concatenate([[0.0], np.cumsum(np.hypot(*steps.T))])
    z = curve.points[:, 2]
    z = np.append(z, z[0]) if curve.closed else z
    return float(np.interp(line.project(point), stations, z))


@dataclass(frozen=True)
class EndContact:
    """An end of a curve beside another curve that it crosses there, or would if it went on.

    curve, end : the curve's number, 0 or -1; other : the other curve's number
    beyond : how far the curve goes on beyond the other one; negative where it stops short of it
    position (2,) : where they cross
    """

    curve: int
    end: int
    other: int
    beyond: float
    position: np.ndarray


def end_contacts(curves: Sequence[Curve], reach: float) -> list[EndContact]:
    """All contacts of ends that are at most `reach` (a length, straight on) from another curve."""
    found = []
    for crossing in near_crossings(curves, reach):
        for k in (0, 1):
            curve, station = crossing.curves[k], crossing.stations[k]
            if curves[curve].closed:
                continue
            for end, beyond in ((0, station), (-1, curves[curve].length - station)):
                if beyond <= reach:
                    other = crossing.curves[1 - k]
                    found.append(EndContact(curve, end, other, beyond, crossing.position))
    return found
