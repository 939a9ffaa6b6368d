"""Meshes as programs write them, made into one surface: corners welded by their positions, polygons
cut into triangles, doubled and empty faces left out, all faces turned the same way.

Files split vertices for reasons that have nothing to do with the surface: texture seams, flat
shading, material groups, formats without shared vertices.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..checks import LARGEST
from ..errors import InputError
from ..wording import counted

WELD = 1e-6  # of the size: vertices this near to each other are one
_MOST_CUTS = 1000  # faces beside empty ones; of more, the empty ones are only left out
_EMPTY = 1e-9  # of the longest side: a face lower than that has no area


def cleaned(
    vertices: np.ndarray, faces: np.ndarray, tolerance: float = WELD
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Vertices (V, 3) and triangles (F, 3) as one surface, and what had to be done, in words.

    vertices (v, 3), faces (f, 3) : as read
    tolerance : of the size, within which vertices are welded

    Raises InputError for corners that aren't there or have no place.
    """
    notes = []
    wrong = (faces < 0) | (faces >= len(vertices))
    if wrong.any():
        raise InputError(
            f"names a vertex that isn't there (there are {len(vertices)})",
            field="faces",
            value=int(faces[wrong][0]),
        )
    used = np.unique(faces)
    far = ~(np.abs(vertices[used]) < LARGEST).all(axis=1)
    if far.any():
        raise InputError(
            f"corner {used[far][0]} is no place: its coordinates must be numbers below {LARGEST:g}",
            field="vertices",
            value=vertices[used[far][0]].tolist(),
        )
    size = float(np.linalg.norm(np.ptp(vertices[used], axis=0))) if len(used) else 0.0
    places, faces = welded(vertices, faces, tolerance * size)
    if len(places) < len(used):
        notes.append(
            f"{counted(len(used), 'corner')} welded into "
            f"{counted(len(places), 'vertex', 'vertices')}"
        )
    faces, split = without_empty(places, faces)
    if split:
        notes.append(f"{counted(split, 'face')} without area left out")
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    if len(first) < len(faces):
        notes.append(
            f"{counted(len(faces) - len(first), 'face that is', 'faces that are')} "
            "there twice left out"
        )
    faces, turned = turned_alike(faces[np.sort(first)])
    if turned:
        notes.append(f"{counted(turned, 'face')} turned round, to face like the others")
    used, faces = np.unique(faces, return_inverse=True)
    return places[used], faces.reshape(-1, 3), notes


def welded(
    vertices: np.ndarray, faces: np.ndarray, distance: float
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices in use, those within a distance of each other as one, and the faces between them."""
    used, faces = np.unique(faces, return_inverse=True)
    points = vertices[used]
    pairs = cKDTree(points).query_pairs(distance, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(points),) * 2)
    n, label = connected_components(graph, directed=False)
    first = np.full(n, len(points))
    np.minimum.at(first, label, np.arange(len(points)))
    order = np.argsort(first)  # in the order of the file
    rank = np.empty(n, int)
    rank[order] = np.arange(n)
    return points[first[order]], rank[label][faces].reshape(-1, 3)


def without_empty(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, int]:
    """Faces that have an area, and how many had none.

    Where a face's middle corner lies on its longest side, the neighbour across that side is cut in
    two there, so that no slit stays open.
    """
    left_out = len(faces) - int(np.count_nonzero(_distinct(faces)))
    faces = faces[_distinct(faces)]
    for _ in range(_MOST_CUTS):
        low, corner = _heights(vertices, faces)
        flat = np.flatnonzero(low)
        if not len(flat):
            return faces, left_out
        k = int(flat[0])
        c = int(faces[k, corner[k]])
        a, b = int(faces[k, (corner[k] + 1) % 3]), int(faces[k, (corner[k] + 2) % 3])
        faces = np.delete(faces, k, axis=0)
        left_out += 1
        holds = (faces == a).any(axis=1) & (faces == b).any(axis=1)
        cut = [[np.where(face == old, c, face) for old in (a, b)] for face in faces[holds]]
        faces = np.concatenate([faces[~holds], *(np.array(pair) for pair in cut)])
        faces = faces[_distinct(faces)]
    low, _ = _heights(vertices, faces)
    return faces[~low], left_out + int(np.count_nonzero(low))


def _distinct(faces: np.ndarray) -> np.ndarray:
    """(F,) whether the three corners differ."""
    a, b, c = faces.T
    return (a != b) & (b != c) & (c != a)


def _heights(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(F,) whether a face is flat, and the corner opposite to its longest side."""
    corners = vertices[faces]
    sides = np.linalg.norm(np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1), axis=2)
    corner = sides.argmax(axis=1)
    longest = sides.max(axis=1)
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    return area <= _EMPTY * longest**2, corner


