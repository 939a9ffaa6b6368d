"""The geometry of an umbrella mesh in its compact state: joints, plate rods and arms, and the shape
it is meant for.

A cell has a top and a bottom plate, each a star of three rods from its centre to the middles of its
edges. Where two cells share a base edge, four arms cross at one X joint: each runs from there to a
T joint on a plate edge. The joints' hinge axis is their frame's z axis; a joint has two sides, A
and B, that turn against each other about it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...errors import InputError

TOP, BOTTOM = 0, 1


@dataclass(frozen=True)
class UmbrellaTarget:
    """What the deployed mesh should look like.

    vertices (V, 3), faces (F, 3) : surface
    crossings (n_crossings, 3) : where the X joints belong; NaN where it is not known
    plates (n_cells, 3) : where the cells' midpoints belong; NaN where it is not known
    """

    vertices: np.ndarray
    faces: np.ndarray
    crossings: np.ndarray
    plates: np.ndarray


@dataclass(frozen=True)
class UmbrellaRods:
    """Plate rods and arms.

    joints (n, 2) : joints at both ends
    behind (n, 2) bool : whether an end belongs to its joint's side B
    offsets (n, 2, 3) : from the joint to the rod's end, in the compact state
    normals (n, 3) : unit direction of the section's thin side
    cells (n,), sides (n,) : cell and plate (TOP, BOTTOM) that each belongs to
    arms (n,) bool
    """

    joints: np.ndarray
    behind: np.ndarray
    offsets: np.ndarray
    normals: np.ndarray
    cells: np.ndarray
    sides: np.ndarray
    arms: np.ndarray


@dataclass(frozen=True)
class UmbrellaMesh:
    """An umbrella mesh as it is assembled, arms upright.

    positions (n_joints, 3), frames (n_joints, 3, 3) : joints, their axes as columns, z the hinge or
        plate normal
    hinged (n_joints,) bool : whether the joint turns
    rods : see `UmbrellaRods`
    centres (n_cells, 2) : joints in the middle of the top and the bottom plates
    crossings (n_crossings,) : the X joints
    lengths (n_cells, 2) : arm lengths, top and bottom
    thickness, width : of plate rods and arms
    plate_edge : length of a plate's edges
    spacing : distance h* of a cell's plates that the actuators aim at
    size : bounding-box diagonal of the compact mesh with all its plate edges, the unit of length of
        actuator weights
    target : or None
    unit : length of this mesh's unit in mm
    """

    positions: np.ndarray
    frames: np.ndarray
    hinged: np.ndarray
    rods: UmbrellaRods
    centres: np.ndarray
    crossings: np.ndarray
    lengths: np.ndarray
    thickness: float
    width: float
    plate_edge: float
    spacing: float
    size: float
    target: UmbrellaTarget | None
    unit: float = 1.0

    @property
    def n_cells(self) -> int:
        return len(self.centres)

    def scaled(self, factor: float) -> UmbrellaMesh:
        """The same mesh with all lengths multiplied by a factor, and its unit divided by it."""
        target, rods = self.target, self.rods
        if target is not None:
            target = UmbrellaTarget(
                factor * target.vertices,
                target.faces,
                factor * target.crossings,
                factor * target.plates,
            )
        lengths = ("positions", "lengths", "thickness", "width", "plate_edge", "spacing", "size")
        return replace(
            self,
            **{name: factor * getattr(self, name) for name in lengths},
            rods=replace(rods, offsets=factor * rods.offsets),
            target=target,
            unit=self.unit / factor,
        )

    @cached_property
    def joint_lifts(self) -> tuple[np.ndarray, np.ndarray]:
        """Parameter (n_joints,) (2 cell + side, -1: none) and sign (n_joints,) with which an arm
        length lifts a joint.

        A plate stands its arms' length above (below) the X joints, which lie in the base plane.
        """
        rods = self.rods
        parameter, sign = np.full(len(self.positions), -1), np.zeros(len(self.positions))
        plate = ~rods.arms
        for end in range(2):
            parameter[rods.joints[plate, end]] = 2 * rods.cells[plate] + rods.sides[plate]
            sign[rods.joints[plate, end]] = np.where(rods.sides[plate] == TOP, 1.0, -1.0)
        return parameter, sign

    def compact_positions(self, q: np.ndarray) -> np.ndarray:
        """Joint positions (n_joints, 3) of the assembled mesh with arm lengths q (2 n_cells,),
        unstressed."""
        parameter, sign = self.joint_lifts
        positions = self.positions.copy()
        positions[:, 2] += sign * np.where(
            parameter >= 0, (q - self.lengths.ravel())[parameter], 0.0
        )
        return positions

    @cached_property
    def rod_ends(self) -> np.ndarray:
        """End points (n_rods, 2, 3) of all rods in the compact state."""
        return self.positions[self.rods.joints] + self.rods.offsets

    @cached_property
    def central_crossing(self) -> int:
        """Place among the X joints of the one nearest to the mesh's middle."""
        middle = self.positions[self.crossings].mean(axis=0)
        return int(np.argmin(np.linalg.norm(self.positions[self.crossings] - middle, axis=1)))


def arm_lengths(
    joints: np.ndarray,
    offsets: np.ndarray,
    positions: np.ndarray,
    cells: np.ndarray,
    sides: np.ndarray,
    n_cells: int,
    tolerance: float,
    source: str,
) -> np.ndarray:
    """Arm lengths (n_cells, 2) from arms' end joints (n, 2) and offsets (n, 2, 3).

    Raises InputError unless every cell has arms on both sides, those of one side equally long (to
    the tolerance).
    """
    ends = positions[joints] + offsets
    measured = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    slot = 2 * cells + sides
    count = np.bincount(slot, minlength=2 * n_cells)
    if (count == 0).any():
        raise InputError(
            "a cell side has no arms", source=source, field=f"cell {int(np.argmin(count)) // 2}"
        )
    mean = np.bincount(slot, measured, minlength=2 * n_cells) / count
    error = np.abs(measured - mean[slot])
    if error.max() > tolerance:
        cell = int(cells[error.argmax()])
        raise InputError(
            "arms on one side of a cell differ in length",
            source=source,
            field=f"cell {cell}",
            value=float(measured[error.argmax()]),
        )
    return mean.reshape(n_cells, 2)
