"""Materials and cross-sections: the six stiffnesses of a rod, and the points where stress is read.

Local axes of a rod: x along the rod, y and z the section's principal axes. A rectangle's width lies
along y, its height along z.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..checks import LARGEST, check_positive
from ..errors import InputError

# Odd terms of the torsion series; the remainder of n terms falls with n^-5, so this many reach
# round-off.
TORSION_TERMS = np.arange(1, 400, 2)


@dataclass(frozen=True)
class Material:
    """Linear elastic, isotropic.

    young : Young's modulus, force / length^2
    poisson : Poisson's ratio, in (-1, 0.5]
    density : mass / length^3, or None when no weight is asked for
    elastic_limit : largest allowed equivalent stress, force / length^2, or None
    """

    young: float
    poisson: float
    density: float | None = None
    elastic_limit: float | None = None

    def __post_init__(self) -> None:
        check_positive("material.young", self.young, below=LARGEST)
        if not -1 < self.poisson <= 0.5:
            raise InputError(
                "Poisson's ratio must lie in (-1, 0.5]",
                field="material.poisson",
                value=self.poisson,
            )
        for name in ("density", "elastic_limit"):
            if getattr(self, name) is not None:
                check_positive(f"material.{name}", getattr(self, name), below=LARGEST)

    @property
    def shear_modulus(self) -> float:
        return self.young / (2 * (1 + self.poisson))


@dataclass(frozen=True)
class Section:
    """A cross-section, by its integrals.

    area : length^2
    inertia_y, inertia_z : second moments about y and z, length^4
    torsion : torsion constant J, length^4
    shear_y, shear_z : shear correction factors
    outline : (k, 2) corners (y, z) of the section, counter-clockwise: drawn, and used as stress
        points
    torsion_modulus : J / W_t, so that the largest shear stress is torque * this / J; length
    centre : (y, z) of the centroid; not the origin where a part of the section is cut away
    cut : what a joint leaves of the section, in the same axes; None where it takes nothing. It
        carries stress, but does not make the rod softer: joints are short.
    """

    area: float
    inertia_y: float
    inertia_z: float
    torsion: float
    shear_y: float
    shear_z: float
    outline: np.ndarray
    torsion_modulus: float
    centre: tuple[float, float] = (0.0, 0.0)
    cut: Section | None = None

    def stiffness(self, material: Material) -> np.ndarray:
        """(EA, k_y GA, k_z GA, GJ, EI_y, EI_z): stiffness (6,) against stretch, shears, twist and
        bendings."""
        E, G = material.young, material.shear_modulus
        return np.array(
            [
                E * self.area,
                self.shear_y * G * self.area,
                self.shear_z * G * self.area,
                G * self.torsion,
                E * self.inertia_y,
                E * self.inertia_z,
            ]
        )


def rectangle(width: float, height: float) -> Section:
    """Solid rectangle, width along y, height along z.

    Torsion constant by Saint-Venant's series (Timoshenko and Goodier, Theory of Elasticity, art.
    109), with the shorter side b and the longer a:  J = a b^3 / 3 (1 - 192 b / (pi^5 a) sum_odd
    tanh(n pi a / 2 b) / n^5).
    """
    check_positive("section.width", width, below=LARGEST)
    check_positive("section.height", height, below=LARGEST)
    b, a = sorted((width, height))
    n = TORSION_TERMS
    ratio = n * np.pi * a / (2 * b)
    torsion = a * b**3 / 3 * (1 - 192 * b / (np.pi**5 * a) * np.sum(np.tanh(ratio) / n**5))
    # largest shear stress, at the middle of the longer side: tau = G theta b (1 - 8/pi^2 sum 1/(n^2
    # cosh))
    decay = np.sum(np.exp(-ratio) * 2 / (1 + np.exp(-2 * ratio)) / n**2)
    y, z = width / 2, height / 2
    return Section(
        area=width * height,
        inertia_y=width * height**3 / 12,
        inertia_z=height * width**3 / 12,
        torsion=torsion,
        shear_y=5 / 6,
        shear_z=5 / 6,
        outline=np.array([[y, z], [-y, z], [-y, -z], [y, -z]]),
        torsion_modulus=b * (1 - 8 / np.pi**2 * decay),
    )


def half_lapped(section: Section) -> Section:
    """A rectangle with a slot at its joints that takes the half above the y axis, for a crossing
    rod."""
    width, height = (float(side) for side in np.ptp(section.outline, axis=0))
    half = rectangle(width, height / 2)
    left = replace(half, outline=half.outline - [0.0, height / 4], centre=(0.0, -height / 4))
    return replace(section, cut=left)


def drilled(section: Section, diameter: float) -> Section:
    """A rectangle with a hole along z through its joints. Raises InputError for a hole as wide as
    the section."""
    check_positive("section.joint_hole", diameter, below=LARGEST)
    width, height = (float(side) for side in np.ptp(section.outline, axis=0))
    if diameter >= width:
        raise InputError(
            "must be smaller than the width", field="section.joint_hole", value=diameter
        )
    strip = rectangle((width - diameter) / 2, height)  # one of the two that are left
    left = replace(
        section,
        area=2 * strip.area,
        inertia_y=2 * strip.inertia_y,
        inertia_z=height * (width**3 - diameter**3) / 12,
        torsion=2 * strip.torsion,
        torsion_modulus=strip.torsion_modulus,
    )
    return replace(section, cut=left)


def thickness_of(section: Section) -> float:
    """The smaller one of a section's two extents, length: that of the board it is cut from."""
    return float(np.ptp(section.outline, axis=0).min())


