"""Stress in every rod element, and how much of the material's elastic limit it uses.

Normal stress at a section's corner (y, z), with N, M_y, M_z in the rod's local axes:

    sigma = N / A + M_y z / I_y - M_z y / I_z

The element's generalised stresses are those of its middle; statics carry its moments to its ends,
which are where they are largest: M_y +- Q_z L / 2 and M_z -+ Q_y L / 2 (exact for straight elements
without loads in between). Torsion gives the shear stress |M_t| W / J with W the section's
`torsion_modulus`, transverse forces 3/2 |Q| / A (Timoshenko and Goodier, Theory of Elasticity, for
rectangles; 4/3 would do for circles). Equivalent stress after von Mises, sqrt(sigma^2 + 3 tau^2),
of the worse of two points: a corner with torsion's largest shear, or the section's middle with that
and the transverse shear. Torsion is largest at the middle of a side, so the sum is on the safe
side.

Where a joint cuts a rod (a half-lap's slot, a bolt's hole; `Section.cut`), the same is asked of
what is left there. Nothing that fills the cut is counted on, nor are the peaks at its corners.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, is_dataclass
from typing import Any

import numpy as np

from ..equilibrium.equilibria import Equilibrium
from ..rods.sections import Material, Section
from ..scene.scene import Scene
from ..wording import counted
from .base import Design

TRANSVERSE = 1.5  # largest over mean shear stress of a transverse force
_SAME_STIFFNESS = 1e-9  # relative
_ROUNDING = 5e-6  # of a limit: a search that keeps to one ends on it, as well as it converges


def beyond_limit(value: float | None, limit: float = 1.0) -> bool:
    """Whether a value is larger than its limit by more than rounding; one that isn't known is
    not.

    value : such as a utilisation, times the safety factor
    """
    return value is not None and value > limit * (1 + _ROUNDING)


@dataclass(frozen=True)
class Strength:
    """Stresses (E,) of a scene's rod elements, force / length^2; NaN where an element has no
    section.

    axial : N / A
    normal : largest |sigma| at a corner, at either end
    shear : largest of torsion and transverse forces
    equivalent : von Mises
    limit : elastic limit of each element's material, NaN where unknown
    """

    axial: np.ndarray
    normal: np.ndarray
    shear: np.ndarray
    equivalent: np.ndarray
    limit: np.ndarray

    def __repr__(self) -> str:
        used = "" if self.largest is None else f", at most {100 * self.largest:.0f} % of the limit"
        return f"<Strength of {counted(len(self.equivalent), 'rod element')}{used}>"

    @property
    def utilisation(self) -> np.ndarray:
        """(E,) equivalent stress over elastic limit; above 1 the rod yields or breaks."""
        return self.equivalent / self.limit

    @property
    def largest(self) -> float | None:
        """The largest utilisation; None where no element's is known."""
        known = self.utilisation[np.isfinite(self.utilisation)]
        return float(known.max()) if len(known) else None

    def to_dict(self) -> dict[str, Any]:
        """The largest equivalent stress and utilisation, and the element where that is; None where
        unknown."""
        if not np.isfinite(self.equivalent).any():
            return {"equivalent_stress": None, "utilisation": None, "element": None}
        worst = int(np.nanargmax(self.equivalent if self.largest is None else self.utilisation))
        return {
            "equivalent_stress": float(np.nanmax(self.equivalent)),
            "utilisation": self.largest,
            "element": worst,
        }


def rod_strength(
    scene: Scene, equilibrium: Equilibrium, materials: Sequence[Material] = ()
) -> Strength:
    """Stresses of all elements of a scene in an equilibrium.

    materials : those that the scene's rods may be made of; an element's own is the one that
        explains its stiffness
    """
    n = len(scene.elements)
    lengths = scene.rest_lengths(equilibrium.q)
    axial, normal, shear, equivalent = np.full((4, n), np.nan)
    for section, elements in by_section(scene):
        rows = section_stress(section, equilibrium.stress[elements], lengths[elements])
        axial[elements], normal[elements], shear[elements], equivalent[elements] = rows
    for section, elements, end in cut_ends(scene):
        rows = section_stress(section, equilibrium.stress[elements], lengths[elements], (end,))
        for whole, at_cut in zip((normal, shear, equivalent), rows[1:]):
            whole[elements] = np.maximum(whole[elements], at_cut)
    limit = material_values(scene, materials, "elastic_limit", np.fmin)
    return Strength(axial, normal, shear, equivalent, limit)


