"""Where a solve for an equilibrium is: a state and its actuation's multiplier, how far they are
from balance, and how many iterations are left."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import SimulationFailure
from ..scene.state import State
from .equilibria import Start
from .system import Energy, System

_BENT_TOO_FAR = 2.5  # rad from one end of an element to the other; at pi its strain measure ends


@dataclass(frozen=True)
class NewtonOptions:
    """Settings of the equilibrium solver.

    tolerance : largest residual force, relative to the largest internal force (round-off is allowed
        for)
    max_iterations : over all phases of one solve
    rotation_cap : rad, largest rotation or hinge turn of one step
    mixed : predicted-stress iteration; False gives plain Newton with line search
    patience : mixed iterations without headway before the best state returns and steps become
        shorter
    escapes : how many saddles are left before the solve is given up
    escape_rotation : rad, largest rotation of the first move away from a saddle
    soften : when a start without stress (one that no earlier solve led to) brings nothing, solve
        with rods that are soft along their axis first (see softened.py)
    side : (n_free,) vector; where the two ways off a saddle are equivalent, the one with positive
        product is taken
    """

    tolerance: float = 1e-9
    max_iterations: int = 300
    rotation_cap: float = 0.4
    mixed: bool = True
    patience: int = 8
    escapes: int = 6
    escape_rotation: float = 0.05
    soften: bool = True
    side: np.ndarray | None = None


class Iterate:
    """The state of one solve, and its measures.

    state, torque : where it is; iterations : so far; escapes : saddles that were left
    shift : of the Hessian, in the last step
    assembled : energies of the state, where its own Hessian is in the system
    """

    def __init__(
        self,
        system: System,
        q: np.ndarray,
        start: Start,
        opening: float | None,
        options: NewtonOptions,
    ):
        self.system, self.q, self.opening, self.options = system, q, opening, options
        self.state = system.scene.held(start.state, q)
        self.torque = start.torque
        system.predicted_stress[:] = 0.0 if start.stress is None else start.stress
        self.iterations = 0
        self.escapes = 0
        self.shift = 0.0
        # if the Hessian of the state itself is in the system already
        self.assembled: Energy | None = None

    def residual(self) -> tuple[np.ndarray, float]:
        """Residual (n_free,) of the state assembled last, and how far its mean angle is from the
        opening."""
        system = self.system
        residual = system.gradient[: system.n_unknowns]
        if system.constraint is None:
            return residual, 0.0
        return residual + self.torque * system.constraint, self.gap()

    def gap(self) -> float:
        """How far the state's mean angle is from the opening, rad."""
        return float(self.state.angles[self.system.scene.actuated].mean() - self.opening)

    def largest(self, residual: np.ndarray) -> float:
        """Largest residual force, moments divided by the length scale."""
        return float(np.max(np.abs(residual) * self.system.force_weight, initial=0.0))

    def merit(self, residual: np.ndarray, gap: float) -> float:
        """Residual over its tolerance; converged at 1."""
        force, noise = self.system.force_scale()
        allowed = self.options.tolerance * force + 40 * noise
        return max(self.largest(residual) / allowed, abs(gap) / 1e-11)

    def predicted(self) -> bool:
        """Whether the stress that the mixed Hessian was taken at is the state's own, as exact as
        its residual is."""
        force, noise = self.system.force_scale()
        error = np.abs(self.system.predicted_stress - self.system.stress())
        error[:, 3:] /= self.system.scene.length_scale
        return bool(error.max(initial=0.0) <= self.options.tolerance * force + 40 * noise)

    def relative(self, residual: np.ndarray) -> float:
        """Largest residual force over the largest internal one."""
        force, noise = self.system.force_scale()
        return self.largest(residual) / max(force, noise, np.finfo(float).tiny)

    def converged(self, residual: np.ndarray, gap: float) -> bool:
        """Whether both are within the tolerance."""
        return self.merit(residual, gap) <= 1.0

    def capped(self, step: np.ndarray, cap: float) -> float:
        """Share of a step that turns nothing by more than a cap, rad."""
        turn = np.abs(step.take(self.system.rotations)).max(initial=0.0)
        return min(1.0, cap / max(turn, np.finfo(float).tiny))

    def close_gap(self) -> None:
        """Spread what the mean angle lacks over all actuated hinges: descent keeps the equation
        satisfied."""
        if self.system.constraint is None:
            return
        angles = self.state.angles.copy()
        angles[self.system.scene.actuated] -= self.gap()
        self.state = State(self.state.positions, self.state.rotations, angles)

    def check_budget(self) -> None:
        """Count an iteration. SimulationFailure where none is left."""
        if self.iterations >= self.options.max_iterations:
            raise SimulationFailure(
                f"no equilibrium within {self.options.max_iterations} Newton iterations"
                f"{self._bent_too_far()}"
            )
        self.iterations += 1

    def _bent_too_far(self) -> str:
        """A hint where an element bends or twists so far that its strain is about to be undefined,
        else nothing."""
        system = self.system
        turns = np.linalg.norm(
            system.strain[:, 3:] + system.lengths[:, None] * system.scene.rest_strain[:, 3:], axis=1
        )
        worst = int(np.argmax(turns))
        return (
            f": element {worst} turns by {turns[worst]:.2f} rad, divide its rod more finely"
            if (turns[worst] > _BENT_TOO_FAR)
            else ""
        )
