"""Derivatives of an equilibrium in what its scene is made of: stiffnesses, rest strains and loads.

For a number J(x, sigma) of the unknowns x and the generalised stresses sigma = K e / L, with
R(x, p) = 0 at equilibrium, one adjoint solve with the factorisation at hand serves all data p:

    K_t lambda = dJ/dx,    dJ/dp = dJ/dp (explicit) - lambda^T dR/dp

R has B^T K e / L of every element, -L w / 2 of a dead load w at both of its ends and -f of a dead
force, so that what multiplies lambda is the virtual strain B lambda, or the virtual displacement of
a point. The prescribed mean angle, where there is one, borders the matrix as it does everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Indices, Numbers, Points, Stresses
from ..scene.loads import DeadForces, Scaled
from ..scene.terms import SceneTerm
from .direction import border_of, bordered_solve
from .sensitivities import Sensitivities

_NO_DOFS: Indices = np.zeros(0, int)


@dataclass(frozen=True)
class ModelGradient:
    """The gradient of a number in what a scene is made of.

    stiffness (E, 6), rest_strain (E, 6) : of the rod elements
    weight (E, 3) : dead load per rest length
    factors (n_terms,) : on each of the scene's terms (loads, springs, actuators)
    forces : by the number of a term of dead forces, (m, 3) in these
    """

    stiffness: Stresses
    rest_strain: Stresses
    weight: Points
    factors: Numbers
    forces: dict[int, Points]


def model_gradient(
    sensitivities: Sensitivities,
    dofs: Indices = _NO_DOFS,
    cotangent: Numbers = np.zeros(0),
    stresses: Stresses | None = None,
) -> ModelGradient:
    """The gradient of a number J: one adjoint solve.

    Parameters
    ----------
    sensitivities : of the equilibrium
    dofs (m,), cotangent (m,) : unknowns, numbered as in `Scene`, and dJ/d(unknowns); rotations by
        increments in body axes
    stresses : (E, 6) dJ/d(generalised stresses), or None

    Where the equilibrium is close to a bifurcation, or moments without potential act, derivatives
    are worthless: see `Sensitivities.trusted`.
    """
    system = sensitivities.system
    scene, s, state = system.scene, system.sparsity, sensitivities.equilibrium.state
    B, lengths = system.strain_displacement, system.lengths
    strain = system.strain
    S = np.zeros((len(scene.elements), 6)) if stresses is None else np.asarray(stresses, float)

    load = np.zeros(s.n_free + s.n_driven)
    kept = s.kept[np.asarray(dofs, int)]
    np.add.at(load, kept[kept >= 0], np.asarray(cotangent, float)[kept >= 0])
    by_element = np.einsum("eri,er->ei", B, scene.stiffness * S / lengths[:, None])
    inside = s.rows >= 0
    load += np.bincount(s.rows[inside], by_element[inside], minlength=len(load))
    free, _ = bordered_solve(system, border_of(system), load[: system.n_unknowns])
    # of driven unknowns no residual is zero; absent ones (-1) read the last zero
    multiplier = np.concatenate([free, np.zeros(s.n_driven + 1)])

    virtual = np.einsum("eri,ei->er", B, multiplier[s.rows])
    moved = _virtual_displacements(sensitivities, multiplier[s.rows])
    factors = np.zeros(len(scene.terms))
    forces = {}
    for number, term in enumerate(scene.terms):
        at = multiplier[s.kept[term.dofs]]
        factors[number] = -float(np.sum(at * term.gradient_hessian(state)[1]))
        inner, factor = _unscaled(term)
        if isinstance(inner, DeadForces):
            turned = np.cross(at[:, 3:], inner.points)
            rotations = state.rotations[inner.bodies]
            forces[number] = factor * (at[:, :3] + np.einsum("mij,mj->mi", rotations, turned))
    return ModelGradient(
        stiffness=(S - virtual) * strain / lengths[:, None],
        rest_strain=(virtual - S) * scene.stiffness,
        weight=0.5 * lengths[:, None] * moved,
        factors=factors,
        forces=forces,
    )


def _virtual_displacements(sensitivities: Sensitivities, own: np.ndarray) -> np.ndarray:
    """(E, 3) of the two nodes of every element, summed, for increments (E, 14) of its unknowns."""
    scene, state = sensitivities.system.scene, sensitivities.equilibrium.state
    arms, rates = scene.node_arms(state)
    out = np.zeros((len(scene.elements), 3))
    for end in range(2):
        node = scene.elements[:, end]
        place, turn, angle = np.split(own[:, 7 * end : 7 * end + 7], (3, 6), axis=1)
        inner = np.cross(turn, arms[node]) + rates[node] * angle
        out += place + np.einsum("eij,ej->ei", state.rotations[scene.node_body[node]], inner)
    return out


def _unscaled(term: SceneTerm) -> tuple[SceneTerm, float]:
    """What a term is a multiple of, and the factor."""
    if not isinstance(term, Scaled):
        return term, 1.0
    inner, factor = _unscaled(term.term)
    return inner, term.factor * factor
