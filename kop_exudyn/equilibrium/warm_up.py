"""Loads (or compiles, the first time) all compiled code, so that timings and progress bars start
after it."""

from __future__ import annotations

import numpy as np

from ..scene.builder import SceneBuilder
from .newton import solve
from .sensitivities import Sensitivities
from .system import System


def warm_up() -> None:
    """Solve and differentiate a tiny frame with a hinge, a driven angle and an actuation."""
    builder = SceneBuilder(n_parameters=2)
    bodies = builder.bodies([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0.0]])
    free, driven = builder.hinges([0.0]), builder.hinges([0.0], parameter=1, prescribed=True)
    stiffness = np.array([1e4, 1e3, 1e3, 1.0, 1.0, 1.0])
    nodes = builder.nodes(bodies, frame=np.eye(3))
    turned = builder.nodes(bodies[1:3], [free[0], driven[0]])
    builder.rod([nodes[0], nodes[1]], stiffness, parameter=0)
    builder.rod([turned[0], nodes[2]], stiffness, length=1.0)
    builder.rod([turned[1], nodes[3]], stiffness, length=1.0)
    builder.mean_angle(free)
    builder.pin(bodies[0])
    builder.pin(bodies[3], (2,))
    system = System(builder.build())
    equilibrium = solve(system, np.array([1.0, 0.1]), opening=0.05)
    sensitivities = Sensitivities(system, equilibrium)
    sensitivities.full
    sensitivities.predict(np.array([0.0, 0.01]))
