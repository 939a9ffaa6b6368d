"""Derivatives of a number in the materials, sections and loads of a design, as they are told; and
whose rods they are of."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..arrays import Indices, Numbers
from ..errors import InputError
from ..rods.section_slopes import section_slopes
from ..rods.sections import Material, Section
from ..scene.scene import Scene
from ..structures.strength import by_section, made_of
from ..structures.stress_bound import Places


@dataclass(frozen=True)
class RodSlopes:
    """Derivatives of a number in the material and the section of some rods.

    section, material : of these rods; elements (k,) : which they are, of the scene's
    values, slopes : by name ("young", "poisson", "density" where it is known, and the section's
        "width" and "height", "radius", or its integrals) what it is, and the number's derivative;
        in the design's units
    """

    section: Section
    material: Material
    elements: Indices
    values: Mapping[str, float]
    slopes: Mapping[str, float]


@dataclass(frozen=True)
class Slopes:
    """A number of a design's state, and its derivatives.

    name, value : of the number, in the design's units
    rods : by section and material
    loads : by field of the load case ("gravity", "line", "area", "plan" (3,), "forces" (m, 3)),
        and "factor", (), of all of them; empty without loads
    """

    name: str
    value: float
    rods: tuple[RodSlopes, ...]
    loads: Mapping[str, Numbers] = field(default_factory=dict)

    def __repr__(self) -> str:
        names = list(dict.fromkeys(name for rods in self.rods for name in rods.slopes))
        return f"<Slopes of {self.name} {self.value:.4g} in {', '.join([*names, *self.loads])}>"

    def rows(self) -> list[dict[str, Any]]:
        """A row a parameter of the rods, and one for the factor of the loads: of what, its value,
        the derivative, and the change of the number in % for 1 % more of it."""
        found = []
        for number, rods in enumerate(self.rods, 1):
            for name, slope in rods.slopes.items():
                found.append(self._row(f"rods {number}", name, rods.values[name], slope))
        if "factor" in self.loads:
            found.append(self._row("loads", "factor", 1.0, float(self.loads["factor"])))
        return found

    def _row(self, of: str, name: str, value: float, slope: float) -> dict[str, Any]:
        share = slope * value / self.value if self.value else np.nan
        return {
            "of": of,
            "parameter": name,
            "value": value,
            f"d({self.name})": slope,
            "% for 1 %": share,
        }


def rods_of(scene: Scene, materials: Iterable[Material], source: str) -> list[RodSlopes]:
    """The rods of every section and material; those of pieces that don't bend have no elements.

    source : of the design, for the InputError where none of the materials explains a stiffness
    """
    materials, found, known = list(materials), [], np.zeros(len(scene.elements), bool)
    has_section = np.zeros(len(scene.elements), bool)
    rigid = {id(chain.section) for chain in scene.chains if not len(chain.elements)}
    stiffest = max(materials, key=lambda m: m.young, default=None)
    for section, elements in by_section(scene):
        has_section[elements] = True
        for material in materials:
            same = made_of(scene, elements, section, material)
            own = same[~known[same]]
            known[own] = True
            if len(own) or (id(section) in rigid and material is stiffest):
                found.append(RodSlopes(section, material, own, {}, {}))
    if not known[has_section].all():
        raise InputError(
            "rods whose stiffness none of the design's materials explains",
            source=source,
            field="material",
        )
    return found


def explicit_slopes(
    rods: Iterable[RodSlopes],
    places: Places,
    element: int,
    stress: np.ndarray,
    length: float,
    place: int,
) -> dict[int, dict[str, float]]:
    """By the number of the rods that a place of high stress belongs to, the derivatives in their
    section's dimensions for given generalised stresses."""
    for number, one in enumerate(rods):
        if element in one.elements:
            slopes = section_slopes(one.section)
            whole = places.section is one.section
            own = {name: by if whole else by.cut for name, by in slopes.items()}
            return {
                number: {
                    name: places.section_slope(stress, length, place, by)
                    for name, by in own.items()
                    if by is not None
                }
            }
    return {}
