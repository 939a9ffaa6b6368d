"""Corners of drawn polylines, where smooth curves go through their points: at sharp ones a lath
ends and another one begins, as at those of a rectangle; others are rounded off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..wording import counted
from .drawing import DrawnCurve, Finding
from .outlines import Places

_SHARP = np.radians(60)  # a hexagon's turn; more is no smooth curve's
_ROUNDED = 0.1  # of a straight piece: how far a smooth curve may leave it; an octagon's does so


def split_at_corners(
    curves: Sequence[DrawnCurve], flat: Sequence[np.ndarray], say: Places
) -> tuple[list[DrawnCurve], list[np.ndarray], list[Finding]]:
    """The curves in pieces without sharp corners, their points in plan, and what was split.

    flat : points (n, 2) of each in plan; say : of points of the curves
    """
    kept, plan, places, label = [], [], [], ""
    for curve, points in zip(curves, flat):
        sharp = _sharp(curve)
        if not len(sharp) or curve.closed and len(sharp) < 2:  # a loop can't end at itself
            kept.append(curve)
            plan.append(points)
            continue
        places.append(curve.points[sharp])
        label = label or curve.label
        n = len(curve.points)
        bounds = [*sharp, sharp[0] + n] if curve.closed else [0, *sharp, n - 1]
        for start, end in zip(bounds[:-1], bounds[1:]):
            picked = np.arange(start, end + 1) % n
            piece = curve.points[picked]
            name = f"{curve.label.split(' from ')[0]} from {say(piece[0])}"
            kept.append(replace(curve, points=piece, closed=False, label=name))
            plan.append(points[picked])
    if not places:
        return list(curves), list(flat), []
    found = np.concatenate(places)
    text = (
        f"{counted(len(places), 'curve is', 'curves are')} taken for several laths, which end at "
        f"{counted(len(found), 'sharp corner')}, such as {label} (--curves polyline "
        "keeps corners in one lath)"
    )
    return kept, plan, [Finding("suspicious", text, found)]


def _sharp(curve: DrawnCurve) -> np.ndarray:
    """Numbers of the points at which a curve turns sharply."""
    x = curve.points
    if curve.closed:
        x = np.concatenate([x[-1:], x, x[:1]])
    if len(x) < 3:
        return np.empty(0, int)
    turns = np.arccos(np.clip(cosines_of_turns(x), -1, 1))
    return np.flatnonzero(turns > _SHARP + 1e-6) + (0 if curve.closed else 1)


def cosines_of_turns(points: np.ndarray) -> np.ndarray:
    """(n - 2,) cosines of the angles by which a polyline (n, d) turns at its inner points."""
    steps = np.diff(points, axis=0)
    steps = steps / np.linalg.norm(steps, axis=1)[:, None]
    return (steps[:-1] * steps[1:]).sum(axis=1)


def rounded_corners(curves: Sequence[DrawnCurve]) -> list[Finding]:
    """A finding where smooth curves through the points of polylines are far from what was drawn."""
    largest, places, worst = 0.0, [], None
    for curve in curves:
        away, share, place = _departure(curve)
        if share > _ROUNDED:
            places.append(place)
            if away > largest:
                largest, worst = away, curve
    if worst is None:
        return []
    text = (
        f"{counted(len(places), 'curve has', 'curves have')} corners that smooth curves "
        "through their points round off, "
        f"{worst.label} by up to {largest:.3g} (--curves polyline keeps corners)"
    )
    return [Finding("suspicious", text, np.array(places))]


def _departure(curve: DrawnCurve) -> tuple[float, float, np.ndarray]:
    """How far the smooth curve leaves the straight pieces' middles: as a length, as a share of the
    piece (the largest of each), and where that is."""
    from scipy.interpolate import CubicSpline

    points = curve.path
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if len(points) < 3 or not steps.all():
        return 0.0, 0.0, points[0]
    t = np.concatenate([[0.0], np.cumsum(steps)])
    spline = CubicSpline(t, points, bc_type="periodic" if curve.closed else "natural")
    middles = 0.5 * (points[:-1] + points[1:])
    away = np.linalg.norm(spline(0.5 * (t[:-1] + t[1:])) - middles, axis=1)
    shares = away / steps
    return float(away.max()), float(shares.max()), middles[int(shares.argmax())]
