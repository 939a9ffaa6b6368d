"""Where planar curves cross: a search among their coarse polylines by a tree of boxes, then
Newton's method to round-off, for all candidates at once."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from ..errors import InputError
from .curves import Curve

# Relative to the size of all curves: an end this near to another curve lies on it; two such near
# points are one.
TOLERANCE = 1e-6
# Curves that meet at a smaller angle (rad) touch: no hinge could open there.
_LEAST_ANGLE = 0.02
_TOLD_ANGLE = 0.01  # degrees: less is no angle that was drawn
_NEWTON = 40
_NEAR_SINGULAR = 1e-4
_MOST_PIECES = 2_000_000  # of all coarse polylines: some hundred thousand points

Pair = tuple[int, int]


@dataclass(frozen=True)
class Crossing:
    """One point of two curves.

    curves : their numbers; stations : arc lengths on them; position (2,)
    """

    curves: Pair
    stations: tuple[float, float]
    position: np.ndarray


def size_of(curves: Sequence[Curve]) -> float:
    """Diagonal of the bounding box of all curves."""
    points = np.concatenate([curve.position(curve.stations) for curve in curves])
    return float(np.hypot(*np.ptp(points, axis=0)))


def find_crossings(curves: Sequence[Curve]) -> list[Crossing]:
    """All crossings of different curves, in the order of their numbers and stations.

    Raises InputError for curves that cross themselves, touch without crossing, or run along each
    other, and for more points than can be searched.
    """
    return [crossing for found in _search(curves).values() for crossing in found]


def near_crossings(curves: Sequence[Curve], reach: float) -> list[Crossing]:
    """Crossings of different curves near to an end of one of them, where curves go on straight
    beyond their ends by up to `reach`; stations there are negative, or larger than the length.

    Curves that touch or cross themselves are passed over.
    """
    pieces = _Pieces(curves)
    lengths = np.array([curve.length for curve in curves])
    closed = np.array([curve.closed for curve in curves])
    rest = lengths[pieces.curve] - pieces.stations[:, 1]
    at_end = ~closed[pieces.curve] & (np.minimum(pieces.stations[:, 0], rest) <= reach)
    i, j = pieces.meeting(2 * reach, np.flatnonzero(at_end))
    apart = pieces.curve[i] != pieces.curve[j]
    i, j = i[apart], j[apart]
    if not len(i):
        return []
    a, b = pieces.curve[i], pieces.curve[j]
    s, t, gap, sine = _polish(curves, lengths, a, b, *_chord_crossing(pieces, i, j))
    good = _on(closed[a], lengths[a], s, reach) & _on(closed[b], lengths[b], t, reach)
    good &= (gap <= 1e-3 * TOLERANCE * size_of(curves)) & (np.abs(sine) > np.sin(_LEAST_ANGLE))
    keep = np.flatnonzero(good)
    x, margin = _frames(curves, a[keep], s[keep])[0], TOLERANCE * size_of(curves)
    found: dict[Pair, list[Crossing]] = {}
    for k, position in zip(keep.tolist(), x):
        others = found.setdefault((int(a[k]), int(b[k])), [])
        # neighbouring pieces find the same one
        if all(np.hypot(*(position - other.position)) > margin for other in others):
            stations = (float(s[k]), float(t[k]))
            others.append(Crossing((int(a[k]), int(b[k])), stations, position))
    return [crossing for crossings in found.values() for crossing in crossings]


def given_crossings(curves: Sequence[Curve], listed: Sequence[Mapping[str, Any]]) -> list[Crossing]:
    """The crossings listed as {"curves": [a, b], "near": [x, y]}; "near" may be left out where two
    curves cross once.

    Raises InputError naming the entry that can't be found, is ambiguous or is there twice.
    """
    pairs = [_pair(entry, len(curves), f"crossings[{n}]") for n, entry in enumerate(listed)]
    known = _search(curves, set(pairs))
    found: list[Crossing] = []
    for n, (entry, pair) in enumerate(zip(listed, pairs)):
        field = f"crossings[{n}]"
        if pair not in known:
            raise InputError("these two curves don't cross", field=field, value=list(pair))
        crossing = _choose(known[pair], entry, field)
        if any(
            np.array_equal(crossing.position, other.position) and crossing.curves == other.curves
            for other in found
        ):
            raise InputError("the same crossing is listed twice", field=field, value=list(pair))
        found.append(crossing)
    return found


class _Pieces:
    """All curves' coarse polylines, piece by piece.

    start, end (n, 2) : of the chords; curve (n,) : the curve that each is of
    first (m + 1,) : where each curve's pieces begin; stations (n, 2) : arc lengths of their ends
    """

    def __init__(self, curves: Sequence[Curve]):
        counts = [len(curve.sags) for curve in curves]
        self.first = np.concatenate([[0], np.cumsum(counts)])
        if self.first[-1] > _MOST_PIECES:
            raise InputError(
                f"have {self.first[-1]:,} pieces between their points; at most {_MOST_PIECES:,} "
                "can be searched for crossings: draw them with fewer points",
                field="curves",
            )
        self.curve = np.repeat(np.arange(len(curves)), counts)
        nodes = []
        for curve in curves:
            points = curve.position(curve.stations)
            if curve.closed:
                points[-1] = points[0]
            nodes.append(points)
        self.start = np.concatenate([points[:-1] for points in nodes])
        self.end = np.concatenate([points[1:] for points in nodes])
        self.stations = np.concatenate(
            [np.stack([c.stations[:-1], c.stations[1:]], axis=1) for c in curves]
        )
        self.sags = np.concatenate([curve.sags for curve in curves])

    def meeting(
        self, margin: float, asked: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Pairs i < j of pieces whose boxes, which hold their pieces of curve, are within a margin
        of each other; of all, or those of which one is asked for."""
        room = (self.sags + 0.5 * margin)[:, None]
        low, high = np.minimum(self.start, self.end) - room, np.maximum(self.start, self.end) + room
        boxes = shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
        if asked is None:
            i, j = shapely.STRtree(boxes).query(boxes)
            ahead = i < j
            return i[ahead], j[ahead]
        n, j = shapely.STRtree(boxes).query(boxes[asked])
        pairs = np.sort(np.stack([asked[n], j], axis=1), axis=1)
        i, j = np.unique(pairs, axis=0).T
        return i, j


