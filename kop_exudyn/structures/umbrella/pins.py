"""Supports of an umbrella mesh: X joints pinned to places that are design variables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...errors import InputError
from ...scene.scene import Driven, Scene
from ...scene.state import State
from ..loads import hold_in_place
from .layout import BaseMesh
from .mesh import UmbrellaTarget

# How far a pin may go from its first place, as a share of the pins' bounding-box diagonal.
_REACH = 0.1


@dataclass(frozen=True)
class Pins:
    """joints (m,) : numbers of X joints; positions (m, 3) : where the input design has them.

    Raises InputError unless there are three pins or more, all different and not on one line.
    """

    joints: np.ndarray
    positions: np.ndarray

    def __post_init__(self) -> None:
        joints, positions = self.joints, self.positions
        if len(set(joints.tolist())) < max(len(joints), 3):
            raise InputError(
                "expected three different X joints or more",
                field="pins.joints",
                value=joints.tolist(),
            )
        if positions.shape != (len(joints), 3) or not np.isfinite(positions).all():
            raise InputError(f"expected {len(joints)} finite points", field="pins.positions")
        if not hold_in_place(positions):
            raise InputError("pins on one line don't hold a structure", field="pins.positions")

    @property
    def reach(self) -> float:
        """How far each coordinate of a pin may go from its first place."""
        return _REACH * float(np.linalg.norm(np.ptp(self.positions, axis=0)))

    def scene(self, scene: Scene, bodies: np.ndarray, first: int) -> Scene:
        """A scene with pinned bodies (m,) whose coordinates are the parameters from number `first`
        on."""
        dofs = (6 * bodies[:, None] + np.arange(3)).ravel()
        n = len(dofs)
        return replace(scene, driven=Driven(dofs, np.zeros(n), first + np.arange(n), np.ones(n)))

    @staticmethod
    def aligned(state: State, bodies: np.ndarray, positions: np.ndarray) -> State:
        """The state moved rigidly so that the bodies (m,) come as near to positions (m, 3) as they
        can."""
        from scipy.spatial.transform import Rotation

        x = state.positions[bodies]
        turn, _ = Rotation.align_vectors(positions - positions.mean(axis=0), x - x.mean(axis=0))
        rotation = turn.as_matrix()
        return state.transformed(rotation, positions.mean(axis=0) - rotation @ x.mean(axis=0))


def pins_from_dict(data: Mapping[str, Any], base: BaseMesh, target: UmbrellaTarget | None) -> Pins:
    """The pins of a design file: {"joints": "corners" or numbers of X joints, "positions": default:
    the target's}.

    "corners": one X joint at each convex corner of the base mesh. Raises InputError.
    """
    joints = corner_joints(base) if data["joints"] == "corners" else np.array(data["joints"], int)
    n = len(base.inner)
    if joints.size and not (joints.min() >= 0 and joints.max() < n):
        raise InputError(
            f"names an X joint that doesn't exist (there are {n})",
            field="pins.joints",
            value=int(joints.max()),
        )
    if "positions" in data:
        return Pins(joints, np.array(data["positions"], float))
    if target is None:
        raise InputError("without a target, pins need positions", field="pins.positions")
    places = target.crossings[joints]
    if not np.isfinite(places).all():
        raise InputError(
            "the target doesn't say where these joints belong: give their positions",
            field="pins.positions",
        )
    return Pins(joints, places)


def corner_joints(base: BaseMesh) -> np.ndarray:
    """Inner edges (m,), increasing, at the base mesh's convex corners, where one cell or two meet.

    Of a single cell it is the edge opposite to the corner, of two the one between them.
    """
    cells = np.bincount(base.faces.ravel(), minlength=len(base.vertices))
    found = set(np.flatnonzero((cells[base.inner] == 2).any(axis=1)).tolist())
    for face in np.flatnonzero((cells[base.faces] == 1).any(axis=1)):
        found |= set(np.flatnonzero((base.cells == face).any(axis=1)).tolist())
    return np.array(sorted(found), int)
