"""Derivatives of cross-sections in their own dimensions, and of rod stiffnesses in section and
material.

A rectangle has width and height, a circle its radius; a section given by its integrals has these.
What a joint leaves of a section changes with it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from .sections import TORSION_TERMS, Material, Section, circle, hole_of, rectangle

_ALIKE = 1e-9  # relative: integrals of one and the same section
_INTEGRALS = ("area", "inertia_y", "inertia_z", "torsion")


@dataclass(frozen=True)
class SectionSlope:
    """Derivatives of a section's numbers in one of its dimensions, named as those of `Section`."""

    area: float = 0.0
    inertia_y: float = 0.0
    inertia_z: float = 0.0
    torsion: float = 0.0
    torsion_modulus: float = 0.0
    outline: np.ndarray | float = 0.0
    centre: tuple[float, float] = (0.0, 0.0)
    cut: SectionSlope | None = None

    def of_stiffness(self, section: Section, material: Material) -> np.ndarray:
        """(6,) of the stiffness that `Section.stiffness` gives; shear factors stay."""
        E, G = material.young, material.shear_modulus
        return np.array(
            [
                E * self.area,
                section.shear_y * G * self.area,
                section.shear_z * G * self.area,
                G * self.torsion,
                E * self.inertia_y,
                E * self.inertia_z,
            ]
        )


def dimensions(section: Section) -> dict[str, float]:
    """What a section is given by, and how large that is: width and height, radius, or integrals."""
    width, height = (float(side) for side in np.ptp(section.outline, axis=0))
    if _same(section, rectangle(width, height)):
        return {"width": width, "height": height}
    radius = float(np.linalg.norm(section.outline[0]))
    if len(section.outline) > 4 and _same(section, circle(radius)):
        return {"radius": radius}
    return {name: float(getattr(section, name)) for name in _INTEGRALS}


def section_slopes(section: Section) -> Mapping[str, SectionSlope]:
    """The derivatives of a section in its `dimensions`, by their names.

    Of a section that is given by its integrals, outline and torsion modulus stay. Where a rectangle
    is a square, the torsion modulus has two one-sided derivatives; that of a thinner one is taken.
    """
    given = dimensions(section)
    if "radius" in given:
        r = given["radius"]
        quarter = np.pi * r**3
        return {
            "radius": SectionSlope(
                2 * np.pi * r, quarter, quarter, 2 * quarter, 1.0, section.outline / r
            )
        }
    if "width" not in given:
        return {
            "area": SectionSlope(area=1.0),
            "inertia_y": SectionSlope(inertia_y=1.0),
            "inertia_z": SectionSlope(inertia_z=1.0),
            "torsion": SectionSlope(torsion=1.0),
        }
    width, height = given["width"], given["height"]
    by_width, by_height = _rectangle(width, height)
    if section.cut is not None:
        cuts = _half_lapped if section.cut.centre != (0.0, 0.0) else _drilled
        cut_w, cut_h = cuts(section, width, height)
        by_width, by_height = replace(by_width, cut=cut_w), replace(by_height, cut=cut_h)
    return {"width": by_width, "height": by_height}


def stiffness_slopes(section: Section, material: Material) -> Mapping[str, np.ndarray]:
    """(6,) derivatives of a rod's stiffness in its material and its section: "young", "poisson",
    and the names of `dimensions`."""
    found = {
        "young": section.stiffness(material) / material.young,
        # of G = E / (2 (1 + nu)) alone
        "poisson": np.array([0, 1, 1, 1, 0, 0])
        * section.stiffness(material)
        / -(1 + material.poisson),
    }
    for name, slope in section_slopes(section).items():
        found[name] = slope.of_stiffness(section, material)
    return found


def _same(section: Section, other: Section) -> bool:
    return all(
        np.isclose(getattr(section, name), getattr(other, name), rtol=_ALIKE, atol=0)
        for name in _INTEGRALS
    )


def _rectangle(width: float, height: float) -> tuple[SectionSlope, SectionSlope]:
    """In width and in height; the torsion series of `rectangle`, differentiated term by term."""
    b, a = sorted((width, height))
    n = TORSION_TERMS
    x = n * np.pi * a / (2 * b)
    x_a, x_b = n * np.pi / (2 * b), -x / b
    tanh = np.tanh(x)
    sech = 2 * np.exp(-x) / (1 + np.exp(-2 * x))
    T, T_x = np.sum(tanh / n**5), sech**2 / n**5
    D, D_x = np.sum(sech / n**2), -sech * tanh / n**2
    factor = 64 / np.pi**5
    torsion = {
        "a": b**3 / 3 - factor * b**4 * np.sum(T_x * x_a),
        "b": a * b**2 - factor * (4 * b**3 * T + b**4 * np.sum(T_x * x_b)),
    }
    share = 8 / np.pi**2
    modulus = {
        "a": -share * b * np.sum(D_x * x_a),
        "b": 1 - share * D - share * b * np.sum(D_x * x_b),
    }
    of_width, of_height = ("b", "a") if width <= height else ("a", "b")
    signs = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) / 2
    return (
        SectionSlope(
            height,
            height**3 / 12,
            height * width**2 / 4,
            float(torsion[of_width]),
            float(modulus[of_width]),
            signs * [1, 0],
        ),
        SectionSlope(
            width,
            width * height**2 / 4,
            width**3 / 12,
            float(torsion[of_height]),
            float(modulus[of_height]),
            signs * [0, 1],
        ),
    )


def _half_lapped(
    section: Section, width: float, height: float
) -> tuple[SectionSlope, SectionSlope]:
    """Of what `half_lapped` leaves: the lower half."""
    by_width, by_half = _rectangle(width, height / 2)
    by_height = _times(0.5, by_half)
    return by_width, replace(
        by_height, outline=by_height.outline - np.array([0.0, 0.25]), centre=(0.0, -0.25)
    )


def _drilled(section: Section, width: float, height: float) -> tuple[SectionSlope, SectionSlope]:
    """Of what `drilled` leaves: two strips beside a hole, whose diameter stays."""
    diameter = hole_of(section) or 0.0
    whole = _rectangle(width, height)
    by_width, by_height = _rectangle((width - diameter) / 2, height)
    return (
        SectionSlope(
            2 * 0.5 * by_width.area,
            2 * 0.5 * by_width.inertia_y,
            height * width**2 / 4,
            2 * 0.5 * by_width.torsion,
            0.5 * by_width.torsion_modulus,
            whole[0].outline,
        ),
        SectionSlope(
            2 * by_height.area,
            2 * by_height.inertia_y,
            (width**3 - diameter**3) / 12,
            2 * by_height.torsion,
            by_height.torsion_modulus,
            whole[1].outline,
        ),
    )


def _times(factor: float, slope: SectionSlope) -> SectionSlope:
    return SectionSlope(
        factor * slope.area,
        factor * slope.inertia_y,
        factor * slope.inertia_z,
        factor * slope.torsion,
        factor * slope.torsion_modulus,
        factor * slope.outline,
    )
