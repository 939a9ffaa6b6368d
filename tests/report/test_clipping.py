"""Clipped meshes: area, orientation and edge of the part that is left."""

from __future__ import annotations

import numpy as np
import pytest

from kop_exudyn.report.clipping import clipped


def grid(n: int) -> tuple[np.ndarray, np.ndarray]:
    """The square [-1, 1]^2 in 2 n^2 triangles."""
    u, v = np.meshgrid(*2 * [np.linspace(-1, 1, n + 1)], indexing="ij")
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    a, b, c, d = corner, corner + n + 1, corner + n + 2, corner + 1
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return np.stack([u.ravel(), v.ravel(), 0 * u.ravel()], axis=1), faces


def areas(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    a, b, c = vertices[faces].transpose(1, 0, 2)
    return 0.5 * np.cross(b - a, c - a)[:, 2]


def test_half_plane_is_cut_exactly():
    vertices, faces = grid(7)
    x, y = vertices[:, :2].T
    values = x + 0.3 * y - 0.2
    found, triangles = clipped(vertices, faces, values)
    assert areas(found, triangles).sum() == pytest.approx(2 * 1.2)  # from x = -1 to x = 0.2 - 0.3 y
    assert (areas(found, triangles) > -1e-12).all()
    assert (found[:, 0] + 0.3 * found[:, 1]).max() == pytest.approx(0.2)
    assert len(np.unique(found, axis=0)) == len(found)


def test_disc():
    vertices, faces = grid(40)
    found, triangles = clipped(vertices, faces, np.linalg.norm(vertices, axis=1) - 0.8)
    assert areas(found, triangles).sum() == pytest.approx(np.pi * 0.64, rel=2e-3)
    assert np.linalg.norm(found, axis=1).max() < 0.8 + 1e-3


@pytest.mark.parametrize("value, left", [(-1.0, 18), (0.0, 18), (1.0, 0)])
def test_all_or_nothing(value, left):
    vertices, faces = grid(3)
    found, triangles = clipped(vertices, faces, np.full(len(vertices), value))
    assert len(triangles) == left and len(found) == (16 if left else 0)
