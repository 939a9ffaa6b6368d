"""Points on B-splines, rational or not, as files of curves give them: by control points, knots,
degree and weights."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.interpolate import BSpline

from ..errors import InputError

_MOST_HALVINGS = 10  # of a span between two knots
_AT_FIRST = 4  # pieces of such a span; an inflection in its middle would look straight with two


def spline_points(
    control: np.ndarray,
    knots: Sequence[float],
    degree: int,
    weights: Sequence[float] | None,
    sag: float,
    between: tuple[float, float] | None = None,
) -> np.ndarray:
    """Points (n, 3) of a B-spline curve, dense enough that straight pieces between them leave it by
    less than `sag`; corners, at knots as often repeated as the degree is high, are among them.

    The curve is where its basis is whole: between the knots of number `degree` and `-degree - 1`
    (Piegl, Tiller: The NURBS Book, 2nd edition, 1997, sections 2.4 and 4.2). Beyond them, knots
    that aren't repeated, as periodic splines have, would lead to nowhere.

    control (m, 3) : its control points
    knots : m + degree + 1 of them, increasing
    weights : (m,), positive; None: all the same
    between : parameters that the curve begins and ends at, where it is a part of the whole

    Raises InputError where they don't fit each other.
    """
    control, t = np.asarray(control, float), np.asarray(knots, float)
    m = len(control)
    if not 1 <= degree < m:
        raise InputError(f"has degree {degree} with {m} control points: more of them are needed")
    if len(t) != m + degree + 1:
        raise InputError(
            f"has {len(t)} knots with {m} control points and degree {degree}: expected "
            f"{m + degree + 1}"
        )
    w = np.ones(m) if weights is None or not len(weights) else np.asarray(weights, float)
    if w.shape != (m,) or not (np.isfinite(w) & (w > 0)).all():
        raise InputError("needs a positive weight for each control point")
    if not np.isfinite(t).all() or (np.diff(t) < 0).any() or not t[degree] < t[m]:
        raise InputError("needs knots that increase")
    curve = BSpline(t, np.column_stack([control * w[:, None], w]), degree)

    def at(u: np.ndarray) -> np.ndarray:
        x = curve(u)
        return x[..., :3] / x[..., 3:]

    low, high = (t[degree], t[m]) if between is None else between
    if not t[degree] <= low < high <= t[m]:
        raise InputError(
            f"begins at {low:g} and ends at {high:g}, its knots go from {t[degree]:g} to {t[m]:g}"
        )
    ends = np.unique(np.clip(t[degree : m + 1], low, high))
    if degree == 1:
        return at(ends)
    pieces = [_points_between(at, a, b, sag) for a, b in zip(ends[:-1], ends[1:])]
    return np.concatenate([*(piece[:-1] for piece in pieces), pieces[-1][-1:]])


def _points_between(
    at: Callable[[np.ndarray], np.ndarray], a: float, b: float, sag: float
) -> np.ndarray:
    """Points on a span, its ends included, evenly spaced in the parameter."""
    n = _AT_FIRST
    for _ in range(_MOST_HALVINGS):
        # the right end belongs to the next span, where a curve with a break would be elsewhere
        x = at(np.linspace(a, np.nextafter(b, a), 2 * n + 1))
        off = x[1::2] - 0.5 * (x[:-1:2] + x[2::2])
        if np.linalg.norm(off, axis=1).max() <= sag:
            return x[::2]
        n *= 2
    return x