def turned_alike(faces: np.ndarray) -> tuple[np.ndarray, int]:
    """The same faces, neighbours turned the same way, in each piece like most of them were; and how
    many were turned round."""
    if not len(faces):
        return faces, 0
    import igl

    turned, piece = igl.bfs_orient(np.ascontiguousarray(faces, np.int64))
    piece = np.asarray(piece).ravel()
    # a cyclic order is kept where the corner after the first is the same
    kept = (np.sort(faces, axis=1) == np.sort(turned, axis=1)).all(axis=1)
    same = kept & (_sense(faces) == _sense(np.asarray(turned)))
    mostly = np.bincount(piece, same) >= 0.5 * np.bincount(piece)
    found = np.where(mostly[piece][:, None], turned, np.asarray(turned)[:, ::-1])
    changed = _sense(found) != _sense(faces)
    found = np.where(changed[:, None], found, faces)
    return found, int(np.count_nonzero(changed))


def _sense(faces: np.ndarray) -> np.ndarray:
    """(F,) whether a face's corners are an even permutation of their ascending order."""
    a, b, c = faces.T
    return ((b > a).astype(int) + (c > b) + (a > c)) % 2 == 0


def pieces_of(faces: np.ndarray) -> int:
    """Of how many pieces that share no vertex a mesh of faces (F, 3) is."""
    used, corners = np.unique(faces, return_inverse=True)
    a, b, c = corners.reshape(-1, 3).T
    ones = np.ones(2 * len(a))
    graph = coo_array((ones, (np.r_[a, b], np.r_[b, c])), shape=(len(used), len(used)))
    return int(connected_components(graph, directed=False)[0])


def triangles_of(polygons: Iterable[Sequence[int]], vertices: np.ndarray) -> np.ndarray:
    """(F, 3) triangles of polygons: convex quads are cut along their shorter diagonal, other convex
    polygons from their first corner, all others ear by ear."""
    found: list[Sequence[int]] = []
    for polygon in polygons:
        if len(polygon) == 3 == len(set(polygon)):  # nearly all of them in large files
            found.append(polygon)
        else:
            found += _triangles(list(polygon), vertices)
    return np.array(found, int).reshape(-1, 3)


def _triangles(polygon: list[int], vertices: np.ndarray) -> list[tuple[int, int, int]]:
    """One polygon's; none of one that has fewer than three corners when repeated ones are left
    out. Raises ValueError for polygons that come back to a corner."""
    if len(polygon) < 3:
        raise ValueError("a face needs three or more different vertices")
    polygon = [corner for k, corner in enumerate(polygon) if corner != polygon[k - 1]]
    if len(set(polygon)) < len(polygon):
        raise ValueError("a face needs three or more different vertices")
    if len(polygon) < 3:
        return []
    if len(polygon) == 3:
        return [(polygon[0], polygon[1], polygon[2])]
    flat = _in_plane(vertices[polygon])
    n, found = len(polygon), []
    if all(_turns(flat[k - 2], flat[k - 1], flat[k][None])[0] > 0 for k in range(n)):
        if n == 4:
            lengths = np.linalg.norm(vertices[polygon[:2]] - vertices[polygon[2:]], axis=1)
            if lengths[1] < lengths[0]:
                a, b, c, d = polygon
                return [(a, b, d), (b, c, d)]
        return [(polygon[0], b, c) for b, c in zip(polygon[1:], polygon[2:])]
    corners = list(range(n))
    while len(corners) > 3:
        k = min(range(len(corners)), key=lambda k: _ear_rank(flat, corners, k))
        found.append((corners[k - 1], corners[k], corners[(k + 1) % len(corners)]))
        del corners[k]
    found.append((corners[0], corners[1], corners[2]))
    return [(polygon[a], polygon[b], polygon[c]) for a, b, c in found]


def _in_plane(points: np.ndarray) -> np.ndarray:
    """A polygon's corners (n, 2) in its plane, counter-clockwise: across Newell's normal."""
    following = np.roll(points, -1, axis=0)
    normal = np.cross(points - points[0], following - points[0]).sum(axis=0)
    if not normal.any():
        return points[:, :2]
    across = np.linalg.svd(normal[None])[2][1:]
    flat = points @ across.T
    area = np.sum(flat[:, 0] * np.roll(flat[:, 1], -1) - flat[:, 1] * np.roll(flat[:, 0], -1))
    return flat if area > 0 else flat[:, ::-1]


def _ear_rank(flat: np.ndarray, corners: list[int], k: int) -> tuple[bool, float]:
    """Ears before other corners, those with the shortest cut first."""
    a, b, c = (flat[corners[n % len(corners)]] for n in (k - 1, k, k + 1))
    others = flat[
        [
            m
            for m in corners
            if m not in (corners[k - 1], corners[k], corners[(k + 1) % len(corners)])
        ]
    ]
    inside = np.all([_turns(p, q, others) >= 0 for p, q in ((a, b), (b, c), (c, a))], axis=0)
    ear = float(_turns(a, b, c[None])[0]) > 0 and not inside.any()
    return not ear, float(np.linalg.norm(c - a))


def _turns(p: np.ndarray, q: np.ndarray, points: np.ndarray) -> np.ndarray:
    u, v = q - p, points - q
    return u[0] * v[:, 1] - u[1] * v[:, 0]
