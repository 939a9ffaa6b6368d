"""Moments on bodies: loads without a potential, which whoever writes a `SceneTerm` may have.

A moment on a body that may turn in space has none, neither one that keeps its direction nor one
that turns with the body: the work depends on the path (Ziegler, Principles of Structural
Stability). Their tangents are not symmetric. In increments R exp(hat(w)) the symmetric part, which
the solver takes, is zero for both, and their skew parts are opposite; where the turns of the body
stay in one plane it is the whole tangent. So equilibria are exact, iterations converge linearly
where turns are spatial, and stability is that of the semi-tangential moment between the two.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from kop_exudyn.scene.state import State
from kop_exudyn.scene.terms import SceneTerm


class BodyMoments(SceneTerm):
    """Moments that turn with their bodies.

    bodies : (m,)
    moments : (m, 3) or (3,), body axes
    """

    conservative = False

    def __init__(self, bodies: Any, moments: Any):
        self.bodies = np.array(bodies, int).reshape(-1)
        self.moments = np.array(np.broadcast_to(moments, (len(self.bodies), 3)), float)
        self.dofs = 6 * self.bodies[:, None] + np.arange(3, 6)

    def energy(self, state: State) -> float:
        return 0.0

    def gradient_hessian(self, state: State) -> tuple[float, np.ndarray, np.ndarray]:
        return 0.0, -self._in_body_axes(state), np.zeros((len(self.bodies), 3, 3))

    def _in_body_axes(self, state: State) -> np.ndarray:
        return self.moments


class SpatialMoments(BodyMoments):
    """Moments that keep their direction in space: the same with moments (m, 3) in global axes."""

    def _in_body_axes(self, state: State) -> np.ndarray:
        return np.einsum("mji,mj->mi", state.rotations[self.bodies], self.moments)
