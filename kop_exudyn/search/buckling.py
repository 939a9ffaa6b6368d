"""Whether a state is still the one that another deforms into, or has buckled away from it."""

from __future__ import annotations

from ..errors import SimulationFailure
from ..structures.base import Design
from ..structures.opening import SAME_STATE
from .evaluation import Evaluation, distance
from .objective import DesignObjective, Reference


def missed_on_return(
    objective: DesignObjective, state: Evaluation, origin: Evaluation, steps: int = 10
) -> float:
    """How far from its origin a state ends when its elements are led back to the origin's.

    Elastic deformation is undone on the way back, however large it is; what has buckled into
    another stable state keeps to that one, or snaps into a third. The way is straight, in equal
    steps of the parameters.

    Returns the largest distance of a joint, as a share of the target's size. Raises
    SimulationFailure when no equilibrium is found on the way.
    """
    end = objective.follow(origin.q, state, steps, fitted_only=True)[-1]
    return distance(objective.design, origin, end)


def snapped(
    objective: DesignObjective, state: Evaluation, origin: Evaluation, steps: int = 10
) -> bool:
    """Whether a state doesn't come back to its origin, see `missed_on_return`."""
    try:
        return missed_on_return(objective, state, origin, steps) > SAME_STATE
    except SimulationFailure:
        return True


def buckled(design: Design, outcome: Evaluation | SimulationFailure, reference: Reference) -> bool:
    """Whether a built design doesn't come back to the input design; not so where there is no built
    one."""
    if isinstance(outcome, SimulationFailure):
        return False
    objective = DesignObjective(design, reference=reference)
    return snapped(
        objective, outcome, objective.judge(design.parameters, dict(reference.equilibria))
    )
