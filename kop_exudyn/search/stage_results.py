"""What the stages of finding a kit leave: snaps and results, and how results are compared
and put together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..errors import SimulationFailure
from ..kit.parts import Assignment, Kit
from ..structures.base import Design
from ..structures.opening import SAME_STATE
from .dataset import Dataset
from .evaluation import Evaluation, distance

# A joint that moves this much further in one step of the path than in the steps around it has
# snapped.
_JUMP_FACTOR = 6.0
_JUMP_SHARE = 0.01  # of the size; smaller moves are no snap whatever their ratio


@dataclass(frozen=True)
class Jump:
    """A snap on the path to the parts: which design, at which fraction of the way, how far (share
    of the size)."""

    design: str
    fraction: float
    distance: float


@dataclass
class StageResult:
    """What a stage left: by design an evaluation confirmed by Exudyn, or the failure that it met.

    kit, assignment : those that the stage ended with
    steps : accepted steps; value : objective (None where a design failed); status : of the last SQP
    penalty : what the excess of the bounds costs, zero where all are met
    pressure : by design and state, the multiplier of its bound where that pushes: by how much J
        would fall for each unit that the bound were wider
    snapping : the designs that errors of the workshop make snap, where nothing was found that keeps
        all of them from it
    blocked : whether points beyond where the last SQP ended could not be simulated
    """

    designs: list[Evaluation | SimulationFailure]
    kit: Kit
    assignment: Assignment
    steps: int = 0
    value: float | None = None
    status: str = ""
    jumps: list[Jump] = field(default_factory=list)
    penalty: float = 0.0
    pressure: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    reuse_factor: float = 1.0
    snapping: tuple[int, ...] = ()
    blocked: bool = False

    @property
    def merit(self) -> float:
        """What results are compared by: the objective with what the excess of bounds costs, times
        the factor for pieces; infinite where a design failed."""
        if self.value is None:
            return float("inf")
        return (self.value + self.penalty) * self.reuse_factor

    @property
    def evaluations(self) -> list[Evaluation]:
        """Those of all designs, where none failed. Raises the SimulationFailure of one that did."""
        found = []
        for outcome in self.designs:
            if isinstance(outcome, SimulationFailure):
                raise outcome
            found.append(outcome)
        return found


def find_jump(
    design: Any, start: Evaluation, path: Sequence[Evaluation], size: float
) -> Jump | None:
    """The largest snap on a path of equal parameter steps, or None: joints that move far more in
    one step."""
    role = design.fitted_role.name
    positions = [e.equilibria[role].state.positions[design.joints] for e in (start, *path)]
    moves = (
        np.array([np.linalg.norm(b - a, axis=1).max() for a, b in zip(positions, positions[1:])])
        / size
    )
    worst = int(np.argmax(moves))
    if moves[worst] > _JUMP_SHARE and moves[worst] > _JUMP_FACTOR * np.median(moves):
        return Jump(design.name, (worst + 1) / len(path), float(moves[worst]))
    return None


def all_same(designs: Sequence[Design], led: StageResult, opened: StageResult) -> bool:
    """Whether all designs that were led to a state and opened by themselves are in the same one."""
    return all(
        distance(design, a, b) <= SAME_STATE
        for design, a, b in zip(designs, led.designs, opened.designs)
        if isinstance(a, Evaluation) and isinstance(b, Evaluation)
    )


def combined(results: Sequence[StageResult], dataset: Dataset) -> StageResult:
    """Each design from its own result, all of the same kit; its objective is to be judged anew."""
    first = np.cumsum([0, *(len(design.groups) for design in dataset.designs)])

    def pick(name: str) -> tuple[np.ndarray, ...]:
        return tuple(
            rows
            for n, result in enumerate(results)
            for rows in getattr(result.assignment, name)[first[n] : first[n + 1]]
        )

    assignment = replace(results[0].assignment, part=pick("part"), variant=pick("variant"))
    return StageResult(
        [result.designs[n] for n, result in enumerate(results)], results[0].kit, assignment
    )


def restrict(assignment: Assignment, dataset: Dataset, members: Sequence[int]) -> Assignment:
    """The assignment of some designs of a dataset, in the numbering of their subset."""
    subset = dataset.subset(members)
    counts = [len(d.groups) for d in dataset.designs]
    first = np.cumsum([0, *counts])
    rows = [k for n in members for k in range(first[n], first[n + 1])]
    return Assignment(
        tuple(subset.groups),
        tuple(assignment.part[k] for k in rows),
        tuple(assignment.variant[k] for k in rows),
        int(subset.offsets[-1]),
    )


def realised(dataset: Dataset, kit: Kit, assignment: Assignment, free: np.ndarray) -> np.ndarray:
    """(n_q,) every element its part, and the parameters of no element (k,) as given; those of
    elements that slide in their parts as near to what is given as these allow.

    free : (k,) values of `Dataset.free`
    """
    q = np.zeros(assignment.n_q)
    q[dataset.free] = free
    return assignment.realise(kit, q)
