"""Which bodies an umbrella mesh's joints are, or lie on: a body a joint, or, with rigid plates, a
body a plate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...scene.state import State
from .mesh import UmbrellaMesh

RODS, RIGID = "rods", "rigid"
PLATE_MODELS = (RODS, RIGID)


@dataclass(frozen=True)
class JointBodies:
    """Bodies of a scene, its first ones, and where on them the joints are.

    origins (n_bodies,) : the joint at which each body lies, and whose axes it has
    body (n_joints,) : the body that each joint belongs to
    offsets (n_joints, 3), turns (n_joints, 3, 3) : joints and their axes, in axes of their bodies
    """

    origins: np.ndarray
    body: np.ndarray
    offsets: np.ndarray
    turns: np.ndarray

    def positions(self, state: State) -> np.ndarray:
        """Positions (n_joints, 3) of all joints."""
        return state.positions[self.body] + np.einsum(
            "nij,nj->ni", state.rotations[self.body], self.offsets
        )


def joint_bodies(mesh: UmbrellaMesh, plates: str = RODS) -> JointBodies:
    """The bodies of a mesh.

    plates : "rods", every joint is a body, plates are rods between them; "rigid", plates are bodies
        of six unknowns, numbered 2 cell + side, that carry the hinges of their edges; X joints come
        after them

    Raises InputError for another word, or when rigid plates don't lie on side A of their joints.
    """
    n = len(mesh.positions)
    if plates == RODS:
        origins = body = np.arange(n)
    elif plates == RIGID:
        plate = mesh.joint_lifts[0]
        others = np.flatnonzero(plate < 0)
        if (mesh.rods.behind & ~mesh.rods.arms[:, None]).any():
            raise InputError(
                "rigid plates must lie on side A of their joints", field="plate_model", value=plates
            )
        origins = np.concatenate([mesh.centres.ravel(), others])
        body = plate.copy()
        body[others] = mesh.centres.size + np.arange(len(others))
    else:
        raise InputError(
            f"unknown (known: {', '.join(PLATE_MODELS)})", field="plate_model", value=plates
        )
    to_body = np.swapaxes(mesh.frames[origins[body]], 1, 2)
    offsets = np.einsum("nij,nj->ni", to_body, mesh.positions - mesh.positions[origins[body]])
    return JointBodies(origins, body, offsets, to_body @ mesh.frames)
