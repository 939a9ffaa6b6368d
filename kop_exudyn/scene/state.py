"""The state of a scene: poses of all bodies and angles of all hinges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..rods.rotations import compose_increments, log_so3


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

    def increment_to(self, other: State) -> np.ndarray:
        """The increment (6 n_bodies + n_hinges,) that moves this state to the other one."""
        turn = log_so3(np.swapaxes(self.rotations, 1, 2) @ other.rotations)
        pose = np.concatenate([other.positions - self.positions, turn], axis=1)
        return np.concatenate([pose.ravel(), other.angles - self.angles])

    def transformed(self, rotation: np.ndarray, translation: np.ndarray) -> State:
        """The state after a rigid motion x -> rotation x + translation."""
        return State(
            self.positions @ rotation.T + translation, rotation @ self.rotations, self.angles
        )

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Plain arrays, for saving."""
        return {"positions": self.positions, "rotations": self.rotations, "angles": self.angles}
