"""Writes umbrella meshes over synclastic, anticlastic and mixed surfaces (lengths in mm): the
designs of this folder, and larger ones, of 84 to 150 cells, in models/umbrellas_large.

    python models/umbrellas/make.py [NAME ...]

A rule gives the first lengths of the arms (`design_on_surface`). They are then fitted to the
surface, one design alone, with a little weight on the energy: a kit is to be judged by what it
takes from a design at its best.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kop_exudyn.files.json_files import write_json
from kop_exudyn.search.input_fit import fit_input
from kop_exudyn.search.weights import Weights
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.umbrella.generator import (
    LEAST_GROWTH,
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


def bumps(x: Any, y: Any) -> Any:
    """A hill beside a hollow."""
    hill = 90 * np.exp(-((x - 180) ** 2 + (y - 60) ** 2) / 270**2)
    return hill - 60 * np.exp(-((x + 220) ** 2 + (y + 120) ** 2) / 290**2)


def shoulder(x: Any, y: Any) -> Any:
    """A dome with a hill on its side."""
    return -(x**2) / 2200 - y**2 / 3000 + 50 * np.exp(-((x - 250) ** 2 + y**2) / 300**2)


def ridge(x: Any, y: Any) -> Any:
    """A step across a barrel vault."""
    return 120 * np.tanh(x / 220) - y**2 / 2200


@dataclass(frozen=True)
class Wanted:
    """base : mesh; height : z(x, y); size : side of the square that the surface is given on
    growth : of the cell that grows least; pinned : whether the corners are supported"""

    base: BaseMesh
    height: Callable[[Any, Any], Any]
    size: float
    growth: float = LEAST_GROWTH
    pinned: bool = False


DESIGNS = {
    "dome": Wanted(hexagon(2), lambda x, y: -(x**2 + y**2) / 700, 900.0),
    "oval": Wanted(hexagon(3), lambda x, y: -(x**2) / 2000 - y**2 / 1100, 1400.0),
    "saddle": Wanted(parallelogram(4, 4), lambda x, y: (x**2 - y**2) / 1350, 1400.0),
    "monkey": Wanted(hexagon(3), lambda x, y: (x**3 - 3 * x * y**2) / 2.0e6, 1400.0),
    "hill": Wanted(triangle(6), lambda x, y: 130 * np.exp(-(x**2 + y**2) / 265**2), 1400.0),
    "wave": Wanted(parallelogram(5, 5), lambda x, y: 60 * np.cos(x / 140) - y**2 / 1800, 1800.0),
}
LARGE = {
    "bumps": Wanted(hexagon(4), bumps, 2800.0, 4.6),
    "ridge": Wanted(parallelogram(7, 6), ridge, 3000.0, 4.4),
    "pinned_ridge": Wanted(parallelogram(7, 6), ridge, 3000.0, 4.4, pinned=True),
    "shell": Wanted(triangle(11), lambda x, y: -(x**2 + y**2) / 1800, 3000.0, 4.2),
    "shoulder": Wanted(hexagon(5), shoulder, 3600.0, 4.4),
}
FIT = Weights(fit=1e5, energy=0.02)
LONGEST = 64.0  # mm: cells with longer arms are slender, and their limits are soon reached


def make(name: str) -> dict[str, Any]:
    """The content of one design file."""
    wanted = {**DESIGNS, **LARGE}[name]
    vertices, faces = height_field(wanted.height, wanted.size, 40 if name in LARGE else 30)
    content = design_on_surface(
        name,
        wanted.base,
        vertices,
        faces,
        plates=PLATES,
        density=DENSITY,
        limits=LIMITS,
        least_growth=wanted.growth,
    )
    if wanted.pinned:
        content["pins"] = {"joints": "corners"}
    lengths = np.array(content["lengths"])
    fitted = fit_input(design_from_dict(content), FIT, upper=_upper(content, lengths.size)).q
    return content | {"lengths": fitted[: lengths.size].reshape(lengths.shape).round(4).tolist()}


def _upper(content: dict[str, Any], lengths: int) -> np.ndarray:
    """Bounds of the parameters: lengths, then pins' places, which are kept."""
    design = design_from_dict(content)
    return np.r_[np.full(lengths, LONGEST), design.parameters[lengths:]]


def main(names: list[str]) -> None:
    for name in names or [*DESIGNS, *LARGE]:
        folder = FOLDER.parent / "umbrellas_large" if name in LARGE else FOLDER
        folder.mkdir(exist_ok=True)
        write_json(folder / f"{name}.json", make(name), overwrite=True)


if __name__ == "__main__":
    main(sys.argv[1:])
