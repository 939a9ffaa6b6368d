"""Where planar curves cross: a vectorised search among their coarse polylines, then Newton's method
to round-off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from .curves import Curve

# Relative to the size of all curves: an end this near to another curve lies on it; two such near
# points are one.
TOLERANCE = 1e-6
# Curves that meet at a smaller angle (rad) touch: no hinge could open there.
_LEAST_ANGLE = 0.02
_NEWTON = 40
_NEAR_SINGULAR = 1e-4


@dataclass(frozen=True)
class Crossing:
    """One point of two curves.

    curves : their numbers; stations : arc lengths on them; position (2,)
    """

    curves: tuple[int, int]
    stations: tuple[float, float]
    position: np.ndarray


def size_of(curves: Sequence[Curve]) -> float:
    """Diagonal of the bounding box of all curves."""
    points = np.concatenate([curve.position(curve.stations) for curve in curves])
    return float(np.hypot(*np.ptp(points, axis=0)))


def find_crossings(curves: Sequence[Curve]) -> list[Crossing]:
    """All crossings of different curves, in the order of their numbers and stations.

    Raises InputError for curves that cross themselves, touch without crossing, or run along each
    other.
    """
    size, chords = size_of(curves), [_Chords(curve) for curve in curves]
    for curve, own in zip(curves, chords):
        _refuse_self_crossing(curve, own)
    found = []
    for a, b in _overlapping(chords, TOLERANCE * size):
        found += _cross_pair(curves, chords, a, b, size)
    return found


def given_crossings(curves: Sequence[Curve], listed: Sequence[Mapping[str, Any]]) -> list[Crossing]:
    """The crossings listed as {"curves": [a, b], "near": [x, y]}; "near" may be left out where two
    curves cross once.

    Raises InputError naming the entry that can't be found, is ambiguous or is there twice.
    """
    size, chords = size_of(curves), [_Chords(curve) for curve in curves]
    for curve, own in zip(curves, chords):
        _refuse_self_crossing(curve, own)
    found: list[Crossing] = []
    for n, entry in enumerate(listed):
        field = f"crossings[{n}]"
        a, b = _pair(entry, len(curves), field)
        candidates = _cross_pair(curves, chords, a, b, size)
        if not candidates:
            raise InputError("these two curves don't cross", field=field, value=[a, b])
        crossing = _choose(candidates, entry, field)
        if any(
            np.array_equal(crossing.position, other.position) and crossing.curves == other.curves
            for other in found
        ):
            raise InputError("the same crossing is listed twice", field=field, value=[a, b])
        found.append(crossing)
    return found


class _Chords:
    """A curve's coarse polyline with the boxes (low, high) that hold its pieces of curve."""

    def __init__(self, curve: Curve):
        points = curve.position(curve.stations)
        if curve.closed:
            points[-1] = points[0]
        self.start, self.end = points[:-1], points[1:]
        sag = curve.sags[:, None]
        self.low = np.minimum(self.start, self.end) - sag
        self.high = np.maximum(self.start, self.end) + sag
        self.box = np.stack([self.low.min(axis=0), self.high.max(axis=0)])


def _overlapping(chords: Sequence[_Chords], margin: float) -> list[tuple[int, int]]:
    """Pairs of curves whose boxes overlap."""
    low, high = (np.array([c.box[k] for c in chords]) for k in (0, 1))
    meet = (low[:, None] <= high + margin).all(axis=2)
    return [(int(a), int(b)) for a, b in np.argwhere(np.triu(meet & meet.T, 1))]


def _boxes_meet(A: _Chords, B: _Chords, margin: float) -> np.ndarray:
    """(n, m) bool: whether piece i of A and piece j of B may meet."""
    x, y = (
        (A.low[:, None, k] <= B.high[:, k] + margin) & (B.low[:, k] <= A.high[:, None, k] + margin)
        for k in (0, 1)
    )
    return x & y


def _cross_pair(
    curves: Sequence[Curve], chords: Sequence[_Chords], a: int, b: int, size: float
) -> list[Crossing]:
    """All crossings of curves a and b."""
    A, B, margin = chords[a], chords[b], TOLERANCE * size
    i, j = np.nonzero(_boxes_meet(A, B, margin))
    if not len(i):
        return []
    s, t = _guess(curves[a], A, i), _guess(curves[b], B, j)
    s, t, gap, sine = _polish(
        curves[a], curves[b], *_chord_crossing(A, B, i, j, curves[a], curves[b], s, t)
    )
    inside = _on(curves[a], s, margin) & _on(curves[b], t, margin)
    meeting = inside & (gap <= margin)
    touching = np.flatnonzero(meeting & (np.abs(sine) < np.sin(_LEAST_ANGLE)))
    if len(touching):
        x = curves[a].position(s[touching[0]])
        raise InputError(
            f"touches {curves[b].field} or runs along it near ({x[0]:.6g}, {x[1]:.6g}) instead of "
            "crossing it",
            field=curves[a].field,
        )
    keep = np.flatnonzero(meeting & (gap <= 1e-9 * size))
    return _distinct(curves, (a, b), _clip(curves[a], s[keep]), _clip(curves[b], t[keep]), margin)


