"""Straightening lamellas that stand upright on a surface: straight pieces, one corner between neighbouring joints.

Laid flat, a lamella is a planar strip whose centre line has the curve's normal curvature kappa_n(s) (its bending in the
tangent plane and its twist don't show there). In that plane it is straightened as a planar curve: the pieces run along
the tangents at the joints, and the corner is where these meet, its angle the integral of kappa_n between the joints.

Tangents that are nearly parallel (asymptotic lines, weak curvature) or that don't meet between the joints (inflections)
would put the corner anywhere. So the share f of the chord before the corner is, with the tangents' slopes a and b
against the chord,

    f = (b s + e^2 / 2) / (s^2 + e^2),   s = a + b,   e = 0.03,   kept within [0.25, 0.75]:

the tangents' meeting where they turn clearly, the chord's middle where they don't, continuous in between. The corner's
angle stays the integral; its height over the chord follows from it.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_simpson

from ..errors import InputError
from .base import ElementGroup
from .curve_network import CurveNetwork, Run
from .surfaces import Surface

_SAMPLES = 65  # a span: Simpson's rule is then exact to about 1e-8 on curves that make sensible lamellas
_BLEND = 0.03
_NEAREST = 0.25  # of the chord: no corner closer to a joint
_LARGEST_TURN = 1.4  # rad between neighbouring joints: nearer to pi/2 two straight pieces can't follow


@dataclass(frozen=True)
class Spans:
    """n spans between neighbouring joints of one lamella.

    lengths (n,) : arc lengths on the surface
    before, after (n,) : lengths from the first joint to the corner, from the corner to the second joint
    turns (n,) : corner angles, rad, positive where the lamella bends towards the normal
    shares, heights (n,) : where the corner is: share of the chord before it, signed distance from the chord
    """

    lengths: np.ndarray
    before: np.ndarray
    after: np.ndarray
    turns: np.ndarray
    shares: np.ndarray
    heights: np.ndarray


@dataclass(frozen=True)
class Lamella:
    """One straightened curve: its spans, and numbers of their parameters in the design's vector q.

    tangents (k, 3), normals (k, 3) : unit vectors at its joints
    before, after, corners (n,) : numbers of the two lengths and of the angle of each span
    """

    run: Run
    spans: Spans
    tangents: np.ndarray
    normals: np.ndarray
    before: np.ndarray
    after: np.ndarray
    corners: np.ndarray


@dataclass(frozen=True)
class Lamellas:
    """parameters (nq,) q; is_length (nq,) bool; groups: the elements; lamellas: one a curve."""

    parameters: np.ndarray
    is_length: np.ndarray
    groups: list[ElementGroup]
    lamellas: list[Lamella]


def straighten_on(surface: Surface, network: CurveNetwork) -> Lamellas:
    """Straight pieces and corners for a network on a surface. Raises InputError for spans that turn too far."""
    values: list[np.ndarray] = []
    full, ends, corners, lamellas = [], [], [], []
    first = 0
    for run in network.runs:
        spans = _spans(surface, run)
        n = len(spans.turns)
        before, after, angular = (first + np.arange(n) * step + shift for step, shift in ((2, 0), (2, 1), (1, 2 * n)))
        values += [np.stack([spans.before, spans.after], axis=1).ravel(), spans.turns]
        first += 3 * n
        full.append(np.stack([after[:-1], before[1:]], axis=1))
        if run.curve.closed:
            full.append(np.array([[after[-1], before[0]]]))
        else:
            ends.append(np.array([[before[0]], [after[-1]]]))
        corners.append(angular[:, None])
        velocity = run.curve.velocity(run.parameters)
        local = surface.at(run.curve.position(run.parameters))
        tangents = local.push(velocity)
        tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
        lamellas.append(Lamella(run, spans, tangents, local.normals, before, after, angular))
    is_length = np.ones(first, bool)
    is_length[np.concatenate(corners).ravel()] = False
    groups = [ElementGroup("linear", np.concatenate(rows)) for rows in (full, ends) if sum(map(len, rows))]
    groups.append(ElementGroup("angular", np.concatenate(corners)))
    return Lamellas(np.concatenate(values), is_length, groups, lamellas)


def _spans(surface: Surface, run: Run) -> Spans:
    rows = [_span(*_developed(surface, run, u, v)) for _, _, u, v in run.spans]
    spans = Spans(*np.array(rows).T)
    worst = int(np.argmax(np.abs(spans.turns)))
    if abs(spans.turns[worst]) > _LARGEST_TURN:
        raise InputError(f"turns by {spans.turns[worst]:.2f} rad between joints {worst} and {worst + 1}: more curves "
                         "across it are needed", field=run.curve.field)
    return spans


def _developed(surface: Surface, run: Run, u: float, v: float) -> tuple[np.ndarray, np.ndarray]:
    """Arc lengths and directions (m,) along the flat lamella between two joints, both from 0."""
    stations = np.linspace(u, v, _SAMPLES)
    velocity = run.curve.velocity(stations)
    local = surface.at(run.curve.position(stations))
    speed = np.linalg.norm(local.push(velocity), axis=1)
    lengths = cumulative_simpson(speed, x=stations, initial=0.0)
    return lengths, cumulative_simpson(speed * local.normal_curvatures(velocity), x=stations, initial=0.0)


def _span(lengths: np.ndarray, directions: np.ndarray) -> tuple[float, float, float, float, float, float]:
    """The fields of `Spans`, from the flat lamella between two joints."""
    chord = complex(cumulative_simpson(np.cos(directions), x=lengths)[-1],
                    cumulative_simpson(np.sin(directions), x=lengths)[-1])
    base, turn = abs(chord), float(directions[-1])
    slope = np.angle(chord)
    a, b = np.tan(slope), np.tan(turn - slope)
    share = (b * (a + b) + 0.5 * _BLEND**2) / ((a + b) ** 2 + _BLEND**2)
    share = float(np.clip(share, _NEAREST, 1 - _NEAREST))
    height = corner_height(base, share, turn)
    before, after = np.hypot([share * base, (1 - share) * base], height)
    return float(lengths[-1]), float(before), float(after), turn, share, height


def corner_height(base: float, share: float, turn: float) -> float:
    """Signed distance of the corner from the chord `base`, for a total turn |turn| < pi/2; it bulges against it.

    With t = tan(turn): atan(h / f D) + atan(h / (1 - f) D) = turn gives t h^2 + D h - f (1 - f) D^2 t = 0.
    """
    t, product = np.tan(turn), share * (1 - share)
    return -float(2 * base * product * t / (1 + np.sqrt(1 + 4 * product * t * t)))
