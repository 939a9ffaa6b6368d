"""Rods as solids: the true cross-sections swept along them, as one triangle mesh."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import shapely

from ..errors import InputError
from ..rods.rotations import bend_coefficients, exp_se3, log_so3
from ..scene.scene import Scene
from ..scene.state import State


@dataclass(frozen=True)
class RodMesh:
    """A triangle mesh of rods, every rod piece a closed surface; faces look outwards.

    vertices (V, 3) ; faces (F, 3)
    chains (V,) : the rod piece that each vertex belongs to
    elements (V,) : the rod element that is nearest, -1 on rigid pieces
    """

    vertices: np.ndarray
    faces: np.ndarray
    chains: np.ndarray
    elements: np.ndarray

    def moved(self, motion: Callable[[np.ndarray], np.ndarray]) -> RodMesh:
        """The mesh with its vertices moved."""
        return replace(self, vertices=motion(self.vertices))


def sweep(
    scene: Scene, state: State, outline: np.ndarray | None = None, refinement: int = 1
) -> RodMesh:
    """Sweep every rod piece's section along its nodes.

    outline : (k, 2) corners (y, z), counter-clockwise, for rods without a section
    refinement : rings an element; more than one follows the rod's own curve between its nodes

    Raises InputError where a rod has no section and no outline is given.
    """
    x, R = scene.node_poses(state)
    vertices, faces, chains, elements, count = [], [], [], [], 0
    for number, chain in enumerate(scene.chains):
        corners = chain.section.outline if chain.section is not None else outline
        if corners is None:
            raise InputError(
                "a rod without cross-section can't be drawn as a solid", field="section"
            )
        places, frames, owner = _refined(x[chain.nodes], R[chain.nodes], chain.elements, refinement)
        local = np.concatenate([np.zeros((len(corners), 1)), corners], axis=1)
        ring = places[:, None] + np.einsum("nij,kj->nki", frames, local)
        vertices.append(ring.reshape(-1, 3))
        faces.append(tube(len(places), corners) + count)
        chains.append(np.full(ring.shape[0] * ring.shape[1], number))
        elements.append(np.repeat(owner, len(corners)))
        count += len(vertices[-1])
    return RodMesh(*(np.concatenate(a) for a in (vertices, faces, chains, elements)))


def tube(n_rings: int, corners: np.ndarray) -> np.ndarray:
    """(F, 3) triangles of a tube of rings after each other along x, closed at both ends."""
    k = len(corners)
    start = k * np.arange(n_rings - 1)[:, None] + np.arange(k)
    step = k * np.arange(n_rings - 1)[:, None] + (np.arange(k) + 1) % k
    sides = np.concatenate(
        [np.stack([start, step, step + k], axis=2), np.stack([start, step + k, start + k], axis=2)]
    )
    cap = _caps(corners)
    return np.concatenate([cap[:, ::-1], sides.reshape(-1, 3), cap + k * (n_rings - 1)])


def _refined(
    x: np.ndarray, R: np.ndarray, elements: np.ndarray, refinement: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places, frames and owning elements of the rings along a rod piece.

    Between nodes the pose moves at constant strain, which is the element's own interpolation.
    """
    if not len(elements):
        return x, R, np.full(len(x), -1)
    if refinement == 1:
        return x, R, np.append(elements, elements[-1])
    share = np.arange(refinement) / refinement
    p, turns = exp_se3(share[None, :, None] * _twists(x, R)[:, None])
    places = x[:-1, None] + np.einsum("nij,nsj->nsi", R[:-1], p)
    frames = R[:-1, None] @ turns
    return (
        np.concatenate([places.reshape(-1, 3), x[-1:]]),
        np.concatenate([frames.reshape(-1, 3, 3), R[-1:]]),
        np.append(np.repeat(elements, refinement), elements[-1]),
    )


def _twists(x: np.ndarray, R: np.ndarray) -> np.ndarray:
    """(n, 6) relative motions (u, phi) between poses (n + 1) after each other, see
    `rods.element`."""
    phi = log_so3(np.swapaxes(R[:-1], 1, 2) @ R[1:])
    p = np.einsum("nji,nj->ni", R[:-1], x[1:] - x[:-1])
    c = bend_coefficients(np.einsum("ni,ni->n", phi, phi))[0][:, None]
    return np.concatenate(
        [p - 0.5 * np.cross(phi, p) + c * np.cross(phi, np.cross(phi, p)), phi], axis=1
    )


def _caps(corners: np.ndarray) -> np.ndarray:
    """(n, 3) triangles of a simple counter-clockwise polygon (k, 2)."""
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(shapely.Polygon(corners)))
    points = shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, :3]
    # shapely gives their places: which corners these are
    numbers = np.linalg.norm(points[:, :, None] - corners, axis=3).argmin(axis=2)
    a, b, c = (corners[numbers[:, k]] for k in range(3))
    turn = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    return np.where(turn[:, None] > 0, numbers, numbers[:, ::-1])
