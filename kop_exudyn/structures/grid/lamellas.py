"""Straightening lamellas that stand upright on a surface: straight pieces, one corner between
neighbouring joints.

Laid flat, a lamella is a planar strip whose centre line has the curve's normal curvature kappa_n(s)
(its bending in the tangent plane and its twist don't show there). In that plane it is straightened
as a planar curve: the pieces run along the tangents at the joints, and the corner is where these
meet, its angle the integral of kappa_n between the joints.

Tangents that are nearly parallel (asymptotic lines, weak curvature) or that don't meet between the
joints (inflections) would put the corner anywhere. So the share f of the chord before the corner
is, with the tangents' slopes a and b against the chord,

    f = (b s + e^2 / 2) / (s^2 + e^2),   s = a + b,   e = 0.03,   kept within [0.25, 0.75]:

the tangents' meeting where they turn clearly, the chord's middle where they don't, continuous in
between. The corner's angle stays the integral; its height over the chord follows from it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...geometry.network import CurveNetwork, Strand
from ...geometry.surfaces import Surface
from ..numbering import Numbering, StrandNumbers, number_pieces

# a span: Simpson's rule is then exact to about 1e-8 on curves that make sensible lamellas
_SAMPLES = 65
_BLEND = 0.03
_NEAREST = 0.25  # of the chord: no corner closer to a joint
# rad between neighbouring joints: nearer to pi/2 two straight pieces can't follow
_LARGEST_TURN = 1.4


@dataclass(frozen=True)
class Spans:
    """n spans between neighbouring joints of one lamella.

    lengths (n,) : arc lengths on the surface
    before, after (n,) : lengths from the first joint to the corner, from the corner to the second
        joint
    turns (n,) : corner angles, rad, positive where the lamella bends towards the normal
    shares, heights (n,) : where the corner is: share of the chord before it, signed distance from
        the chord
    """

    lengths: np.ndarray
    before: np.ndarray
    after: np.ndarray
    turns: np.ndarray
    shares: np.ndarray
    heights: np.ndarray


@dataclass(frozen=True)
class Lamella:
    """One straightened curve: its spans, and where their parameters stand in the design's vector q.

    tangents (J, 3), normals (J, 3) : unit vectors at its joints
    """

    strand: Strand
    spans: Spans
    tangents: np.ndarray
    normals: np.ndarray
    numbers: StrandNumbers


@dataclass(frozen=True)
class Lamellas:
    """numbering: parameters and elements; lamellas: one a curve."""

    numbering: Numbering
    lamellas: list[Lamella]


def straighten_on(surface: Surface, network: CurveNetwork) -> Lamellas:
    """Straight pieces and corners for a network on a surface. Raises InputError for spans that turn
    too far."""
    straight = [_spans(surface, strand) for strand in network.strands]
    numbering = number_pieces(
        network.strands,
        [np.stack([spans.before, spans.after], axis=1) for spans in straight],
        [spans.turns for spans in straight],
    )
    lamellas = []
    for strand, spans, numbers in zip(network.strands, straight, numbering.strands):
        local = surface.at(network.joints[strand.joints])
        tangents = local.push(strand.tangents)
        tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
        lamellas.append(Lamella(strand, spans, tangents, local.normals, numbers))
    return Lamellas(numbering, lamellas)


def _spans(surface: Surface, strand: Strand) -> Spans:
    lengths, directions = _developed(surface, strand)
    from scipy.integrate import cumulative_simpson

    turns = directions[:, -1]
    worst = int(np.argmax(np.abs(turns)))
    if abs(turns[worst]) > _LARGEST_TURN:
        raise InputError(
            f"turns by {turns[worst]:.2f} rad between joints {worst} and {worst + 1}: more curves "
            "across it are needed",
            field=strand.curve.field,
        )
    chords = [cumulative_simpson(along(directions), x=lengths)[:, -1] for along in (np.cos, np.sin)]
    bases, slopes = np.hypot(*chords), np.arctan2(chords[1], chords[0])
    a, b = np.tan(slopes), np.tan(turns - slopes)
    shares = (b * (a + b) + 0.5 * _BLEND**2) / ((a + b) ** 2 + _BLEND**2)
    shares = np.clip(shares, _NEAREST, 1 - _NEAREST)
    heights = np.asarray(corner_height(bases, shares, turns))
    before, after = np.hypot([shares * bases, (1 - shares) * bases], heights)
    return Spans(lengths[:, -1], before, after, turns, shares, heights)


def _developed(surface: Surface, strand: Strand) -> tuple[np.ndarray, np.ndarray]:
    """Arc lengths and directions (n_spans, m) along the flat lamella between joints, both from
    0."""
    from scipy.integrate import cumulative_simpson

    stations = np.linspace(strand.spans[:, 0], strand.spans[:, 1], _SAMPLES, axis=-1)
    along = strand.curve.tangent(stations).reshape(-1, 2)
    local = surface.at(strand.curve.position(stations).reshape(-1, 2))
    speed = np.linalg.norm(local.push(along), axis=1)
    bending = speed * local.normal_curvatures(along)
    lengths, directions = (
        cumulative_simpson(rate.reshape(stations.shape), x=stations, initial=0.0)
        for rate in (speed, bending)
    )
    return lengths, directions


def corner_height(
    base: np.ndarray | float, share: np.ndarray | float, turn: np.ndarray | float
) -> np.ndarray | float:
    """Signed distance of the corner from the chord `base`, for a total turn |turn| < pi/2; it
    bulges against it.

    With t = tan(turn): atan(h / f D) + atan(h / (1 - f) D) = turn gives t h^2 + D h - f (1 - f) D^2
    t = 0.
    """
    t, product = np.tan(turn), share * (1 - share)
    return -2 * base * product * t / (1 + np.sqrt(1 + 4 * product * t * t))
