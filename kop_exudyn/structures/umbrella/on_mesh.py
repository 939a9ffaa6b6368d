"""Umbrella designs on surfaces from mesh files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError, did_you_mean
from ...geometry.mesh_files import read_mesh
from ...geometry.mesh_surface import is_disc
from ...geometry.triangles import TriangleSurface
from .bodies import RODS
from .generator import design_on_surface, hexagon_patch, parallelogram_patch, triangle_patch
from .layout import BaseMesh, Plates

# name -> what makes it, and how many numbers of cells that takes
PATCHES: dict[str, tuple[Callable[..., tuple[np.ndarray, np.ndarray]], int]] = {
    "hexagon": (hexagon_patch, 1),
    "parallelogram": (parallelogram_patch, 2),
    "triangle": (triangle_patch, 1),
}

_MOST_CELLS = 2000


def umbrella_on_mesh(
    name: str,
    path: Path,
    patch: tuple[str, Sequence[int]],
    *,
    scale: float = 1.0,
    plate_edge: float = 30.0,
    density: float | None = None,
    plate_model: str = RODS,
) -> dict[str, Any]:
    """The content of a design file: a patch of cells laid on the middle of a mesh file's surface
    (see `read_mesh`).

    patch : its shape, of PATCHES, and its numbers of cells along the edges: ("hexagon", [3]),
        ("parallelogram", [4, 5])
    scale : the design's unit, mm, in the mesh's
    plate_edge : mm;  density : tonnes / mm^3

    Raises InputError for meshes that aren't a disc or too small for the patch, and for patches that
    can't be.
    """
    shape, counts = patch
    if shape not in PATCHES:
        raise InputError(
            f"unknown shape ({did_you_mean(shape, PATCHES)}known: {', '.join(PATCHES)})",
            field="patch",
            value=shape,
        )
    make, wanted = PATCHES[shape]
    if len(counts) != wanted or min(counts) < 1 or 6 * max(counts) ** 2 > _MOST_CELLS:
        raise InputError(
            f"a {shape} needs {wanted} positive number{'s' * (wanted > 1)} of cells, "
            f"{_MOST_CELLS} in all at "
            "most",
            field="patch",
            value=list(counts),
        )
    vertices, faces = read_mesh(path, "surface")
    used, numbers = np.unique(faces, return_inverse=True)
    vertices, faces = scale * vertices[used], numbers.reshape(-1, 3)
    if not is_disc(TriangleSurface(vertices, faces)):
        raise InputError(
            "expected a mesh in one piece with exactly one border", field="surface", value=path.name
        )
    plates = Plates()
    base = BaseMesh(*make(*counts, plate_edge + np.sqrt(3) * plates.thickness))
    data = design_on_surface(name, base, vertices, faces, plates=plates, density=density)
    return data if plate_model == RODS else data | {"plate_model": plate_model}
