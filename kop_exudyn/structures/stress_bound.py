"""Stress as a bound: the utilisation of every rod element in a state, and its exact derivatives
where it counts.

Equivalent stress over elastic limit, times a safety factor, as `strength` has it: von Mises' at
each corner of the section at both ends of an element, in the middle of the section, and of what
joints leave of it. The largest of them all has to stay below one. It is kept by rows, one for every
place that may become the largest: those above a share of the limit, the highest first. A smooth
aggregate (p-mean, Kreisselmeier-Steinhauser) needs one row alone, but is either several per cent
off the maximum or as badly conditioned as it, and rows cost nothing next to the sensitivities that
are there anyway.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..equilibrium.equilibria import Equilibrium
from ..equilibrium.sensitivities import Sensitivities
from ..rods.section_slopes import SectionSlope
from ..rods.sections import Section
from ..scene.scene import Scene
from .base import Design
from .strength import TRANSVERSE, by_section, cut_ends, material_values, materials_of

NEAR = 0.7  # of the limit: places above it have rows
MOST_ROWS = 40  # rows of a state
_ALIKE = 0.97  # of the largest in an element: its other places have rows of their own from there
_SHEAR = np.sqrt(3)  # von Mises' factor of shear stresses


@dataclass(frozen=True)
class Rows:
    """Places of high stress: utilisation minus one (m,), and its derivatives (m, nq)."""

    value: np.ndarray
    jacobian: np.ndarray


@dataclass(frozen=True)
class Places:
    """A section's corners at some ends of some elements, and its middle.

    elements : (n,);  ends : where along the elements, in lengths from their middle
    """

    section: Section
    elements: np.ndarray
    ends: tuple[float, ...]

    @property
    def corners(self) -> int:
        return len(self.section.outline)

    def equivalent(self, stress: np.ndarray, lengths: np.ndarray) -> np.ndarray:
        """(n, corners x ends + 1) equivalent stress for generalised stresses (n, 6): all corners
        at the first end, at the next one, the middle."""
        section = self.section
        N, Qy, Qz, Mt, My, Mz = stress.T
        My, Mz = My - N * section.centre[1], Mz + N * section.centre[0]
        y, z = (section.outline - section.centre).T
        torsion = _SHEAR * np.abs(Mt) * section.torsion_modulus / section.torsion
        out = []
        for end in self.ends:
            normal = (
                (N / section.area)[:, None]
                + np.outer(My + end * lengths * Qz, z / section.inertia_y)
                - np.outer(Mz - end * lengths * Qy, y / section.inertia_z)
            )
            out.append(np.hypot(normal, torsion[:, None]))
        across = _SHEAR * TRANSVERSE * np.hypot(Qy, Qz) / section.area
        out.append(np.hypot(N / section.area, torsion + across)[:, None])
        return np.concatenate(out, axis=1)

    def slopes(self, stress: np.ndarray, length: float, place: int) -> tuple[np.ndarray, float]:
        """Derivatives of one place's equivalent stress in its element's six generalised stresses
        and in its length."""
        section = self.section
        N, Qy, Qz, Mt, My, Mz = stress
        twist = _SHEAR * section.torsion_modulus / section.torsion
        shear, shear_s = twist * abs(Mt), np.array([0, 0, 0, twist * np.sign(Mt), 0, 0])
        normal_L = 0.0
        if place == self.corners * len(self.ends):
            across, Q = _SHEAR * TRANSVERSE / section.area, np.hypot(Qy, Qz)
            shear += across * Q
            if Q > 0:
                shear_s = shear_s + across / Q * np.array([0, Qy, Qz, 0, 0, 0])
            normal, normal_s = N / section.area, np.array([1 / section.area, 0, 0, 0, 0, 0])
        else:
            end = self.ends[place // self.corners]
            y, z = section.outline[place % self.corners] - section.centre
            a, b = z / section.inertia_y, y / section.inertia_z
            along = 1 / section.area - section.centre[1] * a - section.centre[0] * b
            normal_s = np.array([along, end * length * b, end * length * a, 0, a, -b])
            normal = float(normal_s @ stress)
            normal_L = end * (Qz * a + Qy * b)
        size = np.hypot(normal, shear)
        return (normal * normal_s + shear * shear_s) / size, normal * normal_L / size

    def section_slope(
        self, stress: np.ndarray, length: float, place: int, by: SectionSlope
    ) -> float:
        """Derivative of one place's equivalent stress in a dimension of the section, for given
        generalised stresses (6,)."""
        section = self.section
        N, Qy, Qz, Mt, My, Mz = stress
        twist = section.torsion_modulus / section.torsion
        twist_d = by.torsion_modulus / section.torsion - twist * by.torsion / section.torsion
        shear, shear_d = _SHEAR * abs(Mt) * twist, _SHEAR * abs(Mt) * twist_d
        axial, axial_d = N / section.area, -N * by.area / section.area**2
        if place == self.corners * len(self.ends):
            across = _SHEAR * TRANSVERSE * np.hypot(Qy, Qz) / section.area
            shear, shear_d = shear + across, shear_d - across * by.area / section.area
            normal, normal_d = axial, axial_d
        else:
            end = self.ends[place // self.corners]
            corner = place % self.corners
            y, z = section.outline[corner] - section.centre
            outline = np.broadcast_to(by.outline, section.outline.shape)
            y_d, z_d = outline[corner] - by.centre
            a, b = z / section.inertia_y, y / section.inertia_z
            a_d = (z_d - a * by.inertia_y) / section.inertia_y
            b_d = (y_d - b * by.inertia_z) / section.inertia_z
            My, My_d = My - N * section.centre[1], -N * by.centre[1]
            Mz, Mz_d = Mz + N * section.centre[0], N * by.centre[0]
            My, Mz = My + end * length * Qz, Mz - end * length * Qy
            normal = axial + My * a - Mz * b
            normal_d = axial_d + My * a_d + My_d * a - Mz * b_d - Mz_d * b
        return float((normal * normal_d + shear * shear_d) / np.hypot(normal, shear))


def places_of(scene: Scene) -> list[Places]:
    """All places of a scene's rods at which stress is looked at: sections, and what joints leave
    of them."""
    whole = [Places(section, elements, (-0.5, 0.5)) for section, elements in by_section(scene)]
    cut = [Places(section, elements, (end,)) for section, elements, end in cut_ends(scene)]
    return [*whole, *cut]


class StressBound:
    """Utilisation in one scene of a design; elements without section or elastic limit have none.

    safety : factor that divides the elastic limit
    """

    def __init__(self, design: Design, scene: Scene, safety: float = 1.0):
        self.scene = scene
        limit = material_values(scene, materials_of(design), "elastic_limit", np.fmin)
        self._allowed = limit / safety
        known = [
            Places(p.section, p.elements[np.isfinite(limit[p.elements])], p.ends)
            for p in places_of(scene)
        ]
        self._places = [places for places in known if len(places.elements)]

    @property
    def known(self) -> bool:
        """Whether any element's limit is known."""
        return bool(self._places)

    def utilisation(self, equilibrium: Equilibrium) -> float:
        """The largest, at most 1 where the bound is met; 0 where no limit is known."""
        return max((float(u.max()) for u in self._utilisation(equilibrium)), default=0.0)

    def rows(self, sensitivities: Sensitivities) -> Rows:
        """The bound linearised at the places that come near the limit."""
        equilibrium = sensitivities.equilibrium
        found = []
        for places, u in zip(self._places, self._utilisation(equilibrium)):
            near = (u > NEAR) & (u >= _ALIKE * u.max(axis=1, keepdims=True))
            found += [(u[i, k], places, i, k) for i, k in np.argwhere(near)]
        found = sorted(found, key=lambda row: -row[0])[:MOST_ROWS]
        elements = np.array([places.elements[i] for _, places, i, _ in found], dtype=int)
        unique, number = np.unique(elements, return_inverse=True)
        slope, slope_L = np.zeros((len(found), 6)), np.zeros(len(found))
        lengths = self.scene.rest_lengths(equilibrium.q)
        for row, ((_, places, _, place), element) in enumerate(zip(found, elements)):
            slope[row], slope_L[row] = places.slopes(
                equilibrium.stress[element], lengths[element], int(place)
            )
        slope /= self._allowed[elements][:, None]
        slope_L /= self._allowed[elements]
        stress_q, lengths_q = (
            sensitivities.stresses_of(unique),
            self.scene.length_derivative(unique),
        )
        jacobian = np.einsum("mr,mrq->mq", slope, stress_q[number])
        jacobian += slope_L[:, None] * lengths_q[number]
        return Rows(np.array([row[0] for row in found]) - 1.0, jacobian)

    def _utilisation(self, equilibrium: Equilibrium) -> list[np.ndarray]:
        """(n, places) by section."""
        lengths = self.scene.rest_lengths(equilibrium.q)
        return [
            places.equivalent(equilibrium.stress[places.elements], lengths[places.elements])
            / self._allowed[places.elements][:, None]
            for places in self._places
        ]
