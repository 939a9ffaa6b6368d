"""A target surface from a mesh file, for designs that don't lie on it to begin with."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..geometry.extent import size_of_points
from ..geometry.triangles import TriangleSurface
from .base import Target

_MAX_ITERATIONS = 200
_SQUARE = 1e-6
_SMALLEST, _LARGEST = 0.1, 20.0  # of a design's size: of its target
_SETTLED = 1e-6  # of the joints' size, by which an iteration moves them


def load_target_mesh(data: Mapping[str, Any], folder: Path) -> TriangleSurface:
    """The mesh that a design file's field "target" names, in the design's units and axes.

    data : "file", relative to the folder; "scale", "origin" (3,) and "axes" (3, 3) bring its points
        x to scale axes (x - origin)

    Raises InputError, naming the field "target.file", where it contains no usable mesh.
    """
    from ..geometry.mesh_files import read_mesh

    path = folder / data["file"]
    vertices, faces = read_mesh(path, "target.file")
    axes = np.array(data.get("axes", np.eye(3)), float)
    if axes.shape != (3, 3) or np.abs(axes @ axes.T - np.eye(3)).max() > _SQUARE:
        raise InputError("expected three unit vectors at right angles", field="target.axes")
    origin = np.array(data.get("origin", (0.0, 0.0, 0.0)), float)
    vertices = float(data.get("scale", 1.0)) * (vertices - origin) @ axes.T
    try:
        return TriangleSurface(vertices, faces)
    except InputError as error:
        raise InputError(
            f"{error.message} ({error.field})", field="target.file", value=path.name
        ) from None


def check_target_size(surface: TriangleSurface, size: float, file: str) -> None:
    """Raise InputError for a target that is much too small for a design of that size: the joints
    would all be laid onto nearly one place."""
    own = size_of_points(surface.vertices)
    if own < _SMALLEST * size:
        raise InputError(
            f"is {own:.3g} in size, the design {size:.3g}: are both in the same unit? The field "
            "target.scale (kop import: --scale) multiplies the target's coordinates",
            field="target.file",
            value=file,
        )


def target_doubts(surface: TriangleSurface, joints: np.ndarray) -> list[str]:
    """What looks as if a target were in another unit, or elsewhere, than the joints (n, 3) that are
    to be laid onto it, in words."""
    size, own = size_of_points(joints), size_of_points(surface.vertices)
    if own > _LARGEST * size:
        return [
            f"the target is {own / size:.3g} times as large as the design, of which {size:.3g} is "
            "the size: is it in the same unit? The field target.scale multiplies its coordinates"
        ]
    away = float(np.linalg.norm(surface.closest(joints).points - joints, axis=1).min())
    if away > size:
        return [
            f"the target lies {away:.3g} away, {away / size:.3g} times the design's size: joints "
            "are drawn to its nearest parts. Move one to the other (the field target.origin)"
        ]
    return []


def target_on_mesh(surface: TriangleSurface, joints: np.ndarray) -> Target:
    """A mesh as target, and for each joint (n, 3) a place on it.

    The joints are laid onto the mesh from where they are, by turns of closest points and best rigid
    motions (Besl and McKay, IEEE PAMI 14, 1992). So the mesh has to lie and face about as the
    joints do; the target fitting of every later state looks for the best placement by itself.
    """
    from scipy.spatial.transform import Rotation

    size, laid = size_of_points(joints), joints
    for _ in range(_MAX_ITERATIONS):
        goal, before = surface.closest(laid).points, laid
        turn = Rotation.align_vectors(goal - goal.mean(axis=0), joints - joints.mean(axis=0))[0]
        laid = turn.apply(joints - joints.mean(axis=0)) + goal.mean(axis=0)
        if np.abs(laid - before).max() <= _SETTLED * size:
            break
    positions = surface.closest(laid).points
    return Target(surface.vertices, surface.faces, positions, size_of_points(positions))
