"""Small umbrella meshes, an easy one and of the sorts that are hard to open: files as
`design_on_surface` makes them.

bowl : over a paraboloid
cap : over most of a sphere, with arms shorter than the plates
tight : plates that end on each other
equal : without a target, every cell free to open either way
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from kop_exudyn.structures.umbrella.generator import (
    design_on_surface,
    height_field,
    hexagon_patch,
    parametric_patch,
)
from kop_exudyn.structures.umbrella.layout import BaseMesh, Plates

PLATES = Plates()
EDGE = 30 + np.sqrt(3) * PLATES.thickness


# what files have to say besides their shape, for designs made by hand
HARDWARE = {
    "plates": {"arm_position": 10.0, "thickness": 3.0, "width": 5.0, "spacing": 15.0},
    "materials": {
        "arms": {"young": 1400.0, "poisson": 0.35},
        "plates": {"young": 14000.0, "poisson": 0.35},
    },
}


def hexagon(rings: int) -> BaseMesh:
    return BaseMesh(*hexagon_patch(rings, EDGE))


def make(sort: str, rings: int = 2) -> dict[str, Any]:
    """The content of a design file of one of the sorts."""
    if sort == "cap":
        surface = parametric_patch(_cap(300.0 * rings, 2.2), 40)
        return design_on_surface("cap", hexagon(rings), *surface, plates=PLATES, least_growth=3.2)
    if sort == "bowl":
        bowl = height_field(lambda x, y: -(x**2 + 0.6 * y**2) / 500, 600.0 * rings, 16)
        return design_on_surface("bowl", hexagon(rings), *bowl)
    flat = height_field(lambda x, y: 0 * x, 2400.0, 10)
    if sort == "tight":
        plates = replace(PLATES, spacing=PLATES.thickness)
        dome = height_field(lambda x, y: -(x**2 + y**2) / 700, 900.0, 30)
        return design_on_surface("tight", hexagon(rings), *dome, plates=plates)
    data = design_on_surface("equal", hexagon(rings), *flat, plates=PLATES)
    del data["target"]
    return data


def _cap(radius: float, reach: float):
    """A sphere around its pole, up to a polar angle `reach` at the middles of the square's sides:
    radius along rays."""

    def point(u, v):
        r = np.maximum(np.hypot(u, v), 1e-12)
        polar = 2 * reach * np.maximum(np.abs(u), np.abs(v))
        across = radius * np.sin(polar) / r
        return across * u, across * v, radius * np.cos(polar)

    return point