def _search(
    curves: Sequence[Curve], wanted: Collection[Pair] | None = None
) -> dict[Pair, list[Crossing]]:
    """The crossings of all pairs of curves, or of the wanted ones, in order."""
    margin, pieces = TOLERANCE * size_of(curves), _Pieces(curves)
    i, j = pieces.meeting(margin)
    own = pieces.curve[i] == pieces.curve[j]
    _refuse_self_crossing(curves, pieces, i[own], j[own])
    i, j = i[~own], j[~own]
    if wanted is not None:
        pairs = zip(pieces.curve[i].tolist(), pieces.curve[j].tolist())
        keep = np.fromiter((pair in wanted for pair in pairs), bool, len(i))
        i, j = i[keep], j[keep]
    if not len(i):
        return {}
    return _crossings(curves, pieces, i, j, margin)


def _crossings(
    curves: Sequence[Curve], pieces: _Pieces, i: np.ndarray, j: np.ndarray, margin: float
) -> dict[Pair, list[Crossing]]:
    """The crossings near to pairs of pieces, by the curves' numbers, in order."""
    a, b = pieces.curve[i], pieces.curve[j]
    lengths = np.array([curve.length for curve in curves])
    closed = np.array([curve.closed for curve in curves])
    s, t, gap, sine = _polish(curves, lengths, a, b, *_chord_crossing(pieces, i, j))
    inside = _on(closed[a], lengths[a], s, margin) & _on(closed[b], lengths[b], t, margin)
    meeting = inside & (gap <= margin)
    touching = np.flatnonzero(meeting & (np.abs(sine) < np.sin(_LEAST_ANGLE)))
    if len(touching):
        k = touching[np.lexsort((s[touching], b[touching], a[touching]))[0]]
        x, other = curves[a[k]].position(s[k]), curves[b[k]].field
        degrees = float(np.degrees(np.arcsin(np.abs(sine[k]))))
        least = np.degrees(_LEAST_ANGLE)
        angle = f" (at {degrees:.2g}°: joints need {least:.3g}°)" if degrees > _TOLD_ANGLE else ""
        raise InputError(
            f"touches {other} or runs along it near {{place}} instead of crossing it{angle}",
            field=curves[a[k]].field,
            places=[x],
        )
    keep = np.flatnonzero(meeting & (gap <= 1e-3 * margin))
    a, b = a[keep], b[keep]
    s, t = _clip(closed[a], lengths[a], s[keep]), _clip(closed[b], lengths[b], t[keep])
    positions = 0.5 * (_frames(curves, a, s)[0] + _frames(curves, b, t)[0])
    found: dict[Pair, list[Crossing]] = {}
    for k in np.lexsort((s, b, a)).tolist():
        pair = (int(a[k]), int(b[k]))
        others = found.setdefault(pair, [])
        # neighbouring pieces find the same one
        if all(np.hypot(*(positions[k] - other.position)) > margin for other in others):
            others.append(Crossing(pair, (float(s[k]), float(t[k])), positions[k]))
    return found


