"""Designs laid out flat, as they are assembled, for their assembly drawings."""

from __future__ import annotations

import numpy as np
import shapely

from ..kit.kinds import has_joint, part_kind
from ..scene.state import State
from .assembly_drawing import AssemblyDrawing
from .options import millimetres
from .pieces import PartsList
from .placement import PlacedPieces


def assembly_drawing(parts: PartsList, name: str, unit: str) -> AssemblyDrawing:
    """The drawing of one design, as it is assembled.

    Lamellas are drawn in the state in which they are put together: the flat one, where the design
    has one, else the deployed one. Parts of other kinds are drawn where the design's geometry has
    them before anything is opened. Seen across its mean plane, from the side to which joint axes
    point; the longest extent lies across the paper.

    unit : the designs' unit of length
    Raises InputError for a design that isn't there.
    """
    scale, number = millimetres(unit), parts.row_of(name)
    pieces = parts.designs[number]
    design = pieces.design
    role = next((role.name for role in design.roles if not role.fitted), design.fitted_role.name)
    placed = PlacedPieces.of(pieces, role)
    flat = any(has_joint(part_kind(piece.kind)) for piece in pieces.pieces)
    state = parts.states[number][role] if parts.states and flat else placed.scene.initial
    if design.hardware is not None:  # a scene begins with what holds it where that is in the end
        positions = state.positions.copy()
        positions[design.joints] = design.hardware.joints
        state = State(positions, state.rotations, state.angles)
    return flattened(parts, placed, state, scale)


def flattened(
    parts: PartsList, placed: PlacedPieces, state: State, scale: float = 1.0
) -> AssemblyDrawing:
    """A state projected along the direction in which the joints extend least, as narrow as it can
    be.

    scale : millimetres of the design's unit of length
    """
    scene = placed.scene
    x, joints = scene.node_poses(state)[0], state.positions[placed.design.joints]
    centre = joints.mean(axis=0)
    right, _, normal = np.linalg.svd(joints - centre)[2]
    if normal @ state.rotations[placed.design.joints][:, :, 2].mean(axis=0) < 0:
        normal = -normal
    plane = np.stack([right, np.cross(normal, right)], axis=1)
    axes = scale * plane @ _turn_across((joints - centre) @ plane)
    flat = (x - centre) @ axes
    return AssemblyDrawing(
        parts,
        placed,
        [flat[chain.nodes] for chain in scene.chains],
        (joints - centre) @ axes,
        {p: (state.positions[c.body] - centre) @ axes for p, c in placed.corners.items()},
        _plates(placed, centre, axes),
    )


def _turn_across(points: np.ndarray) -> np.ndarray:
    """(2, 2) turn after which points (n, 2) @ it take the smallest rectangle, its long side lying
    across."""
    around = shapely.minimum_rotated_rectangle(shapely.MultiPoint(points))
    if around.geom_type != "Polygon":
        return np.eye(2)
    corners = np.array(around.exterior.coords)
    sides = np.diff(corners[:3], axis=0)
    x, y = sides[np.argmax(np.linalg.norm(sides, axis=1))]
    length = np.hypot(x, y) * (1 if x >= 0 else -1)
    return np.array([[x, -y], [y, x]]) / length


def _plates(placed: PlacedPieces, centre: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """(n_cells, 3, 2) plates of a design of cells; none of others."""
    hardware = placed.design.hardware
    if hardware is None:
        return np.zeros((0, 3, 2))
    corners = np.dstack([hardware.corners, np.full(hardware.corners.shape[:2], centre[2])])
    return (corners - centre) @ axes
