"""Writes the designs of this folder: umbrella meshes over synclastic, anticlastic and mixed
surfaces (lengths in mm).

    python models/umbrellas/make.py [NAME ...]
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from kop_exudyn.files.json_files import write_json
from kop_exudyn.structures.umbrella.generator import (
    design_on_surface,
    height_field,
    hexagon_patch,
    parallelogram_patch,
    triangle_patch,
)
from kop_exudyn.structures.umbrella.layout import BaseMesh, Plates

PLATES = Plates()
EDGE = 30 + np.sqrt(3) * PLATES.thickness  # plates of 30 mm
DENSITY = 9e-10  # tonnes / mm^3, polypropylene: weights in newtons with gravity in mm / s^2
# N / mm^2: polypropylene yields at 30 to 40; plates ten times as stiff, of glass-fibre-filled nylon
LIMITS = (35.0, 140.0)
FOLDER = Path(__file__).resolve().parent


def hexagon(rings: int) -> BaseMesh:
    return BaseMesh(*hexagon_patch(rings, EDGE))


def parallelogram(m: int, n: int) -> BaseMesh:
    return BaseMesh(*parallelogram_patch(m, n, EDGE))


def triangle(n: int) -> BaseMesh:
    return BaseMesh(*triangle_patch(n, EDGE))


# name -> base mesh, height z(x, y), side of the square that the surface is given on
DESIGNS: dict[str, tuple[BaseMesh, Callable[[Any, Any], Any], float]] = {
    "dome": (hexagon(2), lambda x, y: -(x**2 + y**2) / 700, 900.0),
    "oval": (hexagon(3), lambda x, y: -(x**2) / 2000 - y**2 / 900, 1400.0),
    "saddle": (parallelogram(4, 4), lambda x, y: (x**2 - y**2) / 1000, 1400.0),
    "monkey": (hexagon(3), lambda x, y: (x**3 - 3 * x * y**2) / 1.2e6, 1400.0),
    "hill": (triangle(6), lambda x, y: 190 * np.exp(-(x**2 + y**2) / 240**2), 1400.0),
    "wave": (parallelogram(5, 5), lambda x, y: 60 * np.cos(x / 140) - y**2 / 1800, 1800.0),
}


def make(name: str) -> dict[str, Any]:
    """The content of one design file."""
    base, height, size = DESIGNS[name]
    vertices, faces = height_field(height, size, 30)
    return design_on_surface(
        name, base, vertices, faces, plates=PLATES, density=DENSITY, limits=LIMITS
    )


if __name__ == "__main__":
    for name in sys.argv[1:] or DESIGNS:
        write_json(FOLDER / f"{name}.json", make(name), overwrite=True)