def design_strength(design: Design, equilibria: Mapping[str, Equilibrium]) -> dict[str, Strength]:
    """Stresses by role of a design's equilibria, with the materials that the design carries."""
    materials = materials_of(design)
    return {
        role: rod_strength(design.scene(role), equilibrium, materials)
        for role, equilibrium in equilibria.items()
    }


def strength_summary(
    design: Design, equilibria: Mapping[str, Equilibrium]
) -> dict[str, dict[str, Any]]:
    """`Strength.to_dict()` by role, as results have it."""
    return {
        role: strength.to_dict() for role, strength in design_strength(design, equilibria).items()
    }


def largest_utilisation(summary: Mapping[str, Mapping[str, Any]]) -> float | None:
    """The largest of all roles of a `strength_summary`; None where none is known."""
    known = [state["utilisation"] for state in summary.values()]
    return max((value for value in known if value is not None), default=None)


def materials_of(design: Design) -> tuple[Material, ...]:
    """Materials among a design's attributes, and among the fields of the dataclasses there, in a
    fixed order."""
    return tuple(dict.fromkeys(_materials_in(vars(design).values(), depth=1)))


def material_values(
    scene: Scene, materials: Sequence[Material], name: str, choose: Callable = np.fmax
) -> np.ndarray:
    """(E,) a property of every rod element's material, the one that explains its stiffness; NaN
    where unknown.

    choose : which value, where several materials do
    """
    values = np.full(len(scene.elements), np.nan)
    for section, elements in by_section(scene):
        for material in materials:
            value = getattr(material, name)
            if value is not None:
                same = made_of(scene, elements, section, material)
                values[same] = choose(values[same], value)
    return values


def made_of(scene: Scene, elements: np.ndarray, section: Section, material: Material) -> np.ndarray:
    """Those of a section's elements whose stiffness a material explains."""
    same = np.isclose(
        scene.stiffness[elements], section.stiffness(material), rtol=_SAME_STIFFNESS, atol=0
    )
    return elements[same.all(axis=1)]


def _materials_in(values: Any, depth: int) -> Iterator[Material]:
    for value in values:
        if isinstance(value, Material):
            yield value
        elif depth and is_dataclass(value) and not isinstance(value, type):
            yield from _materials_in(vars(value).values(), depth - 1)


def by_section(scene: Scene) -> Iterator[tuple[Section, np.ndarray]]:
    """Each section of the scene with its elements."""
    elements: dict[int, tuple[Section, list[np.ndarray]]] = {}
    for chain in scene.chains:
        if chain.section is not None:
            elements.setdefault(id(chain.section), (chain.section, []))[1].append(chain.elements)
    for section, parts in elements.values():
        yield section, np.concatenate(parts)


def cut_ends(scene: Scene) -> Iterator[tuple[Section, np.ndarray, float]]:
    """What is left of the sections that joints cut, with the elements that begin (-0.5) or end
    (0.5) there."""
    found: dict[tuple[int, float], tuple[Section, list[int]]] = {}
    for chain in scene.chains:
        left = None if chain.section is None else chain.section.cut
        for place, end, here in zip((0, -1), (-0.5, 0.5), chain.cut):
            if left is not None and here and len(chain.elements):
                found.setdefault((id(left), end), (left, []))[1].append(int(chain.elements[place]))
    for (_, end), (left, elements) in found.items():
        yield left, np.array(elements), end


def section_stress(
    section: Section, stress: np.ndarray, lengths: np.ndarray, at: Sequence[float] = (-0.5, 0.5)
) -> tuple[np.ndarray, ...]:
    """axial, normal, shear, equivalent (n,) for generalised stresses (n, 6).

    at : where along the elements, in lengths from the middle. Stresses are about the origin of the
        section's axes; a section whose centroid lies elsewhere is bent by the axial force.
    """
    N, Qy, Qz, Mt, My, Mz = stress.T
    axial = N / section.area
    My, Mz = My - N * section.centre[1], Mz + N * section.centre[0]
    y, z = (section.outline - section.centre).T
    ends = np.multiply.outer(np.array(at), lengths)
    bending = np.multiply.outer(My + ends * Qz, z / section.inertia_y) - np.multiply.outer(
        Mz - ends * Qy, y / section.inertia_z
    )
    normal = np.abs(axial[:, None] + bending).max(axis=(0, 2))
    torsion = np.abs(Mt) * section.torsion_modulus / section.torsion
    shear = torsion + TRANSVERSE * np.hypot(Qy, Qz) / section.area
    corner, middle = np.hypot(normal, np.sqrt(3) * torsion), np.hypot(axial, np.sqrt(3) * shear)
    return axial, normal, shear, np.maximum(corner, middle)
