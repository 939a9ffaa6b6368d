"""The state of a scene: poses of all bodies and angles of all hinges."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..files.arrays import numbers_of
from ..rods.rotations import compose_increments

_ORTHOGONAL = 1e-6


@dataclass(frozen=True)
class State:
    """Where everything is.

    positions : (n_bodies, 3) global
    rotations : (n_bodies, 3, 3) body axes as columns
    angles : (n_hinges,) rad
    """

    positions: np.ndarray
    rotations: np.ndarray
    angles: np.ndarray

    def moved(self, increment: np.ndarray) -> State:
        """The state after an increment (6 n_bodies + n_hinges,): (dx, w) a body, then hinge
        angles."""
        n = len(self.positions)
        pose = increment[: 6 * n].reshape(n, 6)
        rotations = compose_increments(self.rotations, pose[:, 3:])
        return State(self.positions + pose[:, :3], rotations, self.angles + increment[6 * n :])

    def transformed(self, rotation: np.ndarray, translation: np.ndarray) -> State:
        """The state after a rigid motion x -> rotation x + translation."""
        return State(
            self.positions @ rotation.T + translation, rotation @ self.rotations, self.angles
        )

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], n_bodies: int, n_hinges: int) -> State:
        """The state that `to_arrays` gave, of a scene of so many bodies and hinges.

        Raises InputError, naming the array, where one is missing, is of another kind or shape,
        holds numbers that aren't finite, or matrices that aren't rotations.
        """
        shapes = {"positions": (n_bodies, 3), "rotations": (n_bodies, 3, 3), "angles": (n_hinges,)}
        state = cls(*(numbers_of(arrays, name, shape) for name, shape in shapes.items()))
        R = state.rotations
        small = np.abs(R).max(initial=0.0) < 2  # whose squares don't overflow
        off = np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max(initial=0.0) if small else np.inf
        if not (off < _ORTHOGONAL and (np.linalg.det(R) > 0).all()):
            raise InputError("holds matrices that are no rotations", field="rotations")
        return state

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Plain arrays, for saving."""
        return {"positions": self.positions, "rotations": self.rotations, "angles": self.angles}
