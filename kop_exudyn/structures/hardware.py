"""What a structure class says of parts that are no plain beams: arms between pins, and plates.

Workshops need more than a length: where the axes of the joints lie. A class whose parts are cells
of arms and plates has a `CellHardware`; what is cut of it is the workshop's business.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Arm:
    """A rod between two pins whose axes lie across it, beside its own axis.

    parameter : its length's place in q, from pin to pin along the rod
    offsets : of the pins' axes at its plate and at its crossing, from the rod's axis along the thin
        side of its section
    """

    parameter: int
    offsets: tuple[float, float]

    @property
    def opposite(self) -> bool:
        """Whether the pins lie on opposite faces of the arm."""
        return self.offsets[0] * self.offsets[1] < 0

    @property
    def sort(self) -> str:
        """What workshops call it: "a" with both pins on one face, "b" with pins on opposite
        ones."""
        return "b" if self.opposite else "a"


@dataclass(frozen=True)
class CellHardware:
    """Cells of two equal triangular plates and of arms hinged to their edges.

    arms : all arms of the design
    plates : number of plates
    crossings : number of joints at which two pairs of arms cross
    edge : of a plate
    thickness : of plates and arms; width : of arms, along the pins
    arm_position : from the middle of a plate's edge to the arm, counter-clockwise seen from outside
    corners (n_cells, 3, 2) : of every cell's plates in plan, before anything is opened, in the
        order of the design's elements
    joints (n_joints, 3) : where the design's joints are then
    """

    arms: tuple[Arm, ...]
    plates: int
    crossings: int
    edge: float
    thickness: float
    width: float
    arm_position: float
    corners: np.ndarray
    joints: np.ndarray
