"""Better parts for the elements than the nearest ones: those that a quadratic model of the
objective prefers.

The projection energy sees an element only by its distance to a part. Shape and energy, however,
don't care about most changes of an element as long as its neighbours make up for them. Here every
element is given the part (and variant) that lowers m(q) = g.(q - q0) + 1/2 (q - q0).(H + mu S^-2)(q
- q0) most, with gradient g and Hessian H of the designs' objective at q0, the parameters' scales S,
and the others' parts as they are; one element after the other, until none gains any more. In
between, the parts themselves are moved to the minimum of m(M p). mu limits how far the model is
trusted. This is coordinate descent on a closest-vector problem; it ends in a local minimum of m,
which is never higher than where it began.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..kit.kinds import part_kind
from ..kit.parts import Assignment, Kit
from ..kit.reuse import PieceCount
from ..sqp.qp import QP, QPOptions, QPSolver
from .descent import Descent
from .evaluation import DesignDerivatives
from .problems import AssignedProblem
from .sliding import Counting, descend_in_boxes

_SETTLED = 1e-6  # rounds that gain less than this share of the gain so far are the last
_ROUNDS = 50


@dataclass(frozen=True)
class LocalModel:
    """m of the designs side by side: they are coupled by the parts alone.

    base : per design, q0 (nq,);  gradients : (nq,);  hessians : (nq, nq), with the damping
    rounding : a gain that can't be told from rounding
    piece_cost : of a piece that has to be made, so that the designs can be built one after the
        other
    """

    base: tuple[np.ndarray, ...]
    gradients: tuple[np.ndarray, ...]
    hessians: tuple[np.ndarray, ...]
    rounding: float
    piece_cost: float = 0.0

    @classmethod
    def of(
        cls,
        derivatives: Sequence[DesignDerivatives],
        weights: Sequence[float],
        scales: Sequence[np.ndarray],
        damping: float,
    ) -> LocalModel:
        """The model at evaluated designs.

        weights : of the designs;  scales : per design, sizes (nq,) of its parameters
        damping : mu, relative to the mean diagonal entry of the scaled Hessian
        """
        scaled = np.concatenate(
            [w * np.diagonal(d.model) * s**2 for d, w, s in zip(derivatives, weights, scales)]
        )
        curvature = float(np.abs(scaled).mean())
        mu = damping * curvature
        return cls(
            tuple(d.evaluation.q for d in derivatives),
            tuple(w * d.gradient for d, w in zip(derivatives, weights)),
            tuple(
                w * d.model + np.diag(mu / s**2) for d, w, s in zip(derivatives, weights, scales)
            ),
            1e-12 * curvature,
        )

    def values(self, q: Sequence[np.ndarray]) -> np.ndarray:
        """(n_designs,) m by design; zero at the base."""
        steps = [a - b for a, b in zip(q, self.base)]
        return np.array(
            [g @ r + 0.5 * r @ (h @ r) for g, h, r in zip(self.gradients, self.hessians, steps)]
        )

    def slopes(self, q: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Per design, the derivative (nq,) of m."""
        return [g + h @ (a - b) for g, h, a, b in zip(self.gradients, self.hessians, q, self.base)]


# Gives the variables (n_p + k,) of a problem new values under the model; None where the constraints
# can't be met.
MoveParts = Callable[["AssignedProblem", np.ndarray, LocalModel], "np.ndarray | None"]


@dataclass(frozen=True)
class Reassignment:
    """Another kit and assignment, the parameters of no element to go with them (k,), what the model
    promises of them by design, how many elements changed, and by how much the parts cost more."""

    kit: Kit
    assignment: Assignment
    free: np.ndarray
    predicted: np.ndarray
    changes: int
    cost: float = 0.0

    @property
    def total(self) -> float:
        """By how much J should change."""
        return float(self.predicted.sum() + self.cost)


def reassign(
    problem: AssignedProblem,
    model: LocalModel,
    frozen: Sequence[int] = (),
    move_parts: MoveParts | None = None,
) -> Reassignment | None:
    """Improve the assignment of a problem, and its parts, under the model.

    frozen : designs whose elements keep their parts
    move_parts : `best_parts` (the default) moves the parts along, `keep_parts` leaves them

    Where the problem has a stock, no more pieces are used than there are: elements take what is
    left, and exchange what they have; elements of kinds that realise intervals keep their parts
    then. Otherwise these get the part in which they have the best place. Where pieces cost, what is
    lowered is the model with the cost of the pieces to be made.
    Returns None where no element gains by another part, or the constraints can't be met with
    what it would get.
    """
    found = improved(problem, model, frozen, move_parts)
    return found if found is not None and found.changes else None


def improved(
    problem: AssignedProblem,
    model: LocalModel,
    frozen: Sequence[int] = (),
    move_parts: MoveParts | None = None,
) -> Reassignment | None:
    """As `reassign`, but also where no element gets another part; None where the constraints can't
    be met."""
    move_parts = move_parts or best_parts
    before, vector = problem.assignment, problem.variables(np.concatenate(model.base))
    start = value = _cost(problem, vector, model)
    paid = problem.cost(vector)
    current = problem
    for _ in range(_ROUNDS):
        changed, places = _sweep(current, vector, model, frozen)
        if changed is not None:
            current = problem.reassigned(changed)
            if len(current.sliding):
                vector = current.moved(vector, places)
        moved = move_parts(current, vector, model)
        if moved is None:
            return None
        vector, last = moved, value
        value = _cost(current, vector, model)
        if last - value <= max(_SETTLED * (start - value), model.rounding):
            break
    changes = current.assignment.changes(before)
    predicted = model.values(problem.dataset.split(current.matrix @ vector))
    return Reassignment(
        problem.kit_of(vector),
        current.assignment,
        problem.free_of(vector),
        predicted,
        changes,
        current.cost(vector) - paid,
    )


