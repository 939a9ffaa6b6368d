"""Attraction to a target: springs from points of the structure to given positions and to their
closest surface points.

A query point is a combination of body positions, q_i = sum_k s_k x_{b_ik}: a joint, or the midpoint
of two plates. The energy is  sum_i 1/2 [ w_i |q_i - q*_i|^2 + v_i |q_i - P(q_i)|^2 ].  Closest
points are either live, P depends on the state, or frozen, where they stay those of one state and
the energy is quadratic.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import InputError
from ..geometry.triangles import TriangleSurface
from .state import State
from .terms import SceneTerm

_I3 = np.eye(3)


class Attraction(SceneTerm):
    """Springs from m query points.

    Parameters
    ----------
    bodies : (m, k) bodies of each query point, or (m,) for k = 1
    shares : (k,) share of each body's position in the query point, by default 1 / k each
    targets, target_weight : (m, 3) positions q* and their weights (m,) or one number, energy /
        length^2
    surface, surface_weight : target surface and weights of the closest-point springs, likewise
    points : (m, 3) closest points to be kept; None: live ones

    Raises InputError where sizes don't fit or a weight without its target is given.
    """

    def __init__(
        self,
        bodies: Any,
        *,
        shares: Any = None,
        targets: Any = None,
        target_weight: Any = 0.0,
        surface: TriangleSurface | None = None,
        surface_weight: Any = 0.0,
        points: Any = None,
    ):
        self.bodies = np.array(bodies, int)
        if self.bodies.ndim == 1:
            self.bodies = self.bodies[:, None]
        m, k = self.bodies.shape
        self.shares = np.full(k, 1 / k) if shares is None else np.array(shares, float)
        self.target_weight = _weights(target_weight, m, targets is None, "target")
        self.surface_weight = _weights(
            surface_weight, m, surface is None and points is None, "surface"
        )
        self.targets = np.zeros((m, 3)) if targets is None else _points(targets, m, "targets")
        self.surface = surface
        self.points = None if points is None else _points(points, m, "points")
        self.dofs = (6 * self.bodies[:, :, None] + np.arange(3)).reshape(m, 3 * k)

    def queries(self, state: State) -> np.ndarray:
        """Query points (m, 3)."""
        return np.einsum("mkc,k->mc", state.positions[self.bodies], self.shares)

    def frozen(self, state: State) -> Attraction:
        """The same attraction with the closest points of a state."""
        points = None if self.surface is None else self.surface.closest(self.queries(state)).points
        return self._like(points=points)

    def live(self) -> Attraction:
        """The same attraction with closest points that follow the state."""
        return self._like(points=None)

    def scaled(self, factor: float) -> Attraction:
        """The same attraction with all weights multiplied."""
        return self._like(
            target_weight=factor * self.target_weight, surface_weight=factor * self.surface_weight
        )

    def energy(self, state: State) -> float:
        queries = self.queries(state)
        distance = np.sum((queries - self.targets) ** 2, axis=1)
        to_surface: Any
        if self._has_surface and self.points is None:
            assert self.surface is not None
            to_surface = self.surface.closest(queries).squared_distances
        else:
            to_surface = (
                0.0 if self.points is None else np.sum((queries - self.points) ** 2, axis=1)
            )
        return float(0.5 * np.sum(self.target_weight * distance + self.surface_weight * to_surface))

    def gradient_hessian(self, state: State) -> tuple[float, np.ndarray, np.ndarray]:
        """Energy, gradients (m, 3 k) and Hessians (m, 3 k, 3 k).

        With live points the gradient needs no dP/dq, since q - P is normal to the surface; the
        Hessian is v (I - dP/dq), exact wherever the closest feature doesn't change.
        """
        queries = self.queries(state)
        away = queries - self.targets
        g = self.target_weight[:, None] * away
        H = self.target_weight[:, None, None] * _I3
        energy = 0.5 * np.sum(self.target_weight * np.sum(away**2, axis=1))
        if self._has_surface:
            if self.points is None:
                assert self.surface is not None
                closest = self.surface.closest(queries)
                points, stiffness = closest.points, _I3 - closest.derivative
            else:
                points, stiffness = self.points, _I3
            away = queries - points
            g = g + self.surface_weight[:, None] * away
            H = H + self.surface_weight[:, None, None] * stiffness
            energy += 0.5 * np.sum(self.surface_weight * np.sum(away**2, axis=1))
        return float(energy), self._spread(g), self._spread_twice(H)

    @property
    def _has_surface(self) -> bool:
        return bool(self.surface_weight.any())

    def _spread(self, g: np.ndarray) -> np.ndarray:
        return (self.shares[:, None] * g[:, None, :]).reshape(len(g), -1)

    def _spread_twice(self, H: np.ndarray) -> np.ndarray:
        m, k = self.bodies.shape
        pairs = self.shares[:, None] * self.shares
        return (pairs[None, :, None, :, None] * H[:, None, :, None, :]).reshape(m, 3 * k, 3 * k)

    def _like(self, **changes: Any) -> Attraction:
        fields: dict[str, Any] = {
            "shares": self.shares,
            "targets": self.targets,
            "target_weight": self.target_weight,
            "surface": self.surface,
            "surface_weight": self.surface_weight,
            "points": self.points,
        }
        fields.update(changes)
        return Attraction(self.bodies, **fields)


def _weights(values: Any, m: int, absent: bool, name: str) -> np.ndarray:
    try:
        weights = np.array(np.broadcast_to(values, m), float)
    except ValueError:
        raise InputError(f"expected one weight or {m}", field=f"attraction.{name}_weight") from None
    if not (np.isfinite(weights).all() and (weights >= 0).all()):
        raise InputError(
            "weights must be finite and not negative", field=f"attraction.{name}_weight"
        )
    if absent and weights.any():
        raise InputError(f"a {name} weight needs a {name}", field=f"attraction.{name}_weight")
    return weights


def _points(values: Any, m: int, name: str) -> np.ndarray:
    points = np.array(values, float)
    if points.shape != (m, 3) or not np.isfinite(points).all():
        raise InputError(
            f"expected {m} finite points", field=f"attraction.{name}", value=points.shape
        )
    return points
