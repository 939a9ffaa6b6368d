"""Faces of a planar curve network and their triangles: the surface that a network's joints span."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from .network import CurveNetwork

# Faces with more joints are openings of the structure, not part of its surface.
MOST_CORNERS = 8
_SAMPLES = 8
_EQUAL = 1e-9  # cuts that differ by less are equally short


def faces_of(network: CurveNetwork) -> list[list[int]]:
    """The bounded faces, each as its joints counter-clockwise.

    Every span is two directed edges; leaving each joint by the next edge clockwise from where one
    came walks around the face on the left. The outer face is the one that is walked clockwise.
    """
    edges, angles, areas = _directed_edges(network)
    following = _next_edges(edges, angles)
    faces, seen = [], np.zeros(len(edges), bool)
    for first in range(len(edges)):
        walk, edge = [], first
        while not seen[edge]:
            seen[edge] = True
            walk.append(edge)
            edge = following[edge]
        if walk and areas[walk].sum() > 0:
            faces.append([int(edges[e, 0]) for e in walk])
    return faces


def triangulate(network: CurveNetwork) -> np.ndarray:
    """Triangles (F, 3) of the joints, counter-clockwise: the faces with up to MOST_CORNERS joints,
    cut into ears.

    Of all ears the one with the shortest cut goes first, so quads are cut along their shorter
    diagonal. Raises InputError where there is no face.
    """
    triangles = [
        t
        for face in faces_of(network)
        if len(face) <= MOST_CORNERS
        for t in _ears(face, network.joints)
    ]
    if not triangles:
        raise InputError(
            f"the curves enclose no face of up to {MOST_CORNERS} joints", field="curves"
        )
    return np.array(triangles)


def _directed_edges(network: CurveNetwork) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joints (m, 2), outgoing angles (m,) and signed areas (m,) of the directed edges; 2k and 2k +
    1 are opposite."""
    edges, angles, areas = [], [], []
    for strand in network.strands:
        stations = np.linspace(strand.spans[:, 0], strand.spans[:, 1], _SAMPLES + 1, axis=1)
        places = strand.curve.position(stations)
        for k, (x, ends) in enumerate(zip(places, strand.joints[strand.ends].tolist())):
            x[0], x[-1] = network.joints[ends]
            area = 0.5 * np.sum(x[:-1, 0] * x[1:, 1] - x[1:, 0] * x[:-1, 1])
            edges += [ends, ends[::-1]]
            angles += [strand.angles[k], strand.angles[k] + strand.turnings[k] + np.pi]
            areas += [area, -area]
    return np.array(edges, int).reshape(-1, 2), np.mod(angles, 2 * np.pi), np.array(areas)


def _next_edges(edges: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """The edge (m,) that follows each one around the face on its left."""
    following = np.zeros(len(edges), int)
    order = np.lexsort((angles, edges[:, 0]))
    starts = np.flatnonzero(np.diff(edges[order, 0], prepend=-1))
    for around in np.split(order, starts[1:]):  # edges that leave one joint, counter-clockwise
        # arriving by an edge, leave by the next one clockwise
        following[around ^ 1] = np.roll(around, 1)
    return following


def _ears(face: list[int], joints: np.ndarray) -> list[tuple[int, int, int]]:
    """Triangles of a polygon of joints, given counter-clockwise."""
    rest = list(face)
    triangles: list[tuple[int, int, int]] = []
    while len(rest) > 3:
        ears = [e for k in range(len(rest)) if (e := _ear(rest, k, joints))]
        if not ears:
            return triangles
        # of equally short cuts the first, whatever rounding makes of a net that is turned
        shortest = min(ears)[0] * (1 + _EQUAL)
        k = next(k for length, k in ears if length <= shortest)
        triangles.append((rest[k - 1], rest[k], rest[(k + 1) % len(rest)]))
        del rest[k]
    # two curves that cross twice in a row enclose a lens
    if len(rest) < 3 or _area(*joints[rest]) <= 0:
        return triangles
    return [*triangles, (rest[0], rest[1], rest[2])]


def _ear(polygon: list[int], k: int, joints: np.ndarray) -> tuple[float, int] | None:
    """The length of the cut that takes corner k off, and k; None where it isn't inside the
    polygon."""
    corners = [polygon[k - 1], polygon[k], polygon[(k + 1) % len(polygon)]]
    a, b, c = joints[corners]
    if _area(a, b, c) <= 0:
        return None
    for other in polygon:
        if other not in corners:
            p = joints[other]
            if min(_area(a, b, p), _area(b, c, p), _area(c, a, p)) >= 0:
                return None
    return float(np.hypot(*(c - a))), k


def _area(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    """Twice the signed area of a triangle."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