def _cost(problem: AssignedProblem, vector: np.ndarray, model: LocalModel) -> float:
    """The model's value, with the cost of pieces where they have one."""
    value = float(model.values(problem.dataset.split(problem.matrix @ vector)).sum())
    value += problem.cost(vector)
    if model.piece_cost:
        count = PieceCount(problem.kit, problem.assignment, problem.dataset.group_designs)
        value += model.piece_cost * count.fabricated
    return value


def _sweep(
    problem: AssignedProblem, vector: np.ndarray, model: LocalModel, frozen: Sequence[int]
) -> tuple[Assignment | None, np.ndarray]:
    """Give every element its best part, the parts staying as they are; None when all have theirs.
    And the elements (n_q,)."""
    dataset, kit = problem.dataset, problem.kit_of(vector)
    q = [part.copy() for part in dataset.split(problem.matrix @ vector)]
    slopes = model.slopes(q)
    parts, variants = list(problem.assignment.part), list(problem.assignment.variant)
    design_of = dataset.group_designs
    offsets = dataset.offsets
    stock, plenty = problem.stock, np.iinfo(np.int64).max // 2
    spare = None if stock is None else stock.spare(problem.assignment, design_of)
    count = None
    if model.piece_cost:
        count = PieceCount(kit, problem.assignment, design_of)
    changes = 0
    for number, (group, n) in enumerate(zip(problem.assignment.groups, design_of)):
        if n in frozen or len(group.indices) == 0:
            continue
        ways = part_kind(group.kind).variants_of(group.indices.shape[1])
        counting = None if count is None else Counting(count, group.kind, int(n))
        if ways.reach is not None:
            if stock is None:
                parts[number], variants[number], moved = descend_in_boxes(
                    (q[n], slopes[n], model.hessians[n]),
                    group.indices - offsets[n],
                    (ways, kit[group.kind]),
                    parts[number] * len(ways.names) + variants[number],
                    (model.rounding, model.piece_cost),
                    counting,
                )
                changes += moved
            continue
        candidates = np.einsum("vek,mk->mve", ways.matrices, kit[group.kind])
        n_ways = len(ways.names)
        choice = parts[number] * n_ways + variants[number]
        left = np.full(len(candidates), plenty) if spare is None else spare[number]
        elements = Descent(
            q[n],
            slopes[n],
            model.hessians[n],
            group.indices - offsets[n],
            candidates.reshape(-1, candidates.shape[2]),
            choice,
            model.rounding,
            n_ways,
        )
        if counting is not None and spare is None:
            changes += elements.descend_counted(counting, model.piece_cost)
        else:
            changes += elements.descend(left)
        while spare is not None and elements.exchange():
            changes += 1 + elements.descend(left)
        parts[number], variants[number] = choice // n_ways, choice % n_ways
    if not changes:
        return None, np.concatenate(q)
    return Assignment(
        problem.assignment.groups, tuple(parts), tuple(variants), problem.assignment.n_q
    ), np.concatenate(q)


def best_parts(
    problem: AssignedProblem, vector: np.ndarray, model: LocalModel, keep: bool = False
) -> np.ndarray | None:
    """(n_p + k,) the variables that minimise m(M x) and the parts' costs within bounds and
    constraints; None where these can't be met.

    keep : the parts stay as they are
    """
    rows = [
        problem.matrix[a:b] for a, b in zip(problem.dataset.offsets, problem.dataset.offsets[1:])
    ]
    slopes = model.slopes(problem.dataset.split(problem.matrix @ vector))
    gradient = sum(m.T @ s for m, s in zip(rows, slopes))
    hessian = sum(m.T @ (m.T @ h).T for m, h in zip(rows, model.hessians))
    hessian = 0.5 * (hessian + hessian.T)
    gradient, hessian = problem.with_costs(vector, gradient, hessian)
    limits, now = problem.constraints, problem.constraints.A @ vector
    lower, upper = problem.lower, problem.upper
    if keep:
        lower, upper = lower.copy(), upper.copy()
        of_parts = slice(len(problem.kit.vector))
        lower[of_parts] = upper[of_parts] = vector[of_parts]
    result = QPSolver(QPOptions(interior_point=len(problem.sliding) > 0)).solve(
        QP(
            sp.csc_matrix(hessian),
            gradient,
            limits.A,
            limits.lower - now,
            limits.upper - now,
            lower - vector,
            upper - vector,
        )
    )
    if result.status != "solved":
        return None if limits.rows else vector  # an indefinite model: the parts stay
    return np.clip(vector + result.x, lower, upper)


def keep_parts(
    problem: AssignedProblem, vector: np.ndarray, model: LocalModel
) -> np.ndarray | None:
    """(n_p + k,) the variables as they are, but for the places of elements that slide in their
    parts."""
    return best_parts(problem, vector, model, keep=True) if len(problem.sliding) else vector