def _frames(
    curves: Sequence[Curve], which: np.ndarray, s: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Positions and unit tangents (n, 2) of curves (n,) at stations s (n,), curve by curve."""
    x, tangents = np.empty((len(s), 2)), np.empty((len(s), 2))
    order = np.argsort(which, kind="stable")
    bounds = np.flatnonzero(np.diff(which[order], prepend=-1, append=-1))
    for first, last in zip(bounds[:-1], bounds[1:]):
        rows = order[first:last]
        x[rows], tangents[rows] = curves[which[rows[0]]].frame(s[rows])
    return x, tangents


def _chord_crossing(pieces: _Pieces, i: np.ndarray, j: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stations (n,), (n,) where the chords' lines cross, or the pieces' middles where they are
    nearly parallel."""
    u, v = pieces.end[i] - pieces.start[i], pieces.end[j] - pieces.start[j]
    w = pieces.start[j] - pieces.start[i]
    det = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    good = np.abs(det) > 1e-3 * np.hypot(*u.T) * np.hypot(*v.T)
    safe = np.where(good, det, 1.0)
    f = np.clip((w[:, 0] * v[:, 1] - w[:, 1] * v[:, 0]) / safe, 0, 1)
    g = np.clip((w[:, 0] * u[:, 1] - w[:, 1] * u[:, 0]) / safe, 0, 1)
    f, g = np.where(good, f, 0.5), np.where(good, g, 0.5)
    of_i, of_j = pieces.stations[i], pieces.stations[j]
    return (1 - f) * of_i[:, 0] + f * of_i[:, 1], (1 - g) * of_j[:, 0] + g * of_j[:, 1]


def _polish(
    curves: Sequence[Curve],
    lengths: np.ndarray,
    a: np.ndarray,
    b: np.ndarray,
    s: np.ndarray,
    t: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Newton's method on a(s) = b(t) for all candidates (n,), those that still move; returns s, t,
    the gaps left, and the sines of the angles.

    Where the tangents are nearly parallel a damped Gauss-Newton step takes over, which goes to the
    closest approach.
    """
    s, t, going = s.copy(), t.copy(), np.arange(len(s))
    cap, still = 0.25 * np.minimum(lengths[a], lengths[b]), 1e-15 * (lengths[a] + lengths[b])
    for _ in range(_NEWTON):
        (x, p), (y, q) = (
            _frames(curves, which[going], at[going]) for which, at in ((a, s), (b, t))
        )
        ds, dt = _newton_step(x - y, p, q)
        longest = np.maximum(np.abs(ds), np.abs(dt))
        scale = cap[going] / np.maximum(longest, cap[going])
        s[going] += scale * ds
        t[going] += scale * dt
        going = going[longest > still[going]]
        if not len(going):
            break
    (x, p), (y, q) = _frames(curves, a, s), _frames(curves, b, t)
    return s, t, np.hypot(*(x - y).T), q[:, 0] * p[:, 1] - q[:, 1] * p[:, 0]


def _newton_step(gap: np.ndarray, p: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Steps (n,), (n,) along tangents p and q (n, 2) that close the gaps (n, 2)."""
    det = q[:, 0] * p[:, 1] - q[:, 1] * p[:, 0]
    singular = np.abs(det) < _NEAR_SINGULAR
    safe = np.where(singular, 1.0, det)
    pq, damping = np.sum(p * q, axis=1), 1.0 + 1e-8
    along = np.sum(p * gap, axis=1), -np.sum(q * gap, axis=1)
    normal = damping**2 - pq**2
    ds = (gap[:, 0] * q[:, 1] - gap[:, 1] * q[:, 0]) / safe
    dt = (gap[:, 0] * p[:, 1] - gap[:, 1] * p[:, 0]) / safe
    return (
        np.where(singular, -(damping * along[0] + pq * along[1]) / normal, ds),
        np.where(singular, -(damping * along[1] + pq * along[0]) / normal, dt),
    )


def _on(closed: np.ndarray, length: np.ndarray, s: np.ndarray, margin: float) -> np.ndarray:
    """Whether stations lie on their curves, the ends' surroundings included."""
    return closed | (s >= -margin) & (s <= length + margin)


def _clip(closed: np.ndarray, length: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Stations on the curves; a loop's within one lap."""
    return np.where(closed, np.mod(s, length), np.clip(s, 0.0, length))


def _refuse_self_crossing(
    curves: Sequence[Curve], pieces: _Pieces, i: np.ndarray, j: np.ndarray
) -> None:
    """Raise InputError when two pieces i < j of one curve meet that aren't neighbours."""
    of = pieces.curve[i]
    closed = np.array([curve.closed for curve in curves])[of]
    around = closed & (i == pieces.first[of]) & (j == pieces.first[of + 1] - 1)
    apart = (j - i > 1) & ~around
    i, j = i[apart], j[apart]
    start, end = pieces.start, pieces.end
    over_i = _side(start[i], end[i], start[j]) + _side(start[i], end[i], end[j]) == 0
    over_j = _side(start[j], end[j], start[i]) + _side(start[j], end[j], end[i]) == 0
    crossing = np.flatnonzero(over_i & over_j)
    if len(crossing):
        first = i[crossing].min()
        x = start[first]
        raise InputError(
            "the curve crosses itself near {place}",
            field=curves[pieces.curve[first]].field,
            places=[x],
        )


def _side(start: np.ndarray, end: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Sign (n,) of the side of lines that points lie on."""
    u, v = end - start, point - start
    return np.sign(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def _pair(entry: Mapping[str, Any], n: int, field: str) -> tuple[int, int]:
    numbers = entry.get("curves")
    if (
        not isinstance(numbers, Sequence)
        or len(numbers) != 2
        or not all(type(k) is int for k in numbers)
    ):
        raise InputError(
            "expected the numbers of two curves", field=f"{field}.curves", value=numbers
        )
    for k in numbers:
        if not 0 <= k < n:
            raise InputError(
                f"no such curve (there are {n}, counted from 0)", field=f"{field}.curves", value=k
            )
    if numbers[0] == numbers[1]:
        raise InputError("a curve can't cross itself", field=f"{field}.curves", value=list(numbers))
    return min(numbers), max(numbers)


def _choose(candidates: Sequence[Crossing], entry: Mapping[str, Any], field: str) -> Crossing:
    """The candidate near the given place, or the only one."""
    if "near" not in entry:
        if len(candidates) > 1:
            raise InputError(
                f"these two curves cross {len(candidates)} times: say near which point",
                field=field,
                value=list(candidates[0].curves),
            )
        return candidates[0]
    near = np.array(entry["near"], float)
    if near.shape != (2,) or not np.isfinite(near).all():
        raise InputError("expected a point [x, y]", field=f"{field}.near", value=entry["near"])
    return min(candidates, key=lambda c: float(np.hypot(*(c.position - near))))
