"""Straightened networks: every curve becomes straight pieces, one corner between neighbouring
joints.

A piece runs from corner to corner and holds its joint somewhere in between, so it is a line through
the joint, by default along the curve's tangent, and the corner is where the lines of neighbouring
joints meet. Then the pieces assemble without stress, in the plane, with all joints where they were.

Two tangents meet between their joints only if the span bends to one side. Where it doesn't (an
inflection), or so unevenly that one half-piece would be very short, the directions of the strand's
lines are changed as little as possible (least squares) until every corner lies ahead of one joint
and behind the next, with halves as even as that allows (0.6 of each other, or else 0.35, or 0.15).
Turning a line at a joint costs nothing: the hinge takes it up. The alternative, tangents kept and
the corner put at the chord's middle, leaves a misfit of the order of the span's turning that the
rods would have to bend for; it is the fall-back where no such directions exist.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...geometry.network import Strand

# Smallest ratio of a corner's two half-pieces.
_LEAST_RATIO = 0.1
# Ratios that are aimed at, the first feasible one is taken: even halves make elements that can
# share parts.
_AIMED_RATIOS = (0.6, 0.35, 0.15)
# A span that turns further than this can't be followed by one corner.
_MOST_TURNING = np.radians(150.0)
# Directions change by at most this, rad; beyond, the net would be another one.
_MOST_SHIFT = 0.6
# rad: spans that turn by less are straight, however coarsely their coordinates are written; the
# place of a corner that is hardly one would be left to rounding, of 1e-8 at 1e6 sizes from the
# origin.
_FLAT = 1e-6


@dataclass(frozen=True)
class StraightStrand:
    """One curve's straight pieces.

    angles (J,) : directions of the lines at the joints, rad, continuous along the strand
    lengths (n_spans, 2) : of each span's half-pieces: joint to corner, corner to next joint
    corners (n_spans,) : signed corner angles, rad
    exact (n_spans,) : whether the corner is the lines' intersection (no stress) or the fall-back
    """

    strand: Strand
    angles: np.ndarray
    lengths: np.ndarray
    corners: np.ndarray
    exact: np.ndarray


def straighten(strand: Strand, joints: np.ndarray) -> StraightStrand:
    """Straight pieces for one strand of a network with joints (n, 2).

    Raises InputError where a span turns further than one corner can follow.
    """
    spans = _Spans.of(strand, joints)
    worst = np.argmax(np.abs(strand.turnings)) if strand.n_spans else 0
    if strand.n_spans and abs(strand.turnings[worst]) > _MOST_TURNING:
        raise InputError(
            f"turns by {np.degrees(abs(strand.turnings[worst])):.0f} degrees between two joints: "
            f"one "
            "corner can't follow that; add joints",
            field=strand.curve.field,
        )
    shift = np.zeros(len(strand.joints))
    if not spans.proper(shift, _AIMED_RATIOS[0]).all():
        shift = next(
            (
                found
                for found in (_least_shift(spans, len(shift), ratio) for ratio in _AIMED_RATIOS)
                if found.any() and spans.proper(found).all()
            ),
            shift,
        )
    angles = strand.angles + shift
    following = np.append(angles[1:], angles[0] + strand.curve.lap_turning)[: strand.n_spans]
    lengths, exact = spans.half_lengths(shift)
    return StraightStrand(strand, angles, lengths, following - angles[: strand.n_spans], exact)


@dataclass(frozen=True)
class _Spans:
    """Chords of a strand's spans and the angles that the tangents make with them.

    chords (m,) ; first, second (m,) : from chord to tangent at the first joint, from tangent to
    chord at the second, both positive where the span bends to the right; start, end (m,) : places
    of its joints in the strand
    """

    chords: np.ndarray
    first: np.ndarray
    second: np.ndarray
    start: np.ndarray
    end: np.ndarray

    @classmethod
    def of(cls, strand: Strand, joints: np.ndarray) -> _Spans:
        start, end = strand.ends.T
        chord = joints[strand.joints[end]] - joints[strand.joints[start]]
        direction = np.arctan2(chord[:, 1], chord[:, 0])
        first = _wrapped(strand.angles[start] - direction)
        return cls(np.hypot(*chord.T), first, -strand.turnings - first, start, end)

    def moved(self, shift: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Both angles after turning the lines at the joints by shift (J,)."""
        return self.first + shift[self.start], self.second - shift[self.end]

    def proper(self, shift: np.ndarray, ratio: float = _LEAST_RATIO) -> np.ndarray:
        """Whether each corner lies well between its joints (straight spans included), its halves
        within a ratio."""
        a, b = self.moved(shift)
        small, large = np.minimum(np.abs(a), np.abs(b)), np.maximum(np.abs(a), np.abs(b))
        return (large < _FLAT) | (
            (a * b > 0) & (small >= (1 - 1e-6) * ratio * large) & (small + large < np.pi)
        )

    def half_lengths(self, shift: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Half-pieces (m, 2) by the law of sines, the chord's halves where there is no proper
        corner; and where."""
        a, b = self.moved(shift)
        exact = self.proper(shift)
        bent = exact & (np.maximum(np.abs(a), np.abs(b)) >= _FLAT)
        whole = np.where(bent, np.sin(a + b), 1.0)
        shares = np.where(bent, np.stack([np.sin(b), np.sin(a)]) / whole, 0.5)
        return (self.chords * shares).T, exact


def _least_shift(spans: _Spans, n_joints: int, ratio: float) -> np.ndarray:
    """The smallest change (n_joints,) of the lines' directions that makes all corners proper; zero
    where none does.

    With the side sigma that each span is to bend to: sigma a >= r sigma b and sigma b >= r sigma a,
    linear in the shifts; least-distance programming by non-negative least squares (Lawson and
    Hanson, ch. 23).
    """
    from scipy.optimize import nnls

    a, b, side = spans.first, spans.second, _sides(spans, n_joints)
    rows, bounds = [], []
    for k, (start, end) in enumerate(zip(spans.start, spans.end)):
        for of_first, of_second in ((1.0, -ratio), (-ratio, 1.0)):
            row = np.zeros(n_joints)
            row[start] += side[k] * of_first
            row[end] -= side[k] * of_second
            rows.append(row)
            bounds.append(-side[k] * (of_first * a[k] + of_second * b[k]))
    E = np.vstack([np.array(rows).T, bounds])
    target = np.append(np.zeros(n_joints), 1.0)
    u, _ = nnls(E, target)
    r = E @ u - target
    if abs(r[-1]) < 1e-10:
        return np.zeros(n_joints)
    shift = -r[:-1] / r[-1]
    return shift if np.abs(shift).max() <= _MOST_SHIFT else np.zeros(n_joints)


def _sides(spans: _Spans, n_joints: int) -> np.ndarray:
    """The side (m,), 1 right or -1 left, that each span is to bend to.

    The chords turn at every joint, and one of the two spans there must bend to the inside of that
    turn for the line through the joint to pass outside. Of all choices that do, the one nearest to
    the tangents: dynamic programming along the strand.
    """
    sides = (1.0, -1.0)
    misfit = np.array(
        [[_misfit(side * a, side * b) for side in sides] for a, b in zip(spans.first, spans.second)]
    )
    m = len(misfit)
    closed = m == n_joints

    def barred(k: int) -> np.ndarray:
        """Cost (2, 2) of the sides of spans k - 1 and k: high where neither suits the chords' turn
        between them."""
        turn = np.sign(spans.first[k] + spans.second[k - 1])
        return (
            1e3
            * abs(spans.first[k] + spans.second[k - 1])
            * np.array([[turn not in (one, other) for other in sides] for one in sides])
        )

    best_total, best_path = np.inf, np.zeros(m, int)
    for first in (0, 1) if closed else (None,):
        cost = misfit[0] + (0.0 if first is None else np.where(np.arange(2) == first, 0.0, np.inf))
        back = []
        for k in range(1, m):
            step = cost[:, None] + barred(k)
            back.append(step.argmin(axis=0))
            cost = step.min(axis=0) + misfit[k]
        if closed:
            cost = cost + barred(0)[:, first]
        path = [int(cost.argmin())]
        for choice in reversed(back):
            path.append(int(choice[path[-1]]))
        if cost.min() < best_total:
            best_total, best_path = cost.min(), np.array(path[::-1])
    return np.array(sides)[best_path]


def _misfit(a: float, b: float) -> float:
    """How far tangents at angles a, b are from a proper corner on the positive side, squared."""
    return max(0.0, _LEAST_RATIO * b - a) ** 2 + max(0.0, _LEAST_RATIO * a - b) ** 2


def _wrapped(angle: np.ndarray) -> np.ndarray:
    """The angle in (-pi, pi]."""
    return np.pi - np.mod(np.pi - angle, 2 * np.pi)