def hole_of(section: Section) -> float | None:
    """Diameter of the hole at a rectangle's joints, None where there is none."""
    if section.cut is None or section.cut.centre != (0.0, 0.0):
        return None
    width, height = np.ptp(section.outline, axis=0)
    return float(width - section.cut.area / height)


def thickened(section: Section, share: float) -> Section:
    """The section cut from a board `share` times as thick: a rectangle's smaller side grows, its
    joints are cut as before; what is as broad as thick grows in both directions.

    Torsion of other sections than rectangles is taken to grow as that of thin strips.
    Raises InputError for a share that is not positive.
    """
    check_positive("share", share, below=LARGEST)
    extents = np.ptp(section.outline, axis=0)
    if np.isclose(*extents):
        scales = np.array([share, share])
    else:
        scales = np.where(extents == extents.min(), share, 1.0)
    y, z = (float(scale) for scale in scales)
    if len(section.outline) == 4 and np.isclose(section.area, extents.prod()):
        whole = rectangle(*(float(side) for side in extents * scales))
        if section.cut is None:
            return whole
        if section.cut.centre != (0.0, 0.0):
            return half_lapped(whole)
        return drilled(whole, hole_of(section) or 0.0)
    return replace(
        section,
        area=section.area * y * z,
        inertia_y=section.inertia_y * y * z**3,
        inertia_z=section.inertia_z * z * y**3,
        torsion=section.torsion * (share**4 if y == z else share**3),
        outline=section.outline * scales,
        torsion_modulus=section.torsion_modulus * share,
        cut=None if section.cut is None else thickened(section.cut, share),
    )


def circle(radius: float) -> Section:
    """Solid circle. Shear factor 9/10, the classical energy value of a circle."""
    check_positive("section.radius", radius, below=LARGEST)
    turns = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    quarter = np.pi * radius**4 / 4
    return Section(
        area=np.pi * radius**2,
        inertia_y=quarter,
        inertia_z=quarter,
        torsion=2 * quarter,
        shear_y=0.9,
        shear_z=0.9,
        outline=radius * np.stack([np.cos(turns), np.sin(turns)], axis=1),
        torsion_modulus=radius,
    )


def general(
    area: float,
    inertia_y: float,
    inertia_z: float,
    torsion: float,
    shear_y: float = 5 / 6,
    shear_z: float = 5 / 6,
    outline: Any = None,
    torsion_modulus: float | None = None,
) -> Section:
    """A section given by its integrals. Without an outline it is drawn as the rectangle of the same
    inertia."""
    for name, value in (
        ("area", area),
        ("inertia_y", inertia_y),
        ("inertia_z", inertia_z),
        ("torsion", torsion),
        ("shear_y", shear_y),
        ("shear_z", shear_z),
    ):
        check_positive(f"section.{name}", value, below=LARGEST)
    if outline is None:
        y, z = np.sqrt(3 * inertia_z / area), np.sqrt(3 * inertia_y / area)
        outline = np.array([[y, z], [-y, z], [-y, -z], [y, -z]])
    try:
        outline = np.asarray(outline, float)
    except (TypeError, ValueError):
        outline = np.empty(0)
    if (
        outline.ndim != 2
        or outline.shape[1] != 2
        or len(outline) < 3
        or not np.isfinite(outline).all()
    ):
        raise InputError(
            "an outline needs at least three finite points (y, z)",
            field="section.outline",
            value=outline,
        )
    if torsion_modulus is not None:
        check_positive("section.torsion_modulus", torsion_modulus, below=LARGEST)
    else:
        torsion_modulus = float(np.min(np.ptp(outline, axis=0)))  # as of a thin strip
    return Section(area, inertia_y, inertia_z, torsion, shear_y, shear_z, outline, torsion_modulus)


def section_from_dict(data: Mapping[str, Any], *, half_lap: bool = False) -> Section:
    """The section that a design file describes: {"type": "rectangle" | "circle" | "general",
    ...}.

    half_lap : whether rectangles that say nothing of their joints ("half_lap", "joint_hole") are
        slotted there to half their height
    """
    makers: dict[str, Callable[..., Section]] = {
        "rectangle": rectangle,
        "circle": circle,
        "general": general,
    }
    options = dict(data)
    kind = options.pop("type", None)
    slotted = options.pop("half_lap", half_lap and "joint_hole" not in options)
    hole = options.pop("joint_hole", None)
    if slotted and hole is not None:
        raise InputError("a joint is a slot or a hole", field="section.half_lap", value=True)
    if kind not in makers:
        raise InputError(
            f"unknown section type (known: {', '.join(makers)})", field="section.type", value=kind
        )
    try:
        section = makers[kind](**options)
    except TypeError as error:
        raise InputError(
            f"wrong fields for a {kind} section: {error}", field="section", value=data
        ) from None
    if kind != "rectangle":
        return section
    if hole is not None:
        return drilled(section, hole)
    return half_lapped(section) if slotted else section


def material_from_dict(data: Mapping[str, Any]) -> Material:
    """The material that a design file describes."""
    try:
        return Material(**data)
    except TypeError as error:
        raise InputError(
            f"wrong fields for a material: {error}", field="material", value=data
        ) from None
