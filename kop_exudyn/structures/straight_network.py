"""Straightening a planar curve network: straight pieces, one corner between neighbouring joints.

A linear element is one straight beam from corner to corner with its joint in between, along the curve's tangent at the
joint. So the corner between two joints is where their tangents meet. Where they don't meet between the joints (spans
with an inflection, or nearly straight ones) the corner goes to the middle of the chord and keeps the turning between
the tangents as its angle; such a design doesn't assemble stress-free, and the assembly state shows by how much.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .base import ElementGroup
from .curve_network import CurveNetwork, Run

# A corner closer to a joint than this share of the chord would make a useless stub.
_SHORTEST = 0.12


@dataclass(frozen=True)
class StraightRod:
    """One straightened curve: numbers of its parameters in the design's vector q.

    run : the curve and its joints
    before, after (spans,) : length from the span's first joint to its corner, from the corner to its last joint
    corners (spans,) : corner angles
    tips : lengths beyond the first and the last joint, -1 where the rod ends at the joint
    headings (spans,) : direction of the piece before each corner in the flat network, rad
    points (spans, 2) : corners in the flat network
    """

    run: Run
    before: np.ndarray
    after: np.ndarray
    corners: np.ndarray
    tips: tuple[int, int]
    headings: np.ndarray
    points: np.ndarray


@dataclass(frozen=True)
class StraightNetwork:
    """parameters (nq,) q; is_length (nq,) bool; groups: the elements; rods: one a curve."""

    parameters: np.ndarray
    is_length: np.ndarray
    groups: list[ElementGroup]
    rods: list[StraightRod]


def straighten(network: CurveNetwork, free_ends: bool) -> StraightNetwork:
    """Straight pieces and corners for a network; with free ends, rods go on to the ends of their curves."""
    values: list[float] = []
    is_length: list[bool] = []
    full: list[tuple[int, int]] = []
    ends: list[tuple[int]] = []
    angular: list[tuple[int]] = []
    rods = []
    for run in network.runs:
        geometry = [_corner(run, *span) for span in run.spans]
        n = len(geometry)
        first = len(values)
        for l1, l2, *_ in geometry:
            values += [l1, l2]
        tips = _tips(run) if free_ends else (0.0, 0.0)
        tip_numbers = []
        for tip in tips:
            tip_numbers.append(len(values) if tip > 0 else -1)
            values += [tip] if tip > 0 else []
        is_length += [True] * (len(values) - first)
        corners = len(values) + np.arange(n)
        values += [angle for _, _, angle, *_ in geometry]
        is_length += [False] * n
        before, after = first + 2 * np.arange(n), first + 2 * np.arange(n) + 1
        for k in range(1, n):
            full.append((after[k - 1], before[k]))
        if run.curve.closed:
            full.append((after[-1], before[0]))
        else:
            for tip, inner in zip(tip_numbers, (before[0], after[-1])):
                (full if tip >= 0 else ends).append((tip, inner) if tip >= 0 else (inner,))
        angular += [(k,) for k in corners]
        rods.append(StraightRod(run, before, after, corners, tuple(tip_numbers),
                                np.array([g[3] for g in geometry]), np.array([g[4] for g in geometry])))
    groups = [ElementGroup("linear", np.array(rows, int)) for rows in (full, ends) if rows]
    groups.append(ElementGroup("angular", np.array(angular, int)))
    return StraightNetwork(np.array(values), np.array(is_length), groups, rods)


def _corner(run: Run, j0: int, j1: int, u0: float, u1: float) -> tuple[float, float, float, float, np.ndarray]:
    """(length before, length after, corner angle, heading before, corner point) of one span."""
    curve = run.curve
    p, q = curve.position(u0), curve.position(u1)
    heading = curve.heading(u0)
    turning = curve.turning(u0, u1)
    t0 = np.array([np.cos(heading), np.sin(heading)])
    t1 = np.array([np.cos(heading + turning), np.sin(heading + turning)])
    chord = float(np.linalg.norm(q - p))
    determinant = t0[0] * t1[1] - t0[1] * t1[0]
    if abs(determinant) > 1e-6:
        d = q - p
        l1 = float(d[0] * t1[1] - d[1] * t1[0]) / determinant
        l2 = float(t0[0] * d[1] - t0[1] * d[0]) / determinant
        if min(l1, l2) >= _SHORTEST * chord and l1 + l2 <= 2 * chord:
            return l1, l2, turning, heading, p + l1 * t0
    return chord / 2, chord / 2, turning, heading, 0.5 * (p + q)


def _tips(run: Run) -> tuple[float, float]:
    """Arc lengths beyond the outermost joints; zero where a curve ends at its joint."""
    if run.curve.closed:
        return 0.0, 0.0
    start, end = run.curve.length(0.0, run.parameters[0]), run.curve.length(run.parameters[-1], run.curve.end)
    least = 1e-6 * run.curve.length(0.0, run.curve.end)
    return tuple(0.0 if tip < least else tip for tip in (start, end))
