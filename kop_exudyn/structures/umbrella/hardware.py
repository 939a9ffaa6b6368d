"""Where the pins of an umbrella mesh's arms and plates lie, measured in its compact state."""

from __future__ import annotations

import numpy as np

from ..hardware import Arm, CellHardware
from .mesh import TOP, UmbrellaMesh


def cell_hardware(mesh: UmbrellaMesh) -> CellHardware:
    """The arms' pins and the plates' hinges of a mesh.

    An arm's plate pin is its first joint, the crossing its second; both are measured from the
    rod's ends across its thin side. Plates are seen from outside: from above the top ones, from
    below the others.
    """
    rods = mesh.rods
    numbers = np.flatnonzero(rods.arms)
    ends = mesh.rod_ends[numbers]
    along = ends[:, 1] - ends[:, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    thin = rods.normals[numbers]
    thin = thin - np.sum(thin * along, axis=1, keepdims=True) * along
    thin /= np.linalg.norm(thin, axis=1, keepdims=True)
    across = -np.einsum("nej,nj->ne", rods.offsets[numbers], thin)
    arms = tuple(
        Arm(2 * int(rods.cells[k]) + int(rods.sides[k]), (float(plate), float(crossing)))
        for k, (plate, crossing) in zip(numbers, across)
    )
    return CellHardware(
        arms,
        2 * mesh.n_cells,
        len(mesh.crossings),
        mesh.plate_edge,
        mesh.thickness,
        mesh.width,
        _arm_position(mesh, numbers),
        _plate_corners(mesh, numbers),
        mesh.positions[mesh.crossings],
    )


def _arm_position(mesh: UmbrellaMesh, arms: np.ndarray) -> float:
    """How far arms stand from the middles of plate edges, counter-clockwise seen from outside."""
    rods = mesh.rods
    hinges = mesh.positions[rods.joints[arms, 0]]
    centres = mesh.positions[mesh.centres[rods.cells[arms], rods.sides[arms]]]
    outside = np.where(rods.sides[arms] == TOP, 1.0, -1.0)[:, None] * [0.0, 0.0, 1.0]
    counter = np.cross(outside, rods.normals[arms])
    return float(np.median(np.sum((hinges - centres) * counter, axis=1)))


def _plate_corners(mesh: UmbrellaMesh, arms: np.ndarray) -> np.ndarray:
    """(n_cells, 3, 2) corners of the plates in plan: between the directions of their edges."""
    rods = mesh.rods
    outward = np.zeros((mesh.n_cells, 2))
    outward[rods.cells[arms]] = rods.normals[arms, :2]
    turns = np.arctan2(outward[:, 1], outward[:, 0])[:, None] + np.pi * np.array([1, 3, 5]) / 3
    around = np.stack([np.cos(turns), np.sin(turns)], axis=2)
    middles = mesh.positions[mesh.centres[:, TOP], :2]
    return middles[:, None] + mesh.plate_edge / np.sqrt(3) * around
