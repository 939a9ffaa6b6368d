"""The two optimisation problems: over all elements, drawn to the kit (relaxed), and over the kit
alone (assigned)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from ..kit.kinds import Bounds
from ..kit.part_costs import PartCosts
from ..kit.parts import Assignment, Kit
from ..kit.projection import Projection
from ..kit.stock import Stock
from ..sqp.constraints import LinearConstraints
from ..sqp.problem import Derivatives, Inequalities, Point
from .dataset import Dataset
from .evaluation import DesignDerivatives, Evaluation
from .kit_rule import KitRule, SoughtKit
from .sliding import limit_rows, stacked

# of the mean curvature: what holds parts that act by their limits alone
_HELD = 1e-4


@dataclass(frozen=True)
class DatasetPoint:
    """What the problems keep with a point.

    evaluations : of all designs; converged to round-off once derivatives were taken there
    solved : of all designs, as they were found first: a resumed run refines and goes on from the
        same states
    kit, assignment : nearest to the point (relaxed), or that the point is made of (assigned)
    terms : the objective's terms by name, summed over designs
    bounds : design and state of every bound that came near to being met with, once derivatives are
        taken there
    """

    evaluations: list[Evaluation]
    kit: Kit
    assignment: Assignment
    terms: dict[str, float]
    solved: list[Evaluation]
    bounds: list[tuple[str, str]] = field(default_factory=list)

    def refined(
        self, designs: Sequence[DesignDerivatives], bounds: list[tuple[str, str]]
    ) -> DatasetPoint:
        """The same with the evaluations at which derivatives were taken, and the bounds there."""
        return replace(self, evaluations=[d.evaluation for d in designs], bounds=bounds)


class RelaxedProblem:
    """J(q) = sum F(q) + P(q) over the parameters q of all elements; the kit follows q.

    constraints : on q, besides its bounds
    rule : whether the kit follows the elements or is given
    """

    def __init__(
        self,
        dataset: Dataset,
        projection: Projection,
        kit: Kit,
        bounds: Bounds | None = None,
        constraints: LinearConstraints | None = None,
        rule: KitRule | None = None,
    ):
        self.dataset, self.projection, self.kit = dataset, projection, kit
        self.rule: KitRule = rule if rule is not None else SoughtKit(kit.sizes)
        self.lower, self.upper = dataset.bounds(bounds)
        self.n = len(self.lower)
        self.constraints = (
            constraints if constraints is not None else LinearConstraints.none(self.n)
        )
        self.scale = dataset.scales()
        self.block_sizes = tuple(np.diff(dataset.offsets).tolist())

    def evaluate(self, x: np.ndarray, previous: Point | None) -> Point:
        before: DatasetPoint | None = previous.data if previous is not None else None
        evaluations = self.dataset.evaluate(x, before.evaluations if before else None)
        return self.point(x, evaluations, before.kit if before else self.kit)

    def point(self, x: np.ndarray, evaluations: list[Evaluation], kit: Kit) -> Point:
        """The point of given evaluations, its kit found from a nearby one."""
        nearest = self.rule.nearest(self.projection, x, kit)
        terms = _sum_terms(self.dataset, evaluations) | {"projection": nearest.energy}
        value = self.dataset.value(evaluations) + nearest.energy
        data = DatasetPoint(evaluations, nearest.kit, nearest.assignment, terms, evaluations)
        return Point(x, value, data, _excess(evaluations))

    def completed(self, point: Point, previous: Point) -> Point:
        """The point with the states on its designs' ways from the assembly, where those of the
        previous one are known. Raises SimulationFailure where a way breaks."""
        evaluations = self.dataset.completed(point.data.evaluations, previous.data.evaluations)
        return self.point(point.x, evaluations, point.data.kit)

    def derivatives(self, point: Point) -> Derivatives:
        data: DatasetPoint = point.data
        designs = self.dataset.derivatives(data.evaluations, hessian=True)
        names, bounds = _bounds(self.dataset, designs)
        refined = replace(point, data=data.refined(designs, names))
        weights = self.dataset.design_weights
        own = np.concatenate([w * d.gradient for w, d in zip(weights, designs)])
        gradient = own + self.projection.gradient(point.x, data.kit, data.assignment)
        hessian = sp.block_diag([w * d.model for w, d in zip(weights, designs)], format="csc")
        quadratic = self.projection.hessian(point.x, data.kit, data.assignment)
        added, extra = self.rule.model(quadratic)
        if extra is None:
            whole = hessian if added is None else sp.csc_matrix(hessian + added)
            return Derivatives(gradient, whole, inequalities=bounds, point=refined)
        return Derivatives(gradient, hessian, extra, own, bounds, refined)

    def first_derivatives(self, point: Point) -> Derivatives:
        """The gradient alone: one adjoint solve a state instead of all sensitivities."""
        data: DatasetPoint = point.data
        designs = self.dataset.derivatives(data.evaluations, hessian=False)
        names, bounds = _bounds(self.dataset, designs)
        refined = replace(point, data=data.refined(designs, names))
        own = np.concatenate([w * d.gradient for w, d in zip(self.dataset.design_weights, designs)])
        gradient = own + self.projection.gradient(point.x, data.kit, data.assignment)
        return Derivatives(gradient, inequalities=bounds, point=refined)


class AssignedProblem:
    """J(x) = sum F(M x) + C(p) over x = (p, y): the parts p, every element being its part, and the
    parameters y of no element.

    The assignment is fixed. M (n_q, n_p + k) is the assignment's for the parts, and puts y in its
    places. The elements of parts that realise intervals are among y as well, and kept within their
    parts by linear rows (see sliding.py).
    constraints : on the elements q = M p, as in `RelaxedProblem`
    stock : pieces of which the elements may be made; default: of each part as many as needed
    costs : C, of the parts themselves
    parts_move : False: only y are sought
    """

    def __init__(
        self,
        dataset: Dataset,
        kit: Kit,
        assignment: Assignment,
        bounds: Bounds | None = None,
        constraints: LinearConstraints | None = None,
        stock: Stock | None = None,
        costs: PartCosts = PartCosts(),
        parts_move: bool = True,
    ):
        self.dataset, self.kit, self.assignment = dataset, kit, assignment
        self.part_bounds, self.of_elements, self.stock = bounds, constraints, stock
        self.costs, self.parts_move = costs, parts_move
        self._free, self._n_parts = dataset.free, len(kit.vector)
        self.sliding = dataset.sliding
        places = sp.csr_matrix(
            (np.ones(len(self._free)), (self._free, np.arange(len(self._free)))),
            shape=(assignment.n_q, len(self._free)),
        )
        self.matrix = sp.csr_matrix(sp.hstack([self._fixed_rows(), places]))
        unlimited = np.full(len(self._free), np.inf)
        self.lower, self.upper = (
            np.append(side, sign * unlimited) for side, sign in zip(kit.bounds(bounds), (-1, 1))
        )
        self._limit_by_designs()
        self.n = len(self.lower)
        self.constraints = (
            constraints.through(self.matrix)
            if constraints is not None
            else LinearConstraints.none(self.n)
        )
        if len(self.sliding):
            rows = limit_rows(assignment, kit, self.sliding, self.n, parts_move, self.part_bounds)
            self.constraints = stacked(self.constraints, rows)
            if not parts_move:
                p = kit.vector
                self.lower[: len(p)] = self.upper[: len(p)] = p
        self.scale = self._scale()

    def reassigned(self, assignment: Assignment) -> AssignedProblem:
        """The same problem with other parts for the elements."""
        return AssignedProblem(
            self.dataset,
            self.kit,
            assignment,
            self.part_bounds,
            self.of_elements,
            self.stock,
            self.costs,
            self.parts_move,
        )

    def variables(self, q: np.ndarray) -> np.ndarray:
        """x of the problem's kit, with the parameters of no element as they are in q (n_q,), and
        those of elements in intervals as near to q as their parts allow."""
        if len(self.sliding):
            q = self.assignment.realise(self.kit, q)
        return np.append(self.kit.vector, q[self._free])

    def moved(self, vector: np.ndarray, q: np.ndarray) -> np.ndarray:
        """x of the same parts as in `vector` (n_p + k,), the other variables as in q (n_q,)."""
        return np.append(vector[: self._n_parts], q[self._free])

    def cost(self, vector: np.ndarray) -> float:
        """What the parts in x cost."""
        return self.costs.value(self.kit_of(vector)) if self.costs.weights else 0.0

    def with_costs(
        self, vector: np.ndarray, gradient: np.ndarray, hessian: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Gradient (n,) and Hessian (n, n) of the designs' objective, with those of the parts'
        costs, and a curvature for every variable."""
        if self.costs.weights:
            own, n = self.costs.curvature(self.kit), self._n_parts
            gradient[:n] += own * vector[:n]
            hessian[np.arange(n), np.arange(n)] += own
        unused = np.flatnonzero(np.abs(hessian).sum(axis=1) == 0)
        # parts that nothing uses stay where they are, those that elements slide in follow these
        curvature = np.abs(hessian.diagonal()).mean()
        touched = np.zeros(self.n, dtype=bool)
        if len(self.sliding):
            touched[np.unique(self.constraints.A.indices)] = True
        hessian[unused, unused] = np.where(touched[unused], _HELD, 1.0) * curvature
        return gradient, hessian

    def kit_of(self, x: np.ndarray) -> Kit:
        """The parts in x."""
        return self.kit.with_vector(x[: self._n_parts])

    def free_of(self, x: np.ndarray) -> np.ndarray:
        """The parameters of no element in x."""
        return x[self._n_parts :]

    def evaluate(self, x: np.ndarray, previous: Point | None) -> Point:
        before: DatasetPoint | None = previous.data if previous is not None else None
        return self.point(
            x, self.dataset.evaluate(self.matrix @ x, before.evaluations if before else None)
        )

    def point(self, x: np.ndarray, evaluations: list[Evaluation]) -> Point:
        """The point of given evaluations."""
        terms = _sum_terms(self.dataset, evaluations)
        kit = self.kit_of(x)
        value = self.dataset.value(evaluations)
        if self.costs.weights:
            terms["part cost"] = self.costs.value(kit)
            value += terms["part cost"]
        data = DatasetPoint(evaluations, kit, self.assignment, terms, evaluations)
        return Point(x, value, data, _excess(evaluations))

    def completed(self, point: Point, previous: Point) -> Point:
        """As in `RelaxedProblem`."""
        evaluations = self.dataset.completed(point.data.evaluations, previous.data.evaluations)
        return self.point(point.x, evaluations)

    def derivatives(self, point: Point) -> Derivatives:
        data: DatasetPoint = point.data
        designs = self.dataset.derivatives(data.evaluations, hessian=True)
        names, bounds = _bounds(self.dataset, designs, self.matrix)
        refined = replace(point, data=data.refined(designs, names))
        gradient, hessian = np.zeros(self.n), np.zeros((self.n, self.n))
        for weight, d, start, end in zip(
            self.dataset.design_weights, designs, self.dataset.offsets, self.dataset.offsets[1:]
        ):
            rows = self.matrix[start:end]
            gradient += weight * (rows.T @ d.gradient)
            hessian += weight * (rows.T @ (rows.T @ d.model.T).T)
        gradient, hessian = self.with_costs(point.x, gradient, hessian)
        return Derivatives(gradient, sp.csc_matrix(hessian), inequalities=bounds, point=refined)

    def first_derivatives(self, point: Point) -> Derivatives:
        """The gradient alone, as in `RelaxedProblem`."""
        data: DatasetPoint = point.data
        designs = self.dataset.derivatives(data.evaluations, hessian=False)
        names, bounds = _bounds(self.dataset, designs, self.matrix)
        refined = replace(point, data=data.refined(designs, names))
        weighted = np.concatenate(
            [w * d.gradient for w, d in zip(self.dataset.design_weights, designs)]
        )
        gradient = self.matrix.T @ weighted
        if self.costs.weights:
            p = data.kit.vector
            gradient[: len(p)] += self.costs.curvature(self.kit) * p
        return Derivatives(gradient, inequalities=bounds, point=refined)

    def _fixed_rows(self) -> sp.csr_array:
        """(n_q, n_p) the elements that are their parts, without those that slide in them."""
        matrix = self.assignment.matrix(self.kit)
        if not len(self.sliding):
            return matrix
        kept = np.ones(self.assignment.n_q)
        kept[self.sliding] = 0.0
        found = sp.csr_array(sp.dia_array((kept[None], [0]), shape=(len(kept),) * 2) @ matrix)
        found.eliminate_zeros()
        return found

    def _limit_by_designs(self) -> None:
        """An element's own bounds are its part's: entries of M are +-1, one a row."""
        lower, upper = self.dataset.bounds(None)
        rows = self.matrix.tocoo()
        for row, part, sign in zip(rows.row, rows.col, rows.data):
            low, high = (lower[row], upper[row]) if sign > 0 else (-upper[row], -lower[row])
            self.lower[part] = max(self.lower[part], low)
            self.upper[part] = min(self.upper[part], high)

    def _scale(self) -> np.ndarray:
        """A part's scale is that of the elements it serves."""
        scale = np.zeros(self.n)
        rows = self.matrix.tocoo()
        scales = self.dataset.scales()
        np.maximum.at(scale, rows.col, scales[rows.row])
        if len(self.sliding):
            upper = self.assignment.matrix(self.kit, upper=True).tocoo()
            np.maximum.at(scale, upper.col, scales[upper.row])
        return np.where(scale > 0, scale, 1.0)


