"""The largest stresses of every state, smoothed so that they can be differentiated: for designs
close to yielding.

With N, M_t, M_y, M_z in the middle of a rod element, and y, z the section's farthest points,

    u = (N / A)^2 + (M_y z / I_y)^2 + (M_z y / I_z)^2 + 3 (M_t W / J)^2

is between a third of and the whole of the square of the equivalent stress at a corner
(structures/strength.py has that one, exactly). The term is the p-mean of the stress over the rods'
length, squared, and over that of the input design:

    S / S0,  S = (sum_e L_e u_e^(p/2) / sum_e L_e)^(2/p)

which tends to the largest u with growing p (Le, Norato, Bruns, Ha, Tortorelli, Struct. Multidisc.
Optim. 41, 2010).
"""

from __future__ import annotations

import numpy as np

from ...equilibrium.equilibria import Equilibrium
from ...equilibrium.sensitivities import Sensitivities
from ...errors import InputError
from ...scene.scene import Scene
from ...structures.base import Design, Role
from ...structures.fitting import FitResult
from .base import Reference, Term, register_term

_P = 8  # close enough to the maximum, and the curvature still bounded
_UNTOLD = 1e-3  # of the curvature: what the smallest rows carry
_ROUNDING = 1e-7  # of an element's largest root: smaller ones are zero
# Of S0, by which all u are raised, and S is lowered again: where there is no stress, as in the
# assembly of an input, the curvature of the p-mean depends on the direction in which one comes, and
# would be that of rounding.
_FLOOR = 1e-9


@register_term
class Stress(Term):
    """S / S0 in every state that is solved, S0 that of the input design's fitted state."""

    name = "stress"

    def __init__(self, design: Design, reference: Reference):
        super().__init__(design, reference)
        self._forms = {
            role.name: _quadratic_forms(design.scene(role.name)) for role in design.roles
        }
        if not all(form.any() for form in self._forms.values()):
            raise InputError(
                "the rods' cross-sections aren't known", source=design.name, field="weights.stress"
            )
        fitted = design.fitted_role
        self._scale, self._floor = 1.0, 0.0
        self._scale = self.value(fitted, reference.equilibria[fitted.name])
        if not self._scale > 0:
            raise InputError(
                "the input design has no stress to compare with",
                source=design.name,
                field="weights.stress",
            )
        self._floor = _FLOOR * self._scale

    def value(self, role: Role, equilibrium: Equilibrium, fit: FitResult | None = None) -> float:
        return (_p_mean(*self._squares(role, equilibrium)) - self._floor) / self._scale

    def gradient(self, role: Role, sensitivities: Sensitivities, fit: FitResult) -> np.ndarray:
        return sensitivities.stress_adjoint(self._by_stress(role, sensitivities.equilibrium)[0])

    def model(
        self, role: Role, sensitivities: Sensitivities, fit: FitResult
    ) -> tuple[np.ndarray, np.ndarray]:
        """Gauss-Newton: exact in the stresses, in which the term is convex; their own curvature is
        left out."""
        equilibrium = sensitivities.equilibrium
        slope, curvature, along, less = self._by_stress(role, equilibrium)
        gradient = sensitivities.stress_adjoint(slope)
        told = np.flatnonzero(self._forms[role.name].any(axis=0))  # shear forces aren't
        # an element's curvature, a diagonal and a direction, as a sum of squares
        squares = along[:, told, None] * along[:, None, told]
        squares[:, range(len(told)), range(len(told))] += curvature[:, told]
        factors = np.zeros((len(squares), len(told), 6))
        factors[:, :, told], shares = _roots(squares, slope[:, told])
        elements = np.flatnonzero(factors.any(axis=(1, 2)))
        rows = sensitivities.stress_rows(elements, factors[elements])
        kept = _largest(rows)
        rows, shares = rows[kept], shares[elements].ravel()[kept]
        common = shares @ rows  # the gradient, but for what isn't kept: H stays semidefinite so
        return gradient, rows.T @ rows - less * np.outer(common, common)

    def _squares(self, role: Role, equilibrium: Equilibrium) -> tuple[np.ndarray, np.ndarray]:
        """u (E,), all raised by the floor, and the elements' shares (E,) of the rods' length."""
        form = self._forms[role.name]
        lengths = self.design.scene(role.name).rest_lengths(equilibrium.q)
        share = np.where(form.any(axis=1), lengths, 0.0)
        u = np.einsum("er,er->e", form, equilibrium.stress**2)
        return u + self._floor, share / share.sum()

    def _by_stress(
        self, role: Role, equilibrium: Equilibrium
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """dS/ds (E, 6), and the parts of d2S/ds2: a diagonal (E, 6), a vector (E, 6) an element,
        and of dS/ds itself."""
        form = self._forms[role.name]
        u, share = self._squares(role, equilibrium)
        value = _p_mean(u, share) / self._scale
        relative = u / (value * self._scale or 1.0)
        weight = share * relative ** (_P / 2 - 1) / self._scale
        slope = 2 * weight[:, None] * form * equilibrium.stress
        bend = (
            4 * (_P / 2 - 1) * share * relative ** (_P / 2 - 2) / (self._scale**2 * (value or 1.0))
        )
        return (
            slope,
            2 * weight[:, None] * form,
            np.sqrt(bend)[:, None] * form * equilibrium.stress,
            (_P / 2 - 1) / (value or 1.0),
        )


def _largest(rows: np.ndarray) -> np.ndarray:
    """Which rows (m, n) are needed: all but the smallest, which carry a thousandth of the sum of
    squares together. That is less than what Gauss-Newton leaves out, and two thirds of the rows."""
    squares = np.einsum("mn,mn->m", rows, rows)
    order = np.argsort(squares)
    carried = np.cumsum(squares[order])
    if not len(rows):
        return order
    return np.sort(order[np.searchsorted(carried, _UNTOLD * carried[-1]) :])


def _roots(squares: np.ndarray, slope: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Matrices R (n, k, k) with R^T R = S of positive semidefinite ones S (n, k, k), and g (n, k)
    with R^T g = slope, which lies in their range."""
    values, vectors = np.linalg.eigh(squares)
    roots, across = np.sqrt(np.maximum(values, 0.0)), vectors.transpose(0, 2, 1)
    shares = np.einsum("nij,nj->ni", across, slope)
    there = roots > _ROUNDING * roots.max(axis=1, keepdims=True)
    return roots[:, :, None] * across, shares / np.where(there, roots, np.inf)


def _p_mean(u: np.ndarray, share: np.ndarray) -> float:
    """S of squares u (E,), in which no power overflows."""
    largest = u.max(initial=0.0)
    return largest * float(share @ (u / (largest or 1.0)) ** (_P / 2)) ** (2 / _P)


def _quadratic_forms(scene: Scene) -> np.ndarray:
    """(E, 6) factors of the squared generalised stresses in u; zero where an element has no
    section."""
    forms = np.zeros((len(scene.elements), 6))
    for chain in scene.chains:
        section = chain.section
        if section is not None:
            y, z = np.abs(section.outline).max(axis=0)
            forms[chain.elements] = (
                1 / section.area**2,
                0,
                0,
                3 * (section.torsion_modulus / section.torsion) ** 2,
                (z / section.inertia_y) ** 2,
                (y / section.inertia_z) ** 2,
            )
    return forms
