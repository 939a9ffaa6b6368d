"""Where a solve starts, and the equilibrium that it ends in."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..scene.state import State


@dataclass(frozen=True)
class Start:
    """Where a solve starts.

    state : poses and angles
    torque : the actuation's multiplier
    stress : (E, 6) generalised stresses for the first geometric stiffness, default none: after a
        jump in lengths the start's own stresses are spurious compressions that would make the
        stiffness indefinite
    """

    state: State
    torque: float = 0.0
    stress: np.ndarray | None = None


@dataclass(frozen=True)
class Equilibrium:
    """A stable equilibrium of a scene.

    state : poses and angles
    q : (n_parameters,) parameters that it belongs to
    opening : prescribed mean actuated angle, or None
    torque : the actuation's multiplier, energy / rad (0 without actuation): the torque on every
        actuated hinge is torque / number of actuated hinges
    stress : (E, 6) generalised stresses (N, Q_y, Q_z, M_t, M_y, M_z) in the elements
    elastic_energy, potential : energies
    iterations : Newton iterations of the solve, all phases
    residual : largest residual force, relative to the largest internal force
    escapes : saddles left on the way
    wall_s : seconds
    """

    state: State
    q: np.ndarray
    opening: float | None
    torque: float
    stress: np.ndarray
    elastic_energy: float
    potential: float
    iterations: int
    residual: float
    escapes: int
    wall_s: float
    stable: bool = True

    def __repr__(self) -> str:
        opening = "" if self.opening is None else f", opening {self.opening:.4g} rad"
        kind = "stable" if self.stable else "unstable"
        return f"<Equilibrium: {kind}, elastic energy {self.elastic_energy:.6g}{opening}>"

    @property
    def start(self) -> Start:
        """This equilibrium as the start of another solve."""
        return Start(self.state, self.torque, self.stress)

    def after(self, *earlier: Equilibrium) -> Equilibrium:
        """The same equilibrium, with the iterations and seconds of the solves that led to it
        added."""
        return replace(
            self,
            iterations=self.iterations + sum(eq.iterations for eq in earlier),
            escapes=self.escapes + sum(eq.escapes for eq in earlier),
            wall_s=self.wall_s + sum(eq.wall_s for eq in earlier),
        )
