"""Lays out an umbrella mesh over a planar base mesh of equilateral triangles: one cell a triangle,
arms on inner edges.

With r the triangles' inradius and t the thickness: T axes lie r - t/2 from a cell's centre, arms
stand on the base edges, X axes lie t/2 beyond the edge, in the cell that is flipped; plate rods lie
t/2 beyond their T axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import InputError
from .mesh import BOTTOM, TOP, UmbrellaMesh, UmbrellaRods, UmbrellaTarget

_EQUILATERAL = 1e-3  # relative error of edge lengths
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Plates:
    """Sizes of the plates and of all rods.

    arm_position : distance of an arm from the middle of its plate edge
    thickness, width : of plate rods and arms
    spacing : of a deployed cell's plates, which the actuators aim at
    """

    arm_position: float = 10.0
    thickness: float = 3.0
    width: float = 5.0
    spacing: float = 15.0


class BaseMesh:
    """A planar mesh of equal equilateral triangles.

    Parameters
    ----------
    vertices : (V, 2)
    faces : (n_cells, 3)
    flipped : whether the first cell is a flipped one; cells that share an edge are never both
        flipped, or both not

    Attributes
    ----------
    edge, inradius : of the triangles
    centres : (n_cells, 2)
    inner : (n_edges, 2) vertices of the inner edges; midpoints (n_edges, 2)
    cells : (n_edges, 2) cells of each inner edge, the flipped one last

    Raises InputError for another kind of mesh.
    """

    def __init__(self, vertices: Any, faces: Any, flipped: bool = False):
        self.vertices, self.faces = _checked(vertices, faces)
        corners = self.vertices[self.faces]
        sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
        self.edge = float(sides.mean())
        error = np.abs(sides - self.edge).max(axis=1)
        if not error.max() <= _EQUILATERAL * self.edge:
            raise InputError(
                "triangles must be equilateral and equally large",
                field=f"base.faces[{int(error.argmax())}]",
            )
        self.centres = corners.mean(axis=1)
        self.inradius = self.edge / (2 * np.sqrt(3))
        self.inner, pairs = _inner_edges(self.faces)
        self.midpoints = self.vertices[self.inner].mean(axis=1)
        self.flipped = bool(flipped)
        kind = self._pointing() ^ self.flipped
        if (kind[pairs[:, 0]] == kind[pairs[:, 1]]).any():
            raise InputError("triangles don't belong to one lattice", field="base.faces")
        self.cells = np.where(kind[pairs[:, :1]], pairs[:, ::-1], pairs)
        neighbours = np.bincount(pairs.ravel(), minlength=len(self.faces))
        if (neighbours == 0).any():
            raise InputError(
                "a triangle without neighbours", field=f"base.faces[{int(neighbours.argmin())}]"
            )

    def _pointing(self) -> np.ndarray:
        """(n_cells,) bool: whether a triangle points another way than the first; neighbours in a
        lattice differ."""
        to_corner = self.vertices[self.faces[:, 0]] - self.centres
        angle = np.arctan2(to_corner[:, 1], to_corner[:, 0])
        return np.abs(np.angle(np.exp(3j * (angle - angle[0])))) > np.pi / 2


def _checked(vertices: Any, faces: Any) -> tuple[np.ndarray, np.ndarray]:
    """Arrays of vertices and faces; InputError for wrong shapes, values or indices."""
    try:
        vertices, faces = np.array(vertices, float), np.array(faces, int)
    except (TypeError, ValueError):
        raise InputError("expected lists of points (x, y) and of triangles", field="base") from None
    if vertices.ndim != 2 or vertices.shape[1] != 2 or not np.isfinite(vertices).all():
        raise InputError("expected finite points (x, y)", field="base.vertices")
    if faces.ndim != 2 or faces.shape[1] != 3 or not len(faces):
        raise InputError("expected triangles", field="base.faces")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError(
            f"names a vertex that doesn't exist (there are {len(vertices)})", field="base.faces"
        )
    return vertices, faces


def _inner_edges(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n_edges, 2) and cells (n_edges, 2) of the edges that two triangles share."""
    ends = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    keys, where, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    if count.max() > 2:
        raise InputError("an edge belongs to more than two triangles", field="base.faces")
    order = np.argsort(where.ravel(), kind="stable")
    first = (np.cumsum(count) - count)[count == 2]
    return keys[count == 2], np.stack([order[first], order[first + 1]], axis=1) // 3


