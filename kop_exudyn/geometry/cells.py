"""The cells between the joints of a surface structure, by which loads per area are shared."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from ..arrays import Numbers, Points

_OUTSIDE = 3.0  # median edges: longer triangles span what is outside
_SLIVER = 0.04  # of the longest edge's square: twice a triangle's area in the plane
_ON_CIRCLE = 0.02  # rad by which the angles opposite to an edge may miss pi
_NEXT = [1, 2, 0]


def cells_between(points: Points, links: np.ndarray | None = None) -> list[np.ndarray]:
    """Cells as the numbers of their corners, around each: the triangles of points' (n, 3) Delaunay
    triangulation in the plane that they are nearest to, joined across edges that are no links
    (m, 2), so that they are those of a net whose rods are the links.

    Triangles with an edge longer than three times the median edge lie outside and are left out,
    and narrow ones along the rim, as there are where it is straight but for rounding.
    Without links, and where these don't bound cells, triangles are joined whose corners lie on one
    circle: by which edge they are told apart is chance then.

    Raises scipy.spatial.QhullError or ValueError for points that span no surface.
    """
    from scipy.spatial import Delaunay

    axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    flat = points @ axes[:2].T
    found = Delaunay(flat)
    corners, beside = found.simplices.astype(np.int64), found.neighbors
    sides = points[corners[:, _NEXT]] - points[corners]
    lengths = np.linalg.norm(sides, axis=2)
    # all the same way round; neighbour k lies opposite to corner k
    u, v = flat[corners[:, 1]] - flat[corners[:, 0]], flat[corners[:, 2]] - flat[corners[:, 0]]
    twice = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    turned = twice < 0
    inside = lengths.max(axis=1) <= _OUTSIDE * np.median(lengths)
    longest = np.max([np.sum(w**2, axis=1) for w in (u, v, v - u)], axis=0)
    narrow = np.abs(twice) < _SLIVER * longest
    while True:  # from the rim inwards
        at_rim = ~inside[beside] | (beside < 0)
        if not (dropped := inside & narrow & at_rim.any(axis=1)).any():
            break
        inside[dropped] = False
    corners[turned], beside = corners[turned][:, ::-1], beside.copy()
    beside[turned] = beside[turned][:, ::-1]
    angles = _angles(points[corners])
    triangle, k = np.nonzero((beside >= 0) & inside[:, None] & inside[beside])
    other = beside[triangle, k]
    ends = np.sort(np.stack([corners[triangle, (k + 1) % 3], corners[triangle, (k + 2) % 3]]), 0)
    their_k = np.argmax(beside[other] == triangle[:, None], axis=1)
    on_circle = np.abs(angles[triangle, k] + angles[other, their_k] - np.pi) < _ON_CIRCLE
    pairs = np.stack([triangle, other], axis=1)
    cells, left = [], np.flatnonzero(inside)
    rules = [on_circle]
    if links is not None and len(links) >= len(points):  # fewer bound no cells
        n = len(points)
        known = np.unique(np.sort(links, axis=1) @ [n, 1])
        rules.insert(0, ~np.isin(ends[0] * n + ends[1], known))
    for joined in rules:
        whole, left = _joined(corners, left, pairs[joined])
        cells += whole
    return cells + list(corners[left])


def shares_of(points: Points, cells: list[np.ndarray]) -> tuple[Numbers, Numbers]:
    """Areas (n,) of the cells that their corners have, on the surface and in plan: each cell is a
    fan of triangles about its middle, and a corner has half of the two that it belongs to."""
    surface, plan = np.zeros(len(points)), np.zeros(len(points))
    for size in {len(cell) for cell in cells}:
        own = np.array([cell for cell in cells if len(cell) == size])
        x = points[own]
        arms = x - x.mean(axis=1, keepdims=True)
        normals = 0.5 * np.cross(arms, np.roll(arms, -1, axis=1))
        for areas, which in (
            (np.linalg.norm(normals, axis=2), surface),
            (np.abs(normals[:, :, 2]), plan),
        ):
            np.add.at(which, own, 0.5 * (areas + np.roll(areas, 1, axis=1)))
    return surface, plan


def _angles(x: np.ndarray) -> np.ndarray:
    """(t, 3) angles of triangles (t, 3, 3) at their corners."""
    a, b = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=2), np.einsum("tci,tci->tc", a, b))


def _joined(
    corners: np.ndarray, left: np.ndarray, pairs: np.ndarray
) -> tuple[list[np.ndarray], np.ndarray]:
    """Polygons of the triangles that are joined in pairs, out of those left; and those that are
    left, as they are alone or don't make a polygon with all of their corners on its rim."""
    n = len(corners)
    there = np.zeros(n, bool)
    there[left] = True
    pairs = pairs[there[pairs].all(axis=1)]
    graph = sp.coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    labels = connected_components(graph, directed=False)[1]
    order = left[np.argsort(labels[left], kind="stable")]
    groups = np.split(order, np.flatnonzero(np.diff(labels[order])) + 1)
    cells, alone = [], []
    for group in groups:
        rim = _rim(corners[group]) if len(group) > 1 else None
        if rim is None:
            alone.append(group)
        else:
            cells.append(rim)
    return cells, np.concatenate(alone) if alone else np.zeros(0, int)


def _rim(triangles: np.ndarray) -> np.ndarray | None:
    """The corners around triangles (t, 3) that are all the same way round; None unless they are one
    loop with all corners in it."""
    sides = {(int(a), int(b)) for t in triangles for a, b in zip(t, t[_NEXT])}
    after = {a: b for a, b in sides if (b, a) not in sides}
    start = next(iter(after), None)
    if start is None:
        return None
    loop = [start]
    while (ahead := after[loop[-1]]) != start and len(loop) <= len(after):
        if ahead not in after:
            return None
        loop.append(ahead)
    return np.array(loop) if len(loop) == len(np.unique(triangles)) else None
