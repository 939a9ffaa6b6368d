"""How large something is, whichever way it is turned.

The diagonal of a box along the axes grows by up to 41 % when a square plate is turned under it, and
every percentage of it shrinks. The size of points here is sqrt(3) times the mean width of their
convex hull: the mean, over all directions, of the distance between the two parallel planes that
hold it. A ball and a cube as wide as the points are on average have boxes with that diagonal. It
doesn't change when points are turned, moved or mirrored, grows with their scale, and changes by no
more than the points do.
"""

from __future__ import annotations

import numpy as np

_FLAT = 1e-11  # of the extent: thinner hulls are flat, and narrower ones straight
# Of the extent: across what is thinner, Qhull may merge facets for ever. Which points and edges a
# hull has doesn't change when an axis is stretched, so that it is found of a body as thick as wide.
_THIN = 1e-6


def size_of_points(points: np.ndarray) -> float:
    """sqrt(3) times the mean width of points (n, k), k = 2 or 3; zero for one point."""
    return float(np.sqrt(3.0) * mean_width(points))


def mean_width(points: np.ndarray) -> float:
    """Mean width in space of the convex hull of points (n, k), k = 2 or 3.

    Of a polytope with edges of lengths l_i, at which the outer normals of the two faces make angles
    a_i, it is sum l_i a_i / 4 pi; that leaves a quarter of the perimeter of a flat one, and half
    the length of a segment (Santalo, Integral Geometry and Geometric Probability, 1976, section
    13.4).
    """
    x = np.asarray(points, float)
    x = x - x.mean(axis=0)
    extent = float(np.abs(x).max(initial=0.0))
    if not extent:
        return 0.0
    axes = np.linalg.svd(x / extent, full_matrices=False)[2]
    x = x @ axes.T / extent  # the widest direction first
    flat = int(np.count_nonzero(np.ptp(x, axis=0) > _FLAT))
    width = (_segment, _polygon, _polytope)[flat - 1](x[:, :flat])
    return extent * width


def _segment(x: np.ndarray) -> float:
    return 0.5 * float(np.ptp(x))


def _polygon(x: np.ndarray) -> float:
    from scipy.spatial import ConvexHull

    return 0.25 * float(ConvexHull(x).area)  # of a plane figure "area" is the perimeter


def _polytope(x: np.ndarray) -> float:
    from scipy.spatial import ConvexHull

    stretched = np.ptp(x, axis=0)
    stretched[stretched >= _THIN] = 1.0
    hull = ConvexHull(x / stretched)
    normals, corner = hull.equations[:, :3] / stretched, np.arange(3)  # of any length
    # neighbour k of a triangle lies across the edge opposite to its corner k; each edge comes twice
    ends = [x[hull.simplices[:, (corner + k) % 3]] for k in (1, 2)]
    lengths = np.linalg.norm(ends[1] - ends[0], axis=2)
    others = normals[hull.neighbors]
    sines = np.linalg.norm(np.cross(normals[:, None], others), axis=2)
    angles = np.arctan2(sines, np.einsum("fk,fck->fc", normals, others))
    return float((lengths * angles).sum()) / (8 * np.pi)