def umbrella_mesh(
    base: BaseMesh, lengths: Any, plates: Plates = Plates(), target: UmbrellaTarget | None = None
) -> UmbrellaMesh:
    """The umbrella mesh over a base mesh; lengths (n_cells, 2) of the arms, top and bottom.

    Joints are numbered cell by cell (top centre, top edges, bottom centre, bottom edges), then one
    X joint an inner edge. Plate edges without an arm are left out: their rods would hang free.
    """
    lengths = np.array(lengths, float)
    n_cells = len(base.faces)
    if lengths.shape != (n_cells, 2) or not (np.isfinite(lengths).all() and (lengths > 0).all()):
        raise InputError(f"expected {n_cells} pairs of positive lengths", field="lengths")
    if not plates.arm_position < base.edge / 2 or plates.thickness >= base.inradius:
        raise InputError(
            "arms must stand within the plate edges",
            field="plates.arm_position",
            value=plates.arm_position,
        )
    outline = _Outline(base, lengths, plates)
    return UmbrellaMesh(
        positions=outline.positions,
        frames=outline.frames,
        hinged=outline.hinged,
        rods=outline.rods(),
        centres=outline.centres,
        crossings=outline.crossings,
        lengths=lengths,
        thickness=plates.thickness,
        width=plates.width,
        plate_edge=base.edge - np.sqrt(3) * plates.thickness,
        spacing=plates.spacing,
        size=outline.size(),
        target=target,
    )


