"""Soft limits of hinge angles: how far a joint turns before its parts meet.

An angle x with limits [l, u] has the energy w (b(x - u) + b(l - x)), b the logarithmic barrier of
the umbrella meshes' published simulator (Ren et al. 2022) in how far the angle is beyond a limit,

    b(c) = (-ln((r - c) / (r - a)))^3  for c > a,  else 0,

which begins at a = -margin before the limit, with two continuous derivatives, and grows without
bound as c approaches the reach r. With margin 0.02 and reach 10 rad a joint is pressed beyond its
limit by degrees, not stopped at it: the play and the softness of real joints.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import InputError
from .state import State
from .terms import SceneTerm

MARGIN, REACH = 0.02, 10.0  # rad


class HingeLimits(SceneTerm):
    """Soft limits of m hinges.

    Parameters
    ----------
    hinges : (m,) numbers of hinges
    lower, upper : (m,) or one number, rad
    weight : (m,) or one number, energy
    n_bodies : of the scene; the hinges' unknowns come after the bodies'
    margin, reach : rad, see the module

    Raises InputError for limits that are not finite or not in order, and for weights that are
    negative or not finite.
    """

    def __init__(
        self,
        hinges: Any,
        lower: Any,
        upper: Any,
        weight: Any,
        n_bodies: int,
        *,
        margin: float = MARGIN,
        reach: float = REACH,
    ):
        self.hinges = np.array(hinges, int).reshape(-1)
        m = len(self.hinges)
        self.lower, self.upper, self.weight = (
            np.array(np.broadcast_to(values, m), float) for values in (lower, upper, weight)
        )
        if not (np.isfinite([self.lower, self.upper]).all() and (self.lower < self.upper).all()):
            raise InputError("limits of hinges must be finite, lower below upper", field="limits")
        if not (np.isfinite(self.weight).all() and (self.weight >= 0).all()):
            raise InputError(
                "weights of limits must be finite and not negative", field="limits.weight"
            )
        self.n_bodies, self.margin, self.reach = n_bodies, margin, reach
        self.dofs = (6 * n_bodies + self.hinges)[:, None]

    def beyond(self, state: State) -> np.ndarray:
        """How far (m,) each angle is beyond its nearer limit, rad; negative within."""
        angles = state.angles[self.hinges]
        return np.maximum(angles - self.upper, self.lower - angles)

    def touched(self, state: State) -> np.ndarray:
        """(m,) bool: hinges that their limits act on."""
        return self.beyond(state) > -self.margin

    def energy(self, state: State) -> float:
        """Infinite where a hinge is beyond the reach."""
        return float(sum(self.weight @ self._barrier(c)[0] for c in self._violations(state)))

    def gradient_hessian(self, state: State) -> tuple[float, np.ndarray, np.ndarray]:
        """Energy, gradients (m, 1) and Hessians (m, 1, 1)."""
        (b, db, d2b), (b_l, db_l, d2b_l) = map(self._barrier, self._violations(state))
        energy = float(self.weight @ (b + b_l))
        slope, curve = self.weight * (db - db_l), self.weight * (d2b + d2b_l)
        return energy, slope[:, None], curve[:, None, None]

    def _violations(self, state: State) -> tuple[np.ndarray, np.ndarray]:
        angles = state.angles[self.hinges]
        return angles - self.upper, self.lower - angles

    def _barrier(self, c: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """b, b' and b'' (m,) at violations c."""
        left = self.reach - np.maximum(c, -self.margin)
        good = left > 0
        left = np.where(good, left, 1.0)
        log = np.where(good, np.log(left / (self.reach + self.margin)), -np.inf)
        slope = np.where(good, 3 * log**2 / left, np.inf)
        curve = np.where(good, 3 * (log - 2) * log / left**2, np.inf)
        return -(log**3), slope, curve
