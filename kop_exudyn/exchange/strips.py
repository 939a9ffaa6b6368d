"""Laths that are drawn by their outlines, as files for laser cutters have them, and their axes.

Between the middles of a strip's two ends its outline has two sides. Points that are equally far on
their way along these lie opposite each other, and their middle is on the axis. The right ends are
those for which these points are nearest to each other in the mean, which is then the strip's width.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from scipy.spatial import cKDTree

from ..wording import counted
from .cleaning import end_groups
from .drawing import DrawnCurve, Finding

# Four pi area / perimeter^2 is 1 for a circle, 0.30 for a rectangle of 8.5 to 1, 0.14 for 20 to 1.
_NARROW, _VERY_NARROW = 0.30, 0.15
_SAMPLES = 400  # of an outline, where its ends are searched for
_TIP = 65  # places in which the tip of an axis is searched for
# times the median width: what the widest place may be of a strip, and of one that is very narrow;
# an ellipse's is 1.15
_EVEN, _TAPERED = 1.1, 1.5
# of a loop's area, what a draughtsman's crossed corners may take off it
_SIMPLE = 0.95
_PIECES = 12  # drawn pieces that an outline may consist of, at most
_BESIDE = (
    0.05  # of their lengths: two lines so near to each other all along may be one lath's sides
)


def axes_of_strips(
    curves: Sequence[DrawnCurve], flat: Sequence[np.ndarray], tolerance: float
) -> tuple[list[DrawnCurve], list[np.ndarray], list[Finding]]:
    """The curves with the axes of strips in place of their outlines, the points in plan, and what
    was done.

    flat : points (n, 2) of each in plan
    tolerance : a length, within which ends meet
    """
    curves, flat = _loops_of_pieces(curves, flat, tolerance)
    kept, plan, widths, places, label = [], [], [], [], ""
    for curve, points in zip(curves, flat):
        found = _axis(points) if curve.closed and _narrowness(points) <= _NARROW else None
        if found is None:
            kept.append(curve)
            plan.append(points)
            continue
        axis, plan_axis = found.of(curve.points), found.of(points)
        kept.append(replace(curve, points=axis, closed=False))
        plan.append(plan_axis)
        widths.append(found.width)
        places.append(axis.mean(axis=0))
        label = label or curve.label
    if not widths:
        return list(curves), list(flat), []
    text = (
        f"{counted(len(widths), 'closed curve is', 'closed curves are')} long and narrow, such as "
        f"{label}: taken for outlines of laths, {_between(widths)} wide, and read as their axes"
    )
    return kept, plan, [Finding("suspicious", text, np.array(places))]


def is_narrow(points: np.ndarray) -> bool:
    """Whether a loop of points (n, 2) is clearly like the outline of a lath."""
    return _narrowness(points) <= _VERY_NARROW


def _narrowness(points: np.ndarray) -> float:
    """Four pi area / perimeter^2 of a loop; infinite of one that crosses itself, whose parts cancel
    each other in the area (a figure of eight, or laths that go on from edge to edge of a net)."""
    polygon = shapely.Polygon(points)
    if polygon.area < _SIMPLE * shapely.make_valid(polygon).area:
        return np.inf
    return 4 * np.pi * polygon.area / polygon.length**2


def sides_of_laths(
    curves: Sequence[DrawnCurve], flat: Sequence[np.ndarray], tolerance: float
) -> list[Finding]:
    """A finding where most curves run beside another one, at one distance, as two sides of a lath
    do."""
    open_ = [k for k, curve in enumerate(curves) if not curve.closed]
    if len(open_) < 4:
        return []
    lines = {k: shapely.LineString(flat[k]) for k in open_}
    middles = np.array([lines[k].interpolate(0.5, normalized=True).coords[0] for k in open_])
    apart, nearest = cKDTree(middles).query(middles, k=3)
    partner = dict(zip(open_, (open_[k] for k in nearest[:, 1].tolist())))
    pairs, gaps = [], []
    for a, (_, gap, further) in zip(open_, apart.tolist()):
        b = partner[a]
        if a > b or partner[b] != a or not tolerance < gap < _BESIDE * lines[a].length:
            continue
        if further < 2 * gap:  # the laths of a family lie as near to each other
            continue
        if abs(lines[a].length - lines[b].length) > 4 * gap or lines[a].crosses(lines[b]):
            continue
        far = shapely.hausdorff_distance(lines[a], lines[b])
        if far <= 2 * gap:
            pairs.append((a, b))
            gaps.append(gap)
    if 4 * len(pairs) < len(curves):
        return []
    first, second = pairs[0]
    text = (
        f"{2 * len(pairs)} of {len(curves)} curves run beside each other in pairs, "
        f"{_between(gaps)} apart, such as {curves[first].label} and "
        f"{curves[second].label}: if they are the two sides of laths, draw the laths' axes instead"
    )
    return [
        Finding("suspicious", text, np.array([curves[a].points.mean(axis=0) for a, _ in pairs]))
    ]


def _between(lengths: Sequence[float]) -> str:
    low, high = (f"{length:.3g}" for length in (min(lengths), max(lengths)))
    return low if low == high else f"{low} to {high}"


def _loops_of_pieces(
    curves: Sequence[DrawnCurve], flat: Sequence[np.ndarray], tolerance: float
) -> tuple[list[DrawnCurve], list[np.ndarray]]:
    """With pieces that go round a narrow loop, two by two end to end, as one curve each."""
    ends = [(k, end) for k, curve in enumerate(curves) if not curve.closed for end in (0, -1)]
    if not ends:
        return list(curves), list(flat)
    points = np.array([curves[k].points[end] for k, end in ends])
    following = {}
    for group in end_groups(points, tolerance):
        if len(group) == 2:
            a, b = (ends[k] for k in group.tolist())
            following[a], following[b] = b, a
    loops: dict[int, tuple[DrawnCurve, np.ndarray]] = {}
    gone: set[int] = set()
    for start in range(len(curves)):
        chain = _round(start, following) if start not in gone else []
        if len(chain) < 2:
            continue
        ways = [
            np.concatenate([_way(x[k], e)[:-1] for k, e in chain]) for x in (_space(curves), flat)
        ]
        if _narrowness(ways[1]) <= _NARROW and _axis(ways[1]) is not None:
            label = f"{curves[start].label} and {len(chain) - 1} more"
            loops[start] = replace(curves[start], points=ways[0], closed=True, label=label), ways[1]
            gone |= {k for k, _ in chain}
    # laths of a net that are hinged at their tips go round narrow loops as well, but few of them
    if 2 * len(gone) < len(curves):
        return list(curves), list(flat)
    kept = [
        loops[k] if k in loops else (curves[k], flat[k])
        for k in range(len(curves))
        if k in loops or k not in gone
    ]
    return [curve for curve, _ in kept], [x for _, x in kept]


def _space(curves: Sequence[DrawnCurve]) -> list[np.ndarray]:
    return [curve.points for curve in curves]


def _way(points: np.ndarray, end: int) -> np.ndarray:
    return points if end == 0 else points[::-1]


def _round(start: int, following: dict[tuple[int, int], tuple[int, int]]) -> list[tuple[int, int]]:
    """The pieces that follow each other from one back to itself, each with the end at which it
    begins; none where they don't."""
    chain: list[tuple[int, int]] = []
    here = (start, 0)
    while len(chain) < _PIECES:
        chain.append(here)
        there = following.get((here[0], -1 if here[1] == 0 else 0))
        if there is None:
            return []
        if there == chain[0]:
            return chain
        here = there
    return []


