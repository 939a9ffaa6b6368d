"""Turns a released umbrella mesh into a design file of our own, in mm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ...errors import InputError
from ..base import register_format
from .bodies import RODS
from .design import Umbrella, umbrella_from_dict
from .mesh import UmbrellaMesh
from .release import is_release, release_mesh

_TOLERANCE = 1e-5  # of the compact mesh's size
_DIGITS = 9


def import_release(
    data: Mapping[str, Any], name: str, source: str = "umbrella mesh", plate_model: str = RODS
) -> dict[str, Any]:
    """The content of a design file that describes the same umbrella mesh as a released file's
    content.

    The released file lists all joints and rods; a design file has the base mesh and the arm
    lengths, from which they follow. Raises InputError when they don't (as for meshes with further
    arms along the boundary).

    plate_model : "rods" as released, or "rigid"
    """
    released = release_mesh(data, source)
    for field in ("base_mesh_v", "arm_joint_offset"):
        if field not in data:
            raise InputError(
                "is missing in this released umbrella mesh, which can't be made a design file "
                "without it; simulate the released file itself",
                source=source,
                field=field,
            )
    unit = released.unit
    base = np.array(data["base_mesh_v"], float)[:, :2] * unit
    flips = data.get("flip_bits") or [False]
    own: dict[str, Any] = {
        "format": "kop_exudyn/design",
        "version": 1,
        "class": "umbrella",
        "name": name,
        "units": {"length": "mm", "force": "N"},
        "base": {
            "vertices": base.round(_DIGITS).tolist(),
            "faces": data["base_mesh_f"],
            "flipped": bool(flips[0]),
        },
        "lengths": (unit * released.lengths).round(_DIGITS).tolist(),
        "plates": {
            "arm_position": round(unit * float(data["arm_joint_offset"]), _DIGITS),
            "thickness": round(unit * released.thickness, _DIGITS),
            "width": round(unit * released.width, _DIGITS),
            "spacing": round(unit * released.spacing, _DIGITS),
        },
        "materials": {
            "arms": {"young": 1400.0, "poisson": 0.35},
            "plates": {"young": 14000.0, "poisson": 0.35},
        },
    }
    if plate_model != RODS:
        own["plate_model"] = plate_model
    order = _same_crossings(released, umbrella_from_dict(own, source).mesh, source)
    if released.target is not None:
        target = released.target
        own["target"] = {
            "vertices": (unit * target.vertices).round(6).tolist(),
            "faces": target.faces.tolist(),
        }
        for field, places in (("crossings", target.crossings[order]), ("plates", target.plates)):
            if np.isfinite(places).any():
                own["target"][field] = [
                    place.tolist() if np.isfinite(place).all() else None
                    for place in (unit * places).round(6)
                ]
    return own


def _same_crossings(released: UmbrellaMesh, own: UmbrellaMesh, source: str) -> np.ndarray:
    """For every X joint of our mesh its number among the released ones; InputError unless all arms
    agree."""
    theirs, mine = _arms(released) * released.unit, _arms(own)
    size = own.size
    distance, where = cKDTree(theirs).query(mine)
    if (
        len(theirs) != len(mine)
        or distance.max() > _TOLERANCE * size
        or len(set(where)) < len(theirs)
    ):
        raise InputError(
            "its arms aren't those of its base mesh; simulate the released file itself",
            source=source,
        )
    at = released.unit * released.positions[released.crossings]
    return cKDTree(at).query(own.positions[own.crossings])[1]


def _arms(mesh: UmbrellaMesh) -> np.ndarray:
    """One row (12,) an arm: its plate's joint, its ends from there to the X joint, the X joint."""
    arms = mesh.rods.arms
    first = np.isin(mesh.rods.joints[arms, 0], mesh.crossings).astype(int)
    rows = np.arange(len(first))
    ends, joints = mesh.rod_ends[arms], mesh.rods.joints[arms]
    return np.concatenate(
        [
            mesh.positions[joints[rows, first]],
            ends[rows, first],
            ends[rows, 1 - first],
            mesh.positions[joints[rows, 1 - first]],
        ],
        axis=1,
    )


register_format("released umbrella mesh", is_release, Umbrella.from_release, import_release)
