"""Numbers that look as if they were in other units than the rest of a design."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..rods.sections import Material
from ..units import Units, plain_number
from .base import Design
from .strength import materials_of

_THICK, _THIN = 0.5, 2e-4  # section over span, beyond which rods are no rods
_YOUNG = (1e5, 2e12)  # Pa: from foam to carbon fibre
_DENSITY = (1.0, 3e4)  # kg / m^3
_STRETCHY = 10.0  # elastic limit over modulus: no material stretches that far


def section_doubt(sides: Sequence[float], spans: np.ndarray, units: Units | None) -> str | None:
    """A sentence where a section is much too thick, or too thin, beside the spans; else None.

    sides : width and height of the section
    spans (n,) : lengths between joints
    """
    median, unit = float(np.median(spans)), "" if units is None else f" {units.length}"
    largest = max(sides)
    if _THIN * median <= largest <= _THICK * median:
        return None
    size = " x ".join(f"{side:.3g}" for side in sides)
    how = "thick" if largest > median * _THICK else "very thin"
    return (
        f"the section of {size}{unit} is {how} beside spans of {median:.3g}{unit}: is it in the "
        "net's unit?"
    )


def material_doubts(materials: Sequence[Material], units: Units | None) -> list[str]:
    """Sentences about moduli and densities that no material has in these units."""
    found: list[str] = []
    if units is None:
        return found
    for material in materials:
        modulus = units.stress_si(material.young)
        if not _YOUNG[0] <= modulus <= _YOUNG[1]:
            found.append(
                f"a Young's modulus of {material.young:g} is {modulus:.3g} Pa in {units}: is it "
                f"in these units?{_meant(material.young, _YOUNG, 'Pa', units.stress_si(1.0))}"
            )
        limit = material.elastic_limit
        if limit is not None and limit > _STRETCHY * material.young:
            found.append(
                f"an elastic limit of {limit:g} is {plain_number(limit / material.young, 3)} times "
                f"Young's modulus of {material.young:g}: are both in {units}?"
            )
        if material.density is not None:
            density = units.density_si(material.density)
            if not _DENSITY[0] <= density <= _DENSITY[1]:
                found.append(
                    f"a density of {material.density:g} is {density:.3g} kg/m³ in {units}: is it "
                    "in these units?"
                    f"{_meant(material.density, _DENSITY, 'kg/m³', units.density_si(1.0))}"
                )
    return found


def _meant(value: float, likely: tuple[float, float], unit: str, si: float) -> str:
    """What a number would be if it was given in SI units, where it is a likely one in these.

    si : of one unit of the design
    """
    if not likely[0] <= value <= likely[1]:
        return ""
    return f" {value:g} {unit} would be {value / si:g}"


def design_doubts(design: Design) -> list[str]:
    """All of these about a design: its sections beside its rods' pieces, its materials, and what
    its class has doubts about."""
    scene = design.scene(design.fitted_role.name)
    x = scene.node_poses(scene.initial)[0]
    found = []
    sections = {id(chain.section): chain.section for chain in scene.chains if chain.section}
    for section in sections.values():
        lengths = [
            np.linalg.norm(np.diff(x[chain.nodes], axis=0), axis=1).sum()
            for chain in scene.chains
            if chain.section is section
        ]
        sides = np.ptp(section.outline, axis=0)
        # a span is two pieces
        doubt = section_doubt(sides.tolist(), 2 * np.array(lengths), design.units)
        found += [doubt] if doubt else []
    return design.doubts + found + material_doubts(materials_of(design), design.units)