@dataclass(frozen=True)
class _Strip:
    """A loop that is a strip.

    start, end : the middles of its ends, as shares of its length
    at (k,) : where its axis has points, as shares of the way from one to the other
    least : such a share, beyond which its ends don't matter
    width : in plan
    """

    start: float
    end: float
    at: np.ndarray
    least: float
    width: float

    def of(self, points: np.ndarray) -> np.ndarray:
        """Points (k, d) on the axis, of a loop's points (n, d).

        The axis goes on evenly into the ends, whatever their shape: to where it is nearest to what
        lies opposite there.
        """
        axis = self._middles(points, self.at)
        for n, way in ((0, 1.0), (-1, -1.0)):
            probes = self.at[n] + way * self.least * np.array([1.0, 2.0, 3.0])
            a, b, c = self._middles(points, probes)
            t = np.linspace(0, 1, _TIP)[:, None]  # the quadratic curve through the three
            tips = 0.5 * (t - 2) * (t - 3) * a - (t - 1) * (t - 3) * b + 0.5 * (t - 1) * (t - 2) * c
            axis[n] = tips[np.linalg.norm(tips - axis[n], axis=1).argmin()]
        return axis

    def _middles(self, points: np.ndarray, at: np.ndarray) -> np.ndarray:
        ahead = (self.end - self.start) % 1
        one = _along(points, self.start + ahead * at)
        return 0.5 * (one + _along(points, self.start - (1 - ahead) * at))