class _Outline:
    """Joints and rods of a mesh under construction; all of one sort at a time.

    A "port" is one of a cell's plate edges that has an arm: (cell, inner edge). Every port has a
    top and a bottom.
    """

    def __init__(self, base: BaseMesh, lengths: np.ndarray, plates: Plates):
        self.base, self.plates = base, plates
        n_cells, n_edges = len(base.faces), len(base.cells)
        cell = base.cells.ravel()
        edge = np.repeat(np.arange(n_edges), 2)
        order = np.argsort(cell, kind="stable")
        self.cell, self.edge = cell[order], edge[order]
        outward = base.midpoints[self.edge] - base.centres[self.cell]
        self.outward = _flat(outward / np.linalg.norm(outward, axis=1, keepdims=True))
        self.along = np.cross(self.outward, _UP)
        self._number(n_cells, n_edges)
        self._place(lengths)

    def _number(self, n_cells: int, n_edges: int) -> None:
        """Joint numbers: centres (n_cells, 2), ports (n_ports, 2), crossings (n_edges,)."""
        ports = np.bincount(self.cell, minlength=n_cells)
        first = np.concatenate([[0], np.cumsum(2 * ports + 2)])
        self.centres = np.stack([first[:-1], first[:-1] + 1 + ports], axis=1)
        within = np.arange(len(self.cell)) - np.concatenate([[0], np.cumsum(ports)])[self.cell]
        self.ports = self.centres[self.cell] + 1 + within[:, None]
        self.crossings = first[-1] + np.arange(n_edges)

    def _place(self, lengths: np.ndarray) -> None:
        base, t, a = self.base, self.plates.thickness, self.plates.arm_position
        n = self.crossings[-1] + 1
        self.positions, self.frames = np.zeros((n, 3)), np.zeros((n, 3, 3))
        self.hinged = np.zeros(n, bool)
        for side, up in ((TOP, 1.0), (BOTTOM, -1.0)):
            centre, port, level = self.centres[:, side], self.ports[:, side], up * lengths[:, side]
            self.positions[centre] = _flat(base.centres) + np.outer(level + up * t / 2, _UP)
            self.frames[centre] = np.diag([1.0, up, up])
            self.positions[port] = (
                _flat(base.centres[self.cell])
                + (base.inradius - t / 2) * self.outward
                - up * a * self.along
                + np.outer(level[self.cell], _UP)
            )
            self.frames[port] = _axes(np.broadcast_to(-up * _UP, self.along.shape), up * self.along)
            self.hinged[port] = True
        # the X joint's axes are those of the edge as its unflipped cell sees it
        seen = self._seen_from_unflipped()
        self.positions[self.crossings] = _flat(base.midpoints) + t / 2 * self.outward[seen]
        self.frames[self.crossings] = _axes(np.broadcast_to(-_UP, (len(seen), 3)), self.along[seen])
        self.hinged[self.crossings] = True

    def size(self) -> float:
        """Bounding-box diagonal of all joints and of the ends that rods on plate edges without arms
        would have; the box lies along the first triangle's first edge, so that turning the mesh
        doesn't change it."""
        base, a = self.base, self.plates.arm_position
        corners = base.vertices[base.faces]
        middles = 0.5 * (corners + np.roll(corners, -1, axis=1))
        outward = (middles - base.centres[:, None]) / base.inradius
        shift = a * np.stack([outward[:, :, 1], -outward[:, :, 0]], axis=2)
        height = self.positions[self.centres, 2]
        points = [
            np.dstack([middles + sign * shift, np.repeat(height[:, [side]], 3, axis=1)]).reshape(
                -1, 3
            )
            for side, sign in ((TOP, -1), (BOTTOM, 1))
        ]
        along = base.vertices[base.faces[0, 1]] - base.vertices[base.faces[0, 0]]
        c, s = along / np.linalg.norm(along)
        turned = np.concatenate([self.positions, *points]) @ np.array(
            [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
        )
        return float(np.linalg.norm(np.ptp(turned, axis=0)))

    def _seen_from_unflipped(self) -> np.ndarray:
        """(n_edges,) the port of every edge in its unflipped cell."""
        unflipped = np.flatnonzero(self.base.cells[self.edge, 0] == self.cell)
        seen = np.empty(len(self.base.cells), int)
        seen[self.edge[unflipped]] = unflipped
        return seen

    def rods(self) -> UmbrellaRods:
        """Plate rods, then arms; ports by ports, top then bottom."""
        t, a = self.plates.thickness, self.plates.arm_position
        m = len(self.cell)
        unflipped = self.base.cells[self.edge, 0] == self.cell
        rods: list[tuple[np.ndarray, ...]] = []
        for side, up in ((TOP, 1.0), (BOTTOM, -1.0)):
            joints = np.stack([self.centres[self.cell, side], self.ports[:, side]], axis=1)
            offsets = np.zeros((m, 2, 3))
            offsets[:, 1] = up * t / 2 * _UP
            normals = np.broadcast_to(up * _UP, (m, 3))
            none = np.zeros((m, 2), bool)
            rods.append((joints, none, offsets, normals, self.cell, np.full(m, side), none[:, 0]))
        for side, up in ((TOP, 1.0), (BOTTOM, -1.0)):
            joints = np.stack([self.ports[:, side], self.crossings[self.edge]], axis=1)
            # an arm's lower end, in the edge's line; the X joint lies t/2 beyond it as the
            # unflipped cell sees it
            away = np.where(unflipped, -t / 2, t / 2)[:, None] * self.outward
            offsets = np.stack([t / 2 * self.outward, away - up * a * self.along], axis=1)
            # side B of an X joint: the unflipped cell's top arm and the flipped one's bottom arm
            behind = np.stack([np.ones(m, bool), unflipped == (side == TOP)], axis=1)
            rods.append(
                (
                    joints,
                    behind,
                    offsets,
                    self.outward,
                    self.cell,
                    np.full(m, side),
                    np.ones(m, bool),
                )
            )
        return UmbrellaRods(*(np.concatenate([r[k] for r in rods]) for k in range(7)))


def _flat(points: np.ndarray) -> np.ndarray:
    """Points (n, 2) in the plane z = 0."""
    return np.column_stack([points, np.zeros(len(points))])


def _axes(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Frames (n, 3, 3) of their first and third axes."""
    return np.stack([x, np.cross(z, x), z], axis=2)