def _guess(curve: Curve, chords: _Chords, pieces: np.ndarray) -> np.ndarray:
    return 0.5 * (curve.stations[pieces] + curve.stations[pieces + 1])


def _chord_crossing(A, B, i, j, curve_a, curve_b, s, t) -> tuple[np.ndarray, np.ndarray]:
    """Stations (n,), (n,) where the chords' lines cross, or the given ones where they are nearly
    parallel."""
    u, v, w = A.end[i] - A.start[i], B.end[j] - B.start[j], B.start[j] - A.start[i]
    det = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    good = np.abs(det) > 1e-3 * np.hypot(*u.T) * np.hypot(*v.T)
    safe = np.where(good, det, 1.0)
    f = np.clip((w[:, 0] * v[:, 1] - w[:, 1] * v[:, 0]) / safe, 0, 1)
    g = np.clip((w[:, 0] * u[:, 1] - w[:, 1] * u[:, 0]) / safe, 0, 1)
    on_a = curve_a.stations[i] + f * (curve_a.stations[i + 1] - curve_a.stations[i])
    on_b = curve_b.stations[j] + g * (curve_b.stations[j + 1] - curve_b.stations[j])
    return np.where(good, on_a, s), np.where(good, on_b, t)


def _polish(
    a: Curve, b: Curve, s: np.ndarray, t: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Newton's method on a(s) = b(t) for all candidates; returns s, t, the gaps left, and the sines
    of the angles.

    Where the tangents are nearly parallel a damped Gauss-Newton step takes over, which goes to the
    closest approach.
    """
    cap = 0.25 * min(a.length, b.length)
    for _ in range(_NEWTON):
        gap, p, q = a.position(s) - b.position(t), a.tangent(s), b.tangent(t)
        det = q[:, 0] * p[:, 1] - q[:, 1] * p[:, 0]
        singular = np.abs(det) < _NEAR_SINGULAR
        pq = np.sum(p * q, axis=1)
        damping = 1.0 + 1e-8
        along = np.stack([np.sum(p * gap, axis=1), -np.sum(q * gap, axis=1)], axis=1)
        normal = damping**2 - pq**2
        ds = np.where(
            singular,
            -(damping * along[:, 0] + pq * along[:, 1]) / normal,
            (gap[:, 0] * q[:, 1] - gap[:, 1] * q[:, 0]) / np.where(singular, 1.0, det),
        )
        dt = np.where(
            singular,
            -(damping * along[:, 1] + pq * along[:, 0]) / normal,
            (gap[:, 0] * p[:, 1] - gap[:, 1] * p[:, 0]) / np.where(singular, 1.0, det),
        )
        scale = np.minimum(1.0, cap / np.maximum(np.maximum(np.abs(ds), np.abs(dt)), 1e-300))
        s, t = s + scale * ds, t + scale * dt
        if np.all(np.maximum(np.abs(ds), np.abs(dt)) <= 1e-15 * (a.length + b.length)):
            break
    gap, p, q = a.position(s) - b.position(t), a.tangent(s), b.tangent(t)
    return s, t, np.hypot(*gap.T), q[:, 0] * p[:, 1] - q[:, 1] * p[:, 0]


def _on(curve: Curve, s: np.ndarray, margin: float) -> np.ndarray:
    """Whether stations lie on the curve, its ends' surroundings included."""
    return np.full(len(s), True) if curve.closed else (s >= -margin) & (s <= curve.length + margin)


def _clip(curve: Curve, s: np.ndarray) -> np.ndarray:
    """Stations on the curve; a loop's within one lap."""
    return np.mod(s, curve.length) if curve.closed else np.clip(s, 0.0, curve.length)


def _distinct(curves, pair, s: np.ndarray, t: np.ndarray, margin: float) -> list[Crossing]:
    """Crossings without the repetitions that neighbouring pieces find."""
    a, b = pair
    found: list[Crossing] = []
    positions = 0.5 * (curves[a].position(s) + curves[b].position(t))
    for k in np.argsort(s, kind="stable"):
        if all(np.hypot(*(positions[k] - other.position)) > margin for other in found):
            found.append(Crossing((a, b), (float(s[k]), float(t[k])), positions[k]))
    return found


def _refuse_self_crossing(curve: Curve, chords: _Chords) -> None:
    """Raise InputError when two pieces that aren't neighbours meet."""
    n = len(chords.start)
    i, j = np.nonzero(np.triu(_boxes_meet(chords, chords, 0.0), 2))
    if curve.closed:
        apart = (i > 0) | (j < n - 1)
        i, j = i[apart], j[apart]
    start, end = chords.start, chords.end
    over_i = _side(start[i], end[i], start[j]) + _side(start[i], end[i], end[j]) == 0
    over_j = _side(start[j], end[j], start[i]) + _side(start[j], end[j], end[i]) == 0
    crossing = np.flatnonzero(over_i & over_j)
    if len(crossing):
        x = chords.start[i[crossing[0]]]
        raise InputError(
            f"the curve crosses itself near ({x[0]:.6g}, {x[1]:.6g})", field=curve.field
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
