"""Drawn curves without what a hand or a program leaves in them: points on top of each other, tiny
tails, curves that are there twice, ends that miss each other by a hair.

All of it is judged by one tolerance, a share of the drawing's size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..wording import counted
from .drawing import DrawnCurve, Finding

TOLERANCE = 2e-4  # of the drawing's size
_TOLD = 3  # findings of a kind that are told one by one
_ROUND_OFF = 1e-9  # of the size: less is not worth a word


def cleaned(
    curves: Sequence[DrawnCurve], tolerance: float
) -> tuple[list[DrawnCurve], list[Finding]]:
    """The curves, cleaned, and what was done to them.

    tolerance : a length; points, ends and curves nearer to each other than this are the same
    """
    findings: list[Finding] = []
    kept = []
    for curve in curves:
        found = _without_repetitions(curve, tolerance)
        if found is None:
            findings.append(
                Finding("skipped", f"{curve.label} is a single point", curve.points[:1])
            )
            continue
        lost = len(curve.points) - len(found.points) - (found.closed and not curve.closed)
        if lost:
            text = f"{counted(lost, 'repeated point')} left out of {curve.label}"
            findings.append(Finding("cleaned", text))
        kept.append(found)
    kept, doubles = _without_doubles(kept, tolerance)
    kept, gaps = _ends_together(kept, tolerance)
    return kept, _in_sum(findings) + doubles + gaps


def _in_sum(findings: Sequence[Finding]) -> list[Finding]:
    """The same, those of many curves in one."""
    points = [f for f in findings if f.kind == "cleaned"]
    if len(points) <= _TOLD:
        return list(findings)
    total = sum(int(f.text.split()[0].replace(",", "")) for f in points)
    text = f"{counted(total, 'repeated point')} left out of {counted(len(points), 'curve')}"
    return [f for f in findings if f.kind != "cleaned"] + [Finding("cleaned", text)]


def _without_repetitions(curve: DrawnCurve, tolerance: float) -> DrawnCurve | None:
    """Without points that nearly are the one before; closed where the ends are the same. An end
    stays where it is: what goes is the point beside it. None where a single point is left."""
    points, last = curve.points, 0
    kept = [0]
    for k in range(1, len(points)):
        if np.linalg.norm(points[k] - points[last]) > tolerance:
            kept.append(k)
            last = k
    end = len(points) - 1
    if kept[-1] != end and not curve.closed:
        if len(kept) == 1:
            return None
        kept[-1] = end
    if len(kept) < 2:
        return None
    points, closed = points[kept], curve.closed
    if len(points) > 3 and np.linalg.norm(points[-1] - points[0]) <= tolerance:
        points, closed = points[:-1], True
    if closed and len(points) < 3:
        closed = False
    return DrawnCurve(points, closed, curve.label, curve.layer)


def _without_doubles(
    curves: list[DrawnCurve], tolerance: float
) -> tuple[list[DrawnCurve], list[Finding]]:
    """Without curves that lie on another one all along; of two that lie on each other the later one
    goes."""
    if not curves:
        return [], []
    lines = [shapely.LineString(_outline(curve)) for curve in curves]
    lengths = np.array([line.length for line in lines])
    tree = shapely.STRtree(lines)
    middles = shapely.points([_middle(curve) for curve in curves])
    a, b = tree.query(middles, predicate="dwithin", distance=tolerance)
    gone: dict[int, int] = {}
    for k, other in zip(a.tolist(), b.tolist()):
        if k == other or k in gone or other in gone:
            continue
        if (lengths[k], -k) > (lengths[other], -other):  # the longer one stays, then the first
            continue
        points = _densely(curves[k], 4 * tolerance)
        heights = _distances(points, curves[other])
        if heights.max() <= tolerance:
            gone[k] = other
    told = [
        (f"{curves[k].label} lies on {curves[other].label}", _middle(curves[k]))
        for k, other in sorted(gone.items())
    ]
    found = [Finding("cleaned", f"{text} and is left out", at[None]) for text, at in told]
    if len(told) > _TOLD:
        text = f"{len(told)} curves lie on others and are left out: {told[0][0]}, say"
        found = [Finding("cleaned", text, np.array([at for _, at in told]))]
    return [curve for k, curve in enumerate(curves) if k not in gone], found


def _outline(curve: DrawnCurve) -> np.ndarray:
    """Its points in plan; a loop's first one again at the end."""
    return curve.path[:, :2]


def _middle(curve: DrawnCurve) -> np.ndarray:
    """The middle of its middle piece."""
    k = (len(curve.points) - 1) // 2
    return 0.5 * (curve.points[k] + curve.points[k + 1])


def _densely(curve: DrawnCurve, step: float) -> np.ndarray:
    """Points on the curve: its corners, and a few between each two."""
    points = curve.path
    shares = np.linspace(0, 1, 4, endpoint=False)[:, None, None]
    return ((1 - shares) * points[:-1] + shares * points[1:]).reshape(-1, 3)


def _distances(points: np.ndarray, curve: DrawnCurve) -> np.ndarray:
    """(n,) distances in space of points (n, 3) from a curve's pieces."""
    nodes = curve.path
    start, along = nodes[:-1], np.diff(nodes, axis=0)
    share = np.einsum("nmk,mk->nm", points[:, None] - start, along) / np.sum(along**2, axis=1)
    nearest = start + np.clip(share, 0, 1)[:, :, None] * along
    return np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1)


def end_groups(points: np.ndarray, tolerance: float) -> list[np.ndarray]:
    """Groups of points (n, 3) that are within a tolerance of each other, as numbers, in order."""
    pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(points),) * 2)
    _, label = connected_components(graph, directed=False)
    order = np.argsort(label, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    return sorted(groups, key=lambda group: int(group[0]))


def _ends_together(
    curves: list[DrawnCurve], tolerance: float
) -> tuple[list[DrawnCurve], list[Finding]]:
    """Ends that nearly meet made to meet, at the first one's place."""
    ends = [(k, end) for k, curve in enumerate(curves) if not curve.closed for end in (0, -1)]
    if not ends:
        return curves, []
    points = np.array([curves[k].points[end] for k, end in ends])
    moved, gap, places = {k: c.points.copy() for k, c in enumerate(curves)}, 0.0, []
    for group in end_groups(points, tolerance):
        apart = np.linalg.norm(points[group] - points[group[0]], axis=1)
        for n in group[apart > 0]:
            k, end = ends[n]
            moved[k][end] = points[group[0]]
        if apart.max() > _ROUND_OFF / TOLERANCE * tolerance:
            gap = max(gap, float(apart.max()))
            places.append(points[group[0]])
    found = [replace(curve, points=moved[k]) for k, curve in enumerate(curves)]
    if not places:
        return found, []
    text = f"ends brought together at {counted(len(places), 'place')}, by {gap:.3g} at most"
    return found, [Finding("cleaned", text, np.array(places))]