def _excess(evaluations: Sequence[Evaluation]) -> np.ndarray:
    """By how much the bounds of all designs' states are exceeded."""
    return np.array([excess for e in evaluations for excess in e.excess.values()])


def _bounds(
    dataset: Dataset, designs: Sequence[DesignDerivatives], matrix: sp.csr_matrix | None = None
) -> tuple[list[tuple[str, str]], Inequalities | None]:
    """Design and state of every bound with rows, and all rows in the variables.

    matrix : (n_q, n) derivative of the designs' parameters in the variables, default: the same
    """
    n_q = int(dataset.offsets[-1])
    names: list[tuple[str, str]] = []
    values, rows, number = [], [], []
    for n, (design, found) in enumerate(zip(dataset.designs, designs)):
        for state, bound in found.bounds.items():
            wide = sp.csr_matrix(bound.jacobian)
            wide.indices += int(dataset.offsets[n])
            wide = sp.csr_matrix((wide.data, wide.indices, wide.indptr), (len(bound.value), n_q))
            rows.append(wide if matrix is None else wide @ matrix)
            values.append(bound.value)
            number += [len(names)] * len(bound.value)
            names.append((design.name, state))
    if not names:
        return names, None
    jacobian = sp.csr_matrix(sp.vstack(rows))
    return names, Inequalities(np.concatenate(values), jacobian, np.array(number))


def _sum_terms(dataset: Dataset, evaluations: list[Evaluation]) -> dict[str, float]:
    total: dict[str, float] = {}
    for weight, evaluation in zip(dataset.design_weights, evaluations):
        for name, value in evaluation.terms.items():
            total[name] = total.get(name, 0.0) + float(weight * value)
    return total
