"""How an umbrella mesh is opened: a path of equilibria from the compact state to the final one.

The path has stages, each solved from the one before. First the mesh opens: the places to which the
X joints and cells are attracted go from the compact state to the target, and the spacing that the
actuators aim at from the compact one to the final one, in equal steps, while the actuators are
weak. Then the actuators' weight grows to its full size, and last the attraction
goes. So every state is near to the one before, as it is in a deployment by hand.

A stage that fails, that leaves an unstable state on its way or that turns a hinge far is taken
again in two halves. What still leaves an unstable state after that is a true branching of the path;
it is counted in `escapes` of the equilibrium and logged, since the mesh may open either way there.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ...errors import SimulationFailure
from ...scene.attraction import Attraction
from ...scene.state import State

if TYPE_CHECKING:
    from ...equilibrium.newton import Equilibrium

log = logging.getLogger(__name__)

_TRIAL = 80  # iterations after which a stage that may be halved is given up
_WEAKER = 1e-4  # loads of a second attempt, where the mesh is too slender for those of the first
_LEAST = 1e-3  # of the attraction: what it falls to before it goes, where that has to be halved


@dataclass(frozen=True)
class Deployment:
    """How an umbrella mesh is opened.

    stages : from the compact to the open state
    weights : of the actuators; the first one during these stages, each other in a further stage
    attraction : weight that pulls X joints and cell midpoints to their places meanwhile; 0 in the
        final state
    share : of the attraction, omega; the rest, 1e-5 of it, would pull towards the surface and is
        left out
    angle : rad, turn of all hinges in the compact state, so that it isn't the unstable equilibrium
    turn : rad, by which a hinge may turn in one stage
    halvings : how often a stage may be divided
    tolerance : relative residual of all solves but the last
    """

    stages: int = 4
    weights: tuple[float, ...] = (1e-4, 1e-2, 1.0)
    attraction: float = 0.1
    share: float = 0.99999
    angle: float = 1e-3
    turn: float = 2.0
    halvings: int = 4
    tolerance: float = 1e-3

    def path(self, gentle: bool = False) -> list[Stage]:
        """The stages in order, the final state last; `gentle` begins with weaker loads."""
        first = self.weights[0]
        weak = _WEAKER if gentle else 1.0
        stages = [
            Stage(k / self.stages, weak * self.attraction, weak * first)
            for k in range(1, self.stages + 1)
        ]
        if gentle:
            powers = np.geomspace(weak, 1.0, 5)[1:]
            stages += [Stage(1.0, p * self.attraction, p * first) for p in powers.tolist()]
        stages += [Stage(1.0, self.attraction, weight) for weight in self.weights[1:]]
        return [*stages, Stage(1.0, 0.0, self.weights[-1], final=True)]


@dataclass(frozen=True)
class Stage:
    """A point of the path.

    opening : 0 compact to 1 open, share of the way of places and spacings
    attraction, actuators : weights
    final : in the scene of the final state, without attraction
    """

    opening: float
    attraction: float
    actuators: float
    final: bool = False

    def between(self, other: Stage) -> Stage:
        """The stage half-way to another one: weights by their logarithm."""
        least = _LEAST * self.attraction
        attraction = float(np.sqrt(self.attraction * max(other.attraction, least)))
        return Stage(
            0.5 * (self.opening + other.opening),
            attraction,
            float(np.sqrt(self.actuators * other.actuators)),
        )

    def __str__(self) -> str:
        if self.final:
            return "final state"
        return f"{self.opening:.0%} open, actuator weight {self.actuators:.3g}"


Solver = Callable[["Stage", "State | Equilibrium", int], "Equilibrium"]


def follow(
    start: State, path: Sequence[Stage], solve: Solver, deployment: Deployment, name: str
) -> list[Equilibrium]:
    """Equilibria along a path, the final one last; those of stages that were tried in vain, whose
    iterations count, are among them.

    start : the compact state
    solve : equilibrium of a stage from a start, within so many iterations
    name : of the design, for messages

    Raises SimulationFailure with the stage that has no equilibrium.
    """
    at = Stage(0.0, path[0].attraction, path[0].actuators)
    state: State | Equilibrium = start
    found: list[Equilibrium] = []
    for goal in path:
        waiting = [goal]
        while waiting:
            stage = waiting[-1]
            divisible = len(waiting) <= deployment.halvings
            try:
                # without the attraction soft modes settle, which takes its time
                patient = stage.final or not divisible
                reached = solve(stage, state, 4 * _TRIAL if patient else _TRIAL)
            except SimulationFailure as failure:
                if not divisible:
                    raise failure.within(f"{name}: {stage}") from None
                log.debug("%s: %s: %s; halved", name, stage, failure)
                waiting.append(at.between(stage))
                continue
            turn = _largest_turn(state, reached)
            found.append(reached)
            if divisible and (reached.escapes or turn > deployment.turn):
                log.debug(
                    "%s: %s: %d unstable states left, hinges turn by %.2f rad; halved",
                    *(name, stage, reached.escapes, turn),
                )
                waiting.append(at.between(stage))
                # of what is not gone on from only the iterations count
                found[-1] = replace(reached, escapes=0)
                continue
            if reached.escapes:
                log.warning(
                    "%s: %s: the path branches: the mesh may open to another shape than this one",
                    *(name, stage),
                )
            at, state = stage, reached
            waiting.pop()
    return found


def state_of(start: State | Equilibrium) -> State:
    return start if isinstance(start, State) else start.state


def _largest_turn(before: State | Equilibrium, after: Equilibrium) -> float:
    angles = state_of(before).angles
    return float(np.abs(after.state.angles - angles).max(initial=0.0))


def drawn_towards(
    attraction: Attraction, compact: State, spread: float, weight: float
) -> Attraction:
    """An attraction to places part of the way from the compact state, its weight multiplied."""
    places = attraction.queries(compact)
    places = places + spread * (attraction.targets - places)
    return Attraction(
        attraction.bodies,
        shares=attraction.shares,
        targets=places,
        target_weight=weight * attraction.target_weight,
    )
