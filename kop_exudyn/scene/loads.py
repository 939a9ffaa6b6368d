"""Loads: dead forces on points of bodies, torques on hinges, self-weight. All have a potential."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import InputError
from .scene import Scene
from .state import State
from .terms import SceneTerm


class DeadForces(SceneTerm):
    """Forces that keep direction and size, on m points of bodies.

    Parameters
    ----------
    bodies : (m,)
    forces : (m, 3) or (3,), global axes
    points : (m, 3) or (3,), where they act, in body axes from the body's origin

    Raises InputError where sizes don't fit or numbers are not finite.
    """

    def __init__(self, bodies: Any, forces: Any, points: Any = 0.0):
        self.bodies = _numbers(bodies)
        self.forces = _vectors(forces, len(self.bodies), "forces")
        self.points = _vectors(points, len(self.bodies), "points")
        self.dofs = 6 * self.bodies[:, None] + np.arange(6)

    def energy(self, state: State) -> float:
        """-f.x, summed."""
        arms = np.einsum("mij,mj->mi", state.rotations[self.bodies], self.points)
        return -float(np.sum(self.forces * (state.positions[self.bodies] + arms)))

    def gradient_hessian(self, state: State) -> tuple[float, np.ndarray, np.ndarray]:
        """Energy, gradients (m, 6) and Hessians (m, 6, 6).

        The second variation of R o along R exp(hat(w)) is R (w x (w x o)), so with F = R^T f that
        of the energy is (F.o) w.w - (F.w)(o.w).
        """
        o = self.points
        F = np.einsum("mji,mj->mi", state.rotations[self.bodies], self.forces)
        H = np.zeros((len(o), 6, 6))
        H[:, 3:, 3:] = np.einsum("mi,mi->m", F, o)[:, None, None] * np.eye(3) - 0.5 * (
            F[:, :, None] * o[:, None, :] + o[:, :, None] * F[:, None, :]
        )
        return self.energy(state), -np.concatenate([self.forces, np.cross(o, F)], axis=1), H


class HingeTorques(SceneTerm):
    """Torques on hinges, equal and opposite on the hinge's two sides: -tau a is their potential.

    Parameters
    ----------
    hinges : (m,)
    torques : (m,) or one number, positive where they open the hinge
    n_bodies : number of the scene's bodies, after whose unknowns the hinges come
    """

    def __init__(self, hinges: Any, torques: Any, n_bodies: int):
        self.hinges = _numbers(hinges)
        try:
            self.torques = np.array(np.broadcast_to(torques, self.hinges.shape), float)
        except ValueError:
            raise InputError(
                f"expected one torque or {len(self.hinges)}", field="loads.torques"
            ) from None
        if not np.isfinite(self.torques).all():
            raise InputError("torques must be finite", field="loads.torques")
        self.dofs = 6 * n_bodies + self.hinges[:, None]

    def energy(self, state: State) -> float:
        """-tau a, summed."""
        return -float(self.torques @ state.angles[self.hinges])

    def gradient_hessian(self, state: State) -> tuple[float, np.ndarray, np.ndarray]:
        """Energy, gradients (m, 1) and zero Hessians (m, 1, 1)."""
        return self.energy(state), -self.torques[:, None], np.zeros((len(self.hinges), 1, 1))


class Scaled(SceneTerm):
    """Another term times a factor that may be set at any time: the load factor of a path.

    term : any term
    factor : multiplies its energy and derivatives
    """

    def __init__(self, term: SceneTerm, factor: float = 1.0):
        self.term, self.factor = term, factor
        self.dofs = term.dofs
        self.conservative = term.conservative

    def energy(self, state: State) -> float:
        return self.factor * self.term.energy(state)

    def gradient_hessian(self, state: State) -> tuple[float, np.ndarray, np.ndarray]:
        energy, g, H = self.term.gradient_hessian(state)
        return self.factor * energy, self.factor * g, self.factor * H


def with_self_weight(scene: Scene, density: Any, gravity: Any, areas: Any = None) -> Scene:
    """The same scene with its rods' own weight added to the dead load that it has.

    Parameters
    ----------
    density : mass / length^3, one number or (E,)
    gravity : (3,) acceleration, global axes
    areas : (E,) or one cross-section area; default: those of the rods' sections

    Raises InputError when a rod has no section and no area is given, or where numbers are not
    positive.
    """
    n = len(scene.elements)
    if areas is None:
        areas = np.full(n, np.nan)
        for number, chain in enumerate(scene.chains):
            if chain.section is None:
                raise InputError(
                    "a rod without section needs an area", field="loads.areas", value=number
                )
            areas[chain.elements] = chain.section.area
    try:
        density, areas = (
            np.broadcast_to(np.asarray(values, float), n) for values in (density, areas)
        )
        gravity = np.broadcast_to(np.asarray(gravity, float), 3)
    except ValueError:
        raise InputError(
            f"expected one density and area or {n}, and gravity of three components", field="loads"
        ) from None
    positive = all(((values > 0) & np.isfinite(values)).all() for values in (density, areas))
    if not (positive and np.isfinite(gravity).all()):
        raise InputError("density and areas must be positive, gravity finite", field="loads")
    own = (density * areas)[:, None] * gravity
    return replace(scene, weight=own if scene.weight is None else scene.weight + own)


def _numbers(values: Any) -> np.ndarray:
    return np.array(values, int).reshape(-1)


def _vectors(values: Any, m: int, name: str) -> np.ndarray:
    try:
        vectors = np.array(np.broadcast_to(np.asarray(values, float), (m, 3)))
    except ValueError:
        raise InputError(f"expected {m} vectors", field=f"loads.{name}") from None
    if not np.isfinite(vectors).all():
        raise InputError("vectors must be finite", field=f"loads.{name}")
    return vectors
