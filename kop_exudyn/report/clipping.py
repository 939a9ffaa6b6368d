"""Triangle meshes cut where a function of their vertices changes its sign."""

from __future__ import annotations

import numpy as np


def clipped(
    vertices: np.ndarray, faces: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The part of a mesh where values (V,), linear between the vertices, are not positive.

    vertices (V, 3), faces (F, 3) : triangles; returns the same of the part, without unused vertices
    """
    inside = values <= 0
    count = inside[faces].sum(axis=1)
    one, two = _turned(faces[count == 1], inside), _turned(faces[count == 2], ~inside)
    # a triangle's cut edges start at its first vertex, the one that is alone on its side
    cuts = np.concatenate(
        [edges for alone in (one, two) for edges in (alone[:, [0, 1]], alone[:, [0, 2]])]
    )
    edges, number = np.unique(np.sort(cuts, axis=1), axis=0, return_inverse=True)
    a, b, c, d = np.split(
        len(vertices) + number.reshape(-1), np.cumsum([len(one), len(one), len(two)])
    )
    start, end = values[edges].T
    share = (start / (start - end))[:, None]
    points = (1 - share) * vertices[edges[:, 0]] + share * vertices[edges[:, 1]]
    found = np.concatenate(
        [
            faces[count == 3],
            np.stack([one[:, 0], a, b], axis=1),
            np.stack([c, two[:, 1], two[:, 2]], axis=1),
            np.stack([c, two[:, 2], d], axis=1),
        ]
    )
    used, numbers = np.unique(found, return_inverse=True)
    return np.concatenate([vertices, points])[used], numbers.reshape(-1, 3)


def _turned(faces: np.ndarray, alone: np.ndarray) -> np.ndarray:
    """Triangles (n, 3) with the vertex first that is marked, in the same sense of rotation."""
    first = alone[faces].argmax(axis=1)
    return faces[np.arange(len(faces))[:, None], (first[:, None] + np.arange(3)) % 3]
