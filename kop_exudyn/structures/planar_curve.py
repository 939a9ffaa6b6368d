"""Planar curves through given points: splines or polylines, open or closed, with exact headings and lengths."""
from __future__ import annotations

from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline, make_interp_spline

from ..errors import InputError

# Gauss points a knot interval: splines through sensible points are so smooth that this reaches round-off.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


class PlanarCurve:
    """A curve (x, y)(u), u in [0, end]; u is the chord length along the given points.

    points : (n, 2); a closed curve's first point is not repeated
    smooth : natural (closed: periodic) cubic spline, else a polyline
    Raises InputError (field relative to `field`) for unusable points.
    """

    def __init__(self, points: Any, closed: bool = False, smooth: bool = True, field: str = "curve"):
        points = _checked(points, closed, f"{field}.points")
        self.closed, self.field = bool(closed), field
        if closed:
            points = np.concatenate([points, points[:1]])
        chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
        if not (chords > 1e-9 * chords.sum()).all():
            raise InputError("two points after each other coincide", field=f"{field}.points[{int(np.argmin(chords))}]",
                             value=points[int(np.argmin(chords))].tolist())
        self.knots = np.concatenate([[0.0], np.cumsum(chords)])
        if smooth and len(points) > 2:
            self._curve = CubicSpline(self.knots, points, bc_type="periodic" if closed else "natural")
        else:
            self._curve = make_interp_spline(self.knots, points, k=1)
        self._velocity = self._curve.derivative()
        self._lengths = np.concatenate([[0.0], np.cumsum(self._interval_lengths(self.knots[:-1], self.knots[1:]))])

    @property
    def end(self) -> float:
        """The last parameter; of a closed curve the one of the first point again."""
        return float(self.knots[-1])

    def wrap(self, u: np.ndarray | float) -> np.ndarray:
        """Parameters within the curve: modulo the end when closed, clipped when open."""
        return np.mod(u, self.end) if self.closed else np.clip(u, 0.0, self.end)

    def position(self, u: np.ndarray | float) -> np.ndarray:
        """(..., 2) points."""
        return self._curve(self.wrap(u))

    def velocity(self, u: np.ndarray | float) -> np.ndarray:
        """(..., 2) derivative in u; nearly a unit vector."""
        return self._velocity(self.wrap(u))

    def length(self, a: float, b: float) -> float:
        """Arc length from a to b >= a; b may run past the end of a closed curve."""
        return float(self._length_to(b) - self._length_to(a))

    def turning(self, a: float, b: float) -> float:
        """Integral of the curvature from a to b >= a, rad: the change of heading, full turns included."""
        inner = self.knots[(self.knots > a) & (self.knots < b)]
        if self.closed:
            inner = np.concatenate([inner, self.knots[(self.knots + self.end > a) & (self.knots + self.end < b)] + self.end])
        stops = np.unique(np.concatenate([[a], inner, [b]]))
        u = np.concatenate([np.linspace(s, t, 9)[:-1] for s, t in zip(stops, stops[1:])] + [[b]])
        v = self.velocity(u)
        return float(np.sum(np.arctan2(v[:-1, 0] * v[1:, 1] - v[:-1, 1] * v[1:, 0], np.sum(v[:-1] * v[1:], axis=1))))

    def heading(self, u: float) -> float:
        """Direction of travel at u, rad in (-pi, pi]."""
        v = self.velocity(u)
        return float(np.arctan2(v[1], v[0]))

    def at_lengths(self, a: float, b: float, fractions: np.ndarray) -> np.ndarray:
        """Parameters (k,) at fractions of the arc length between a and b."""
        goal = self._length_to(a) + np.asarray(fractions) * self.length(a, b)
        u = a + (b - a) * np.asarray(fractions, float)
        for _ in range(30):
            speed = np.linalg.norm(self.velocity(u), axis=-1)
            step = (goal - np.array([self._length_to(t) for t in np.atleast_1d(u)]).reshape(np.shape(u))) / speed
            u = np.clip(u + step, a, b)
            if np.abs(step).max(initial=0.0) < 1e-14 * self.end:
                break
        return u

    def samples(self, per_interval: int = 6) -> np.ndarray:
        """Parameters along the whole curve, several an interval between points."""
        fractions = np.arange(per_interval) / per_interval
        steps = np.diff(self.knots)[:, None] * fractions
        return np.append((self.knots[:-1, None] + steps).ravel(), self.end)

    def _length_to(self, u: float) -> float:
        turns, rest = divmod(u, self.end) if self.closed else (0.0, float(np.clip(u, 0.0, self.end)))
        k = int(np.clip(np.searchsorted(self.knots, rest, side="right") - 1, 0, len(self.knots) - 2))
        part = self._interval_lengths(np.array([self.knots[k]]), np.array([rest]))[0]
        return turns * self._lengths[-1] + self._lengths[k] + part

    def _interval_lengths(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        middle, half = 0.5 * (a + b), 0.5 * (b - a)
        speed = np.linalg.norm(self._velocity(middle[:, None] + half[:, None] * _NODES), axis=-1)
        return half * (speed @ _WEIGHTS)


def _checked(points: Any, closed: bool, field: str) -> np.ndarray:
    try:
        array = np.array(points, dtype=float)
    except (TypeError, ValueError):
        raise InputError("points are pairs of numbers", field=field, value=points) from None
    if array.ndim != 2 or array.shape[1] != 2:
        raise InputError("points are pairs [x, y]", field=field, value=points)
    least = 3 if closed else 2
    if len(array) < least:
        raise InputError(f"a{' closed' if closed else 'n open'} curve needs at least {least} points", field=field,
                         value=len(array))
    if not np.isfinite(array).all():
        worst = int(np.argwhere(~np.isfinite(array))[0, 0])
        raise InputError("coordinates must be finite", field=f"{field}[{worst}]", value=array[worst].tolist())
    return array
