"""Gradients in stiffnesses, rest strains, weights and forces, against equilibria solved again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kop_exudyn.equilibrium.model_gradient import model_gradient
from kop_exudyn.equilibrium.newton import NewtonOptions, refine, solve
from kop_exudyn.equilibrium.sensitivities import Sensitivities
from kop_exudyn.equilibrium.system import System
from kop_exudyn.scene.loads import DeadForces, Scaled

EXACT = NewtonOptions(tolerance=1e-12)
STEPS = 2.0 ** -np.arange(2, 6)


def solved(scene, case, start=None):
    system = System(scene)
    return system, refine(system, solve(system, case.q, start, case.opening, EXACT))


@pytest.fixture(scope="module", params=[{}, {"actuated": False}], ids=["actuated", "free"])
def case(request, wheel):
    """A wheel under weight, with forces on points beside two bodies, one of them scaled; a number
    of its state and stresses, and their cotangents."""
    case = wheel(**request.param)
    scene, rng = case.scene, np.random.default_rng(1)
    force = 1e-2 * float(np.abs(case.scene.weight).max()) * case.scene.size
    points = 0.1 * scene.length_scale * rng.normal(size=(2, 3))
    pushed = DeadForces([1, 2], force * rng.normal(size=(2, 3)), points)
    case = replace(case, scene=scene.with_terms(*scene.terms, pushed, Scaled(pushed, 0.5)))
    system, eq = solved(case.scene, case)
    dofs = (6 * np.arange(case.scene.n_bodies)[:, None] + np.arange(3)).ravel()
    x = rng.normal(size=len(dofs))
    s = rng.normal(size=eq.stress.shape) / np.abs(eq.stress).max()

    def number(other):
        return float(x @ other.state.positions.ravel() + np.sum(s * other.stress))

    found = model_gradient(Sensitivities(system, eq), dofs, x, s)
    return case, eq, number, found


def changes(scene, name, rng):
    """A direction in the data, and the scene so far along it."""
    if name == "forces":
        *others, pushed, scaled = scene.terms
        d = np.abs(pushed.forces).max() * rng.normal(size=pushed.forces.shape)

        def moved(h):
            own = DeadForces(pushed.bodies, pushed.forces + h * d, pushed.points)
            return scene.with_terms(*others, own, scaled)

        return d, moved
    if name == "factor":
        *others, scaled = scene.terms
        return 1.0, lambda h: scene.with_terms(*others, Scaled(scaled.term, 0.5 + 0.5 * h))
    now = getattr(scene, name)
    d = rng.normal(size=now.shape) * (0.02 if name == "rest_strain" else np.abs(now))
    if name == "stiffness":
        d = 0.3 * np.tanh(d / now) * now
    return d, lambda h: replace(scene, **{name: now + h * d})


@pytest.mark.parametrize("name", ["stiffness", "rest_strain", "weight", "forces", "factor"])
def test_gradients_are_exact(case, name):
    """The remainder of a first-order prediction falls with the square of the step; not so without
    what the state adds to the explicit part, or a gradient that is a tenth off."""
    own, eq, number, found = case
    terms = own.scene.terms
    gradient = {
        "forces": found.forces.get(len(terms) - 2),
        "factor": found.factors[-1],
    }.get(name, getattr(found, name, None))
    d, moved = changes(own.scene, name, np.random.default_rng(3))
    at, slope = number(eq), float(np.sum(gradient * d))
    values = np.array([number(solved(moved(h), own, eq)[1]) - at for h in STEPS])

    def order(first):
        left = np.abs(values - STEPS * first)
        return np.polyfit(np.log(STEPS), np.log(left), 1)[0]

    assert order(slope) > 1.8
    assert order(1.1 * slope) < 1.4
