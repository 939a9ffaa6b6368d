"""What the SQP solver asks of a problem: values, derivatives at accepted points, bounds and linear
constraints."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import scipy.sparse as sp

from ..errors import InputError
from .constraints import LinearConstraints


@dataclass(frozen=True)
class Point:
    """An evaluated point: x (n,), the objective there, and whatever the problem keeps with it
    (equilibria).

    excess : (k,) by how much each of the problem's nonlinear bounds is exceeded, not negative; see
        `Inequalities`
    """

    x: np.ndarray
    value: float
    data: Any = None
    excess: np.ndarray = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class LiftedTerm:
    """A convex part of the model Hessian that is sparse once k extra unknowns dp are kept.

    It adds the minimum over dp of 1/2 [dq; dp]^T [[qq, qp], [qp^T, pp]] [dq; dp] to the model. For
    the projection energy dp are the part parameters: eliminated, they would couple all elements of
    a cluster densely. The matrix has to be positive semidefinite and pp positive definite; the
    objective is at its minimum over p, so that there is no gradient in dp.
    """

    qq: sp.csc_matrix
    qp: sp.csc_matrix
    pp: sp.csc_matrix


@dataclass(frozen=True)
class Inequalities:
    """Nonlinear bounds, linearised at a point: value + jacobian dx <= 0 in every row.

    A bound says that the largest of several functions stays below zero (stresses in the elements of
    one state, say). Its rows are those of these functions that may become the largest; a bound that
    is far from being met with has none.

    value : (m,);  jacobian : (m, n);  bound : (m,) int, the bound that each row belongs to, a place
        in `Point.excess`
    """

    value: np.ndarray
    jacobian: sp.csr_matrix
    bound: np.ndarray

    @property
    def rows(self) -> int:
        return len(self.value)


@dataclass(frozen=True)
class Derivatives:
    """Derivatives at a point.

    gradient : (n,)
    hessian : (n, n) sparse symmetric, both triangles, perhaps indefinite; None for quasi-Newton use
    extra : see LiftedTerm; comes on top of ``hessian``
    own_gradient : (n,) gradient of the part that ``hessian`` belongs to, without the lifted term's
        (default: all)
    inequalities : linearised nonlinear bounds, where the problem has any
    point : the point that they were taken at, where the problem improved on the one it was given
        (states confirmed or refined); it takes that one's place
    """

    gradient: np.ndarray
    hessian: sp.csc_matrix | None = None
    extra: LiftedTerm | None = None
    own_gradient: np.ndarray | None = None
    inequalities: Inequalities | None = None
    point: Point | None = None


class Problem(Protocol):
    """min f(x) with lower <= x <= upper and linear constraints.

    Nonlinear bounds are kept by an exact penalty: points carry their excess, derivatives the
    linearised bounds. What is only worth computing for points that would be accepted (and may still
    refuse them, by SimulationFailure) goes into ``completed(point, previous)``, which a problem may
    have.

    A problem may also have ``scale`` (n,), the typical change of each variable (default 1), in
    which steps and gradients are measured, and ``block_sizes``, the sizes of the consecutive groups
    of variables that f couples only among themselves apart from its lifted term (default: one block
    for BFGS, connected components for a Hessian).
    """

    n: int
    lower: np.ndarray
    upper: np.ndarray
    constraints: LinearConstraints

    def evaluate(self, x: np.ndarray, previous: Point | None) -> Point:
        """The objective at x; ``previous`` is the last accepted point, to start from. May raise
        SimulationFailure."""

    def derivatives(self, point: Point) -> Derivatives:
        """Derivatives at an accepted point. `first_derivatives`, which a problem may have, gives
        the gradient alone."""


def scale_of(problem: Problem) -> np.ndarray:
    """The problem's scale (n,), ones by default. Raises InputError where an entry is not positive
    and finite."""
    scale = getattr(problem, "scale", None)
    if scale is None:
        return np.ones(problem.n)
    scale = np.asarray(scale, dtype=float)
    if scale.shape != (problem.n,):
        raise InputError(f"has the shape {scale.shape}, expected ({problem.n},)", field="scale")
    wrong = ~(np.isfinite(scale) & (scale > 0))
    if wrong.any():
        i = int(np.argmax(wrong))
        raise InputError("must be positive and finite", field=f"scale[{i}]", value=float(scale[i]))
    return scale


def block_sizes_of(problem: Problem) -> tuple[int, ...]:
    """The problem's block sizes, one block by default. Raises InputError where they do not add up
    to n."""
    sizes = getattr(problem, "block_sizes", None)
    if sizes is None:
        return (problem.n,)
    sizes = tuple(int(size) for size in sizes)
    if sum(sizes) != problem.n or any(size <= 0 for size in sizes):
        raise InputError(
            f"must be positive and add up to {problem.n}", field="block_sizes", value=sizes
        )
    return sizes
