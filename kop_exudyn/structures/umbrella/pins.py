"""Supports of an umbrella mesh: X joints pinned to places that are design variables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...errors import InputError, SimulationFailure
from ...geometry.extent import size_of_points
from ...rods.rotations import exp_so3
from ...scene.scene import Driven, Scene
from ...scene.state import State
from ..loads import hold_in_place
from .layout import BaseMesh
from .mesh import UmbrellaTarget

# How far a pin may go from its first place, as a share of the pins' size.
_REACH = 0.1
# Steps to place a mesh where it is held, how exactly, relative to its places, and rad a step.
_PLACING, _PLACED, _LARGEST_TURN = 50, 1e-14, 0.3


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
        return _REACH * size_of_points(self.positions)

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


@dataclass(frozen=True)
class Anchor:
    """What stops rigid motions of a mesh that nothing supports, and carries no force: one X joint
    is held in its place in the target, a second one in two coordinates, a third one in one.

    joints (6,), axes (6,) : X joints and their coordinates; values (6,) : where they are held
    """

    joints: np.ndarray
    axes: np.ndarray
    values: np.ndarray

    def scene(self, scene: Scene, bodies: np.ndarray) -> Scene:
        """A scene held so; bodies : (n_crossings,) those of the X joints."""
        pinned = np.zeros(scene.n_dofs, bool)
        pinned[6 * bodies[self.joints] + self.axes] = True
        positions = scene.initial.positions.copy()
        positions[bodies[self.joints], self.axes] = self.values
        return replace(scene, pinned=pinned, initial=replace(scene.initial, positions=positions))

    def placed(self, state: State, bodies: np.ndarray) -> State:
        """The state moved rigidly to where it is held.

        Newton's method for the motion; raises SimulationFailure where none fits, for a mesh whose
        joints are much closer to each other than in its target.
        """
        for _ in range(_PLACING):
            x = state.positions[bodies[self.joints]]
            gap = self.values - x[np.arange(6), self.axes]
            if np.abs(gap).max() <= _PLACED * np.abs(x).max():
                return state
            middle = x.mean(axis=0)
            motion = np.linalg.solve(_rigid_rows(x - middle, self.axes), gap)
            size = max(float(np.linalg.norm(motion[3:])), np.finfo(float).tiny)
            rotation = exp_so3(min(1.0, _LARGEST_TURN / size) * motion[3:])
            state = state.transformed(rotation, motion[:3] + middle - rotation @ middle)
        raise SimulationFailure("the mesh ends too far from its target to be held where that is")


def anchor_on(target: UmbrellaTarget, central: int) -> Anchor | None:
    """The anchor of a mesh on its target, or None where too few places are known.

    The second joint is far from the first one, and near to an axis through it; the third one, far
    from the line through both: so small changes of shape turn the mesh little.
    """
    x = target.crossings
    known = np.flatnonzero(np.isfinite(x).all(axis=1))
    if not hold_in_place(x[known]):
        return None
    first = central if central in known else int(known[0])
    arms = x[known] - x[first]
    along, off = arms**2, (arms**2).sum(axis=1)[:, None] - arms**2
    second, axis = np.unravel_index(np.argmax(along - off), along.shape)
    others = [k for k in range(3) if k != axis]
    best, score = None, 0.0
    for third, arm in zip(known, arms):
        for k in range(3):
            axes = np.array([0, 1, 2, *others, k])
            rows = _rigid_rows(np.stack([0 * arm] * 3 + [arms[second]] * 2 + [arm]), axes)
            lever = abs(np.linalg.det(rows)) / float(arms[second, axis] ** 2)
            if lever - 0.5 * abs(arm[k]) > score:
                best, score = (int(third), axes), lever - 0.5 * abs(arm[k])
    if best is None:
        return None
    joints = np.array([first] * 3 + [int(known[second])] * 2 + [best[0]])
    return Anchor(joints, best[1], x[joints, best[1]])


def _rigid_rows(arms: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """(6, 6) change of one coordinate of each point by translations and rotations."""
    rows = np.zeros((6, 6))
    rows[np.arange(6), axes] = 1.0
    rows[:, 3:] = np.cross(arms, np.eye(3)[axes])
    return rows


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