def _axis(points: np.ndarray) -> _Strip | None:
    """The strip whose outline a loop of points (n, 2) is; None where its width isn't even."""
    stations = _stations(points)
    corners = stations[:-1] / stations[-1]
    between = 0.5 * (corners + np.append(corners[1:], 1.0))  # middles of the sides, ends' too
    starts = np.concatenate([np.arange(_SAMPLES) / _SAMPLES, between])
    first = starts[_apart(points, starts, starts + 0.5).mean(axis=1).argmin()]
    reach = 2 * float(np.median(_apart(points, first, first + 0.5))) / stations[-1]
    near = (_near(between, middle % 1, reach) for middle in (first, first + 0.5))
    one, other = (x.ravel() for x in np.meshgrid(*near))
    apart = _apart(points, one, other)
    best = int(apart.mean(axis=1).argmin())
    width, start, end = float(np.median(apart[best])), one[best], other[best]
    if apart[best].max() > (_TAPERED if _narrowness(points) <= _VERY_NARROW else _EVEN) * width:
        return None
    ahead = (end - start) % 1
    own = np.concatenate(  # how far corners are on the way from end to end, on their side
        [((corners - start) % 1) / ahead, ((start - corners) % 1) / (1 - ahead)]
    )
    least, inner = 2 * width / stations[-1], [0.0]
    for place in np.sort(own[own < 1]):
        if place - inner[-1] > least and 1 - place > least:
            inner.append(float(place))
    return _Strip(start, end, np.array([*inner, 1.0]), least, width)


def _apart(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Distances (..., m) of points on a loop's two ways from start to end (...), as shares of its
    length, that are equally far on their ways."""
    t = (np.arange(_SAMPLES // 2) + 0.5) / (_SAMPLES // 2)
    start, ahead = np.asarray(start)[..., None], np.asarray((end - start) % 1)[..., None]
    one, other = _along(points, start + ahead * t), _along(points, start - (1 - ahead) * t)
    return np.linalg.norm(one - other, axis=-1)


def _near(places: np.ndarray, middle: float, reach: float) -> np.ndarray:
    """Shares within reach of one, those of the given places among them."""
    off = (places - middle + 0.5) % 1 - 0.5
    return np.concatenate(
        [middle + off[np.abs(off) <= reach], middle + reach * np.linspace(-1, 1, 21)]
    )


def _stations(points: np.ndarray) -> np.ndarray:
    """(n + 1,) arc lengths along a loop of points."""
    steps = np.linalg.norm(np.diff(np.concatenate([points, points[:1]]), axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _along(points: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Points (..., d) on a loop of points (n, d) at shares (...) of its length."""
    stations = _stations(points)
    at = (shares % 1) * stations[-1]
    loop = np.concatenate([points, points[:1]])
    return np.stack([np.interp(at, stations, loop[:, k]) for k in range(loop.shape[1])], axis=-1)
