"""Planar curves by arc length: splines through points, and polylines.

A curve's direction is a continuous angle theta(s), so the turning between two stations, theta(b) -
theta(a), is the integral of the curvature however often the curve winds.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..errors import InputError

# Gauss points on each of these parts of a spline piece: arc lengths are exact to round-off unless a
# piece nearly stops.
_GAUSS, _PARTS = 10, 8
_NEWTON = 12
# A station nearer than this (relative to the length) to a polyline's vertex is the vertex.
_AT_VERTEX = 1e-9
# A spline slower than this, relative to its chord parameter, has a cusp.
_CUSP = 1e-3
# Points nearer to each other than this share of the length are meant to be one; a spline that turns
# beside them by more than this (rad) has a hook that nobody drew.
_NEARLY_THE_SAME, _HOOK = 1e-4, 0.5


class Curve(ABC):
    """A planar curve, evaluated at arc lengths s of any shape.

    field : what messages call it: where its points are given in a design file
    length : total arc length
    closed : whether it is a loop; then s is taken modulo the length
    stations : (m + 1,) increasing arc lengths from 0 to the length, fine enough for a coarse
        polyline
    sags : (m,) bounds of the distance between the curve and the chord over each interval of
        stations
    """

    field: str
    length: float
    closed: bool
    stations: np.ndarray
    sags: np.ndarray

    @abstractmethod
    def _evaluate(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Positions (n, 2), continuous angles (n,) and curvatures (n,) at s (n,) within [0,
        length]."""

    def position(self, s: Any) -> np.ndarray:
        """Points (..., 2); an open curve goes on straight beyond its ends."""
        s = np.asarray(s, float)
        inside, turns = self._inside(s)
        x, angle, _ = self._evaluate(inside.ravel())
        if not self.closed:
            x = x + (s - inside).ravel()[:, None] * direction(angle)
        return x.reshape(*s.shape, 2)

    def angle(self, s: Any) -> np.ndarray:
        """Direction of the tangent (...), rad: continuous in s, and gaining the whole turn with
        each lap of a loop.

        At a polyline's vertex it is the mean of the directions before and after.
        """
        s = np.asarray(s, float)
        inside, laps = self._inside(s)
        return self._evaluate(inside.ravel())[1].reshape(s.shape) + laps * self.lap_turning

    def pose(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`position` (n, 2) and `angle` (n,) at s (n,), for the price of one of them."""
        inside, laps = self._inside(s)
        x, angle, _ = self._evaluate(inside)
        if not self.closed:
            x = x + (s - inside)[:, None] * direction(angle)
        return x, angle + laps * self.lap_turning

    def tangent(self, s: Any) -> np.ndarray:
        """Unit tangents (..., 2)."""
        return direction(self.angle(s))

    def frame(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`position` and `tangent` (n, 2) at s (n,), for the price of one of them."""
        inside, _ = self._inside(s)
        x, angle, _ = self._evaluate(inside)
        tangent = direction(angle)
        return x if self.closed else x + (s - inside)[:, None] * tangent, tangent

    def curvature(self, s: Any) -> np.ndarray:
        """Signed curvature (...), positive to the left; a polyline's vertices are left out."""
        s = np.asarray(s, float)
        return self._evaluate(self._inside(s)[0].ravel())[2].reshape(s.shape)

    def turning(self, a: Any, b: Any) -> np.ndarray:
        """Integral of the curvature from a to b, rad; kinks included, half of one that lies at a or
        b."""
        return self.angle(b) - self.angle(a)

    @property
    def lap_turning(self) -> float:
        """Turning of one whole lap: a multiple of 2 pi for a loop, 0 for an open curve."""
        return self._lap_turning if self.closed else 0.0

    _lap_turning: float = 0.0

    def _inside(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The stations within [0, length] and the number of whole laps."""
        if not self.closed:
            return np.clip(s, 0.0, self.length), np.zeros(s.shape)
        laps = np.floor(s / self.length)
        return np.clip(s - laps * self.length, 0.0, self.length), laps


class Polyline(Curve):
    """Straight pieces between points (n, 2)."""

    def __init__(self, points: Any, closed: bool = False, field: str = "points"):
        points = _checked(points, closed, field)
        self.field, self.closed = field, closed
        self._vertices = np.concatenate([points, points[:1]]) if closed else points
        edges = np.diff(self._vertices, axis=0)
        lengths = np.hypot(*edges.T)
        self.stations = np.concatenate([[0.0], np.cumsum(lengths)])
        self.length = float(self.stations[-1])
        self.sags = np.zeros(len(edges))
        kinks = _turn(edges[:-1], edges[1:])
        self._angles = np.arctan2(edges[0, 1], edges[0, 0]) + np.concatenate(
            [[0.0], np.cumsum(kinks)]
        )
        if np.any(np.abs(kinks) > np.pi - 1e-6):
            raise InputError("the polyline folds back on itself", field=field)
        if closed:
            self._last_kink = float(_turn(edges[-1:], edges[:1])[0])
            self._lap_turning = float(
                2
                * np.pi
                * np.round((self._angles[-1] + self._last_kink - self._angles[0]) / (2 * np.pi))
            )

    def _evaluate(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        stations = self.stations
        piece = np.clip(np.searchsorted(stations, s, side="right") - 1, 0, len(stations) - 2)
        share = (s - stations[piece]) / (stations[piece + 1] - stations[piece])
        x = self._vertices[piece] + share[:, None] * (
            self._vertices[piece + 1] - self._vertices[piece]
        )
        return x, self._angle_at(s, piece), np.zeros(len(s))

    def _angle_at(self, s: np.ndarray, piece: np.ndarray) -> np.ndarray:
        angle = self._angles[piece].copy()
        before, after = self._angles[:-1], self._angles[1:]
        vertex = np.clip(
            np.searchsorted(self.stations, s + _AT_VERTEX * self.length) - 1,
            0,
            len(self.stations) - 1,
        )
        at = np.abs(self.stations[vertex] - s) <= _AT_VERTEX * self.length
        inner = at & (vertex > 0) & (vertex < len(self.stations) - 1)
        angle[inner] = 0.5 * (before + after)[vertex[inner] - 1]
        if self.closed:
            angle[at & (vertex == 0)] = self._angles[0] - 0.5 * self._last_kink
            angle[at & (vertex == len(self.stations) - 1)] = (
                self._angles[-1] + 0.5 * self._last_kink
            )
        return angle


class Spline(Curve):
    """The cubic spline through points (n, 2) with chord-length parameter: natural ends, or
    periodic.

    Chord lengths as parameters keep it free of loops where the points are unevenly spaced.
    """

    def __init__(self, points: Any, closed: bool = False, field: str = "points"):
        from scipy.interpolate import CubicSpline

        points = _checked(points, closed, field)
        self.field, self.closed = field, closed
        through = np.concatenate([points, points[:1]]) if closed else points
        knots = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(through, axis=0).T))])
        self._x = CubicSpline(knots, through, bc_type="periodic" if closed else "natural")
        self._dx, self._ddx = self._x.derivative(1), self._x.derivative(2)
        parts = knots[:-1, None] + np.diff(knots)[:, None] * np.arange(_PARTS) / _PARTS
        self._t = np.append(parts.ravel(), knots[-1])
        self._nodes, self._weights = np.polynomial.legendre.leggauss(_GAUSS)
        if np.min(self._speed(self._t)) < _CUSP:
            raise InputError("the spline has a cusp; its points turn too sharply", field=field)
        self.stations = np.concatenate([[0.0], np.cumsum(self._arc(self._t[:-1], self._t[1:]))])
        self.length = float(self.stations[-1])
        d = self._dx(self._t)
        turns = _turn(d[:-1], d[1:])
        self._refuse_hooks(np.diff(knots), np.abs(turns).reshape(-1, _PARTS).sum(axis=1))
        self._angles = np.arctan2(d[0, 1], d[0, 0]) + np.concatenate([[0.0], np.cumsum(turns)])
        if closed:
            self._lap_turning = float(
                2 * np.pi * np.round((self._angles[-1] - self._angles[0]) / (2 * np.pi))
            )
        # the sag of an arc is an eighth of length times turning; curvature may change sign or peak
        # within a part
        sharpest = self._sharpest()
        self.sags = 0.25 * np.diff(self.stations) ** 2 * sharpest

    def _refuse_hooks(self, steps: np.ndarray, turns: np.ndarray) -> None:
        """Raise InputError where two points are nearly the same and the spline turns sharply there:
        their direction is made of round-off, and it has to follow it."""
        beside = np.maximum(turns, np.maximum(np.append(turns[1:], 0), np.append(0, turns[:-1])))
        hooks = (steps < _NEARLY_THE_SAME * steps.sum()) & (beside > _HOOK)
        if hooks.any():
            k = int(np.argmax(hooks))
            raise InputError(
                f"is only {steps[k]:.3g} away from the point before, and the spline bends by "
                f"{np.degrees(beside[k]):.0f} degrees there: leave one of the two out",
                field=f"{self.field}[{k + 1}]",
            )

    def _evaluate(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        t, part = self._parameter(s)
        d, dd = self._dx(t), self._ddx(t)
        start = self._dx(self._t[part])
        angle = self._angles[part] + _turn(start, d)
        return self._x(t), angle, _cross(d, dd) / np.hypot(*d.T) ** 3

    def _parameter(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Parameters t (n,) of arc lengths s, and the parts that they lie in."""
        part = np.clip(
            np.searchsorted(self.stations, s, side="right") - 1, 0, len(self.stations) - 2
        )
        low, high, want = self._t[part], self._t[part + 1], s - self.stations[part]
        t = low + (high - low) * want / (self.stations[part + 1] - self.stations[part])
        for _ in range(_NEWTON):
            step = (self._arc(low, t) - want) / self._speed(t)
            t = np.clip(t - step, low, high)
            if np.abs(step).max(initial=0.0) <= 1e-15 * self._t[-1]:
                break
        return t, part

    def _speed(self, t: np.ndarray) -> np.ndarray:
        return np.hypot(*np.moveaxis(self._dx(t), -1, 0))

    def _arc(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Arc lengths (n,) between parameters of the same part, by Gauss's rule."""
        half = 0.5 * (b - a)
        return half * (
            self._speed(0.5 * (a + b)[:, None] + half[:, None] * self._nodes) @ self._weights
        )

    def _sharpest(self) -> np.ndarray:
        """Largest curvature (m,) at the ends and the middle of each part."""
        t = np.stack([self._t[:-1], 0.5 * (self._t[:-1] + self._t[1:]), self._t[1:]])
        d, dd = self._dx(t), self._ddx(t)
        return np.max(np.abs(_cross(d, dd)) / np.hypot(d[..., 0], d[..., 1]) ** 3, axis=0)


def curve_from_dict(data: Mapping[str, Any], field: str = "curve") -> Curve:
    """The curve that a design file describes: {"type": "spline" | "polyline", "points": [[x, y],
    ...], "closed": ...}.

    Raises InputError naming the field.
    """
    kinds = {"spline": Spline, "polyline": Polyline}
    kind = data.get("type", "spline")
    if kind not in kinds:
        raise InputError(
            f"unknown type of curve (known: {', '.join(kinds)})", field=f"{field}.type", value=kind
        )
    if "points" not in data:
        raise InputError("is missing", field=f"{field}.points")
    return kinds[kind](data["points"], bool(data.get("closed", False)), f"{field}.points")


def _checked(points: Any, closed: bool, field: str) -> np.ndarray:
    """Points (n, 2) without a repeated last one of a loop; raises InputError."""
    try:
        points = np.array(points, float)
    except (TypeError, ValueError):
        raise InputError("expected a list of points [x, y]", field=field) from None
    if points.ndim != 2 or points.shape[1] != 2:
        raise InputError(f"expected points of shape (n, 2), got {points.shape}", field=field)
    if not np.isfinite(points).all():
        raise InputError("contains numbers that are not finite", field=field)
    if closed and len(points) > 1 and np.array_equal(points[0], points[-1]):
        points = points[:-1]
    if len(points) < (3 if closed else 2):
        raise InputError(
            f"a{' closed' if closed else ''} curve needs at least {3 if closed else 2} points",
            field=field,
        )
    following = np.roll(points, -1, axis=0) if closed else points[1:]
    steps = np.hypot(*(following - points[: len(following)]).T)
    if steps.min() <= 1e-12 * np.ptp(points, axis=0).max():
        raise InputError(
            "two points in a row are the same",
            field=f"{field}[{(int(steps.argmin()) + 1) % len(points)}]",
        )
    return points


def direction(angle: Any) -> np.ndarray:
    """Unit vectors (..., 2) at angles (...), rad."""
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _turn(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angle from vectors a to b, in (-pi, pi]."""
    return np.arctan2(_cross(a, b), np.sum(a * b, axis=-1))
