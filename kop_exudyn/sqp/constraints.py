"""Linear constraints lower <= A x <= upper and bounds: checked, read from cvxpy expressions, shown
infeasible."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.optimize import linprog

from ..errors import InputError

# smallest violation that counts, relative to the largest limit (the tolerance of HiGHS)
_INFEASIBLE = 1e-7
_MAX_NAMED = 6  # limits that an error message lists


@dataclass(frozen=True)
class LinearConstraints:
    """The rows lower <= A x <= upper.

    Parameters
    ----------
    A : (m, n) sparse matrix, kept in csr form
    lower, upper : (m,) limits, infinite where a side is free and equal for an equation
    names : what error messages call the rows; ``constraint i`` where left out

    Raises InputError for shapes that do not match, NaN, or a lower limit above its upper limit.
    """

    A: sp.csr_matrix
    lower: np.ndarray
    upper: np.ndarray
    names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        matrix = sp.csr_matrix(self.A, dtype=float)
        if not np.all(np.isfinite(matrix.data)):
            raise InputError("has entries that are not finite", field="constraints.A")
        lower, upper = validate_bounds(self.lower, self.upper, matrix.shape[0], field="constraints")
        names = tuple(self.names) or tuple(f"constraint {i}" for i in range(matrix.shape[0]))
        if len(names) != matrix.shape[0]:
            raise InputError(
                f"has {len(names)} entries for {matrix.shape[0]} rows", field="constraints.names"
            )
        for name, value in (("A", matrix), ("lower", lower), ("upper", upper), ("names", names)):
            object.__setattr__(self, name, value)

    @classmethod
    def none(cls, n: int) -> LinearConstraints:
        """No constraint on n variables."""
        return cls(sp.csr_matrix((0, n)), np.zeros(0), np.zeros(0))

    @property
    def rows(self) -> int:
        """The number of constraints m."""
        return self.A.shape[0]

    def violation(self, x: np.ndarray) -> float:
        """The largest distance of A x from its limits; 0 when all of them hold."""
        if not self.rows:
            return 0.0
        value = self.A @ x
        return float(max(0.0, np.max(self.lower - value), np.max(value - self.upper)))

    def through(self, matrix: sp.csr_matrix) -> LinearConstraints:
        """The same constraints on p, where x = M p for a matrix M (n, k)."""
        return LinearConstraints(sp.csr_matrix(self.A @ matrix), self.lower, self.upper, self.names)

    def among(self, kept: np.ndarray) -> LinearConstraints:
        """The constraints that concern no other variables than those at the positions `kept` (k,),
        on these alone."""
        outside = np.ones(self.A.shape[1], dtype=bool)
        outside[kept] = False
        rows = np.flatnonzero(abs(self.A) @ outside == 0)
        return LinearConstraints(
            self.A[rows][:, kept],
            self.lower[rows],
            self.upper[rows],
            tuple(self.names[row] for row in rows),
        )


def on_elements(
    designs: Sequence[Any], statement: Callable[[Mapping[str, Any]], Sequence[Any]]
) -> LinearConstraints:
    """Constraints on the elements of several designs, stated in cvxpy.

    designs : in the order of the run; anything with a `name` and `parameters` (nq,)
    statement : called with design name -> cvxpy expression (nq,) of its parameters (which of them
        are the elements of a kind, `design.groups` tells); returns affine equations and
        inequalities, which may couple designs

    Raises InputError, naming the constraint, for what isn't linear, and where no parameters can
    meet all of them.

        on_elements(designs, lambda q: [cp.sum(q["vault"][:12]) == 3.0, q["vault"][0] ==
        q["dome"][0]])
    """
    import cvxpy as cp

    for design in designs:
        if not (hasattr(design, "name") and hasattr(design, "parameters")):
            raise InputError("expected designs", field="designs", value=type(design).__name__)
    offsets = np.cumsum([0, *(len(design.parameters) for design in designs)])
    variable = cp.Variable(int(offsets[-1]), name="q")
    parts = _Named((d.name, variable[a:b]) for d, a, b in zip(designs, offsets, offsets[1:]))
    stated = statement(parts)
    if not isinstance(stated, Sequence):
        raise InputError(
            "expected a function that returns a list of constraints",
            field="statement",
            value=type(stated).__name__,
        )
    found = from_cvxpy(stated, variable)
    free = np.full(variable.size, np.inf)
    check_feasible(-free, free, found)
    return found


class _Named(dict[str, Any]):
    """The designs' parameters; a name that isn't there is the caller's error."""

    def __missing__(self, name: str) -> Any:
        raise InputError(
            f"no such design (known: {', '.join(self)})", field="statement", value=name
        )


def validate_bounds(
    lower: Any, upper: Any, n: int, field: str = "bounds"
) -> tuple[np.ndarray, np.ndarray]:
    """Bounds as two new (n,) arrays; scalars serve all entries.

    Raises InputError naming the first entry that is NaN, on the wrong side of infinity, or has
    lower > upper.
    """
    result = []
    for side, value in (("lower", lower), ("upper", upper)):
        try:
            array = np.asarray(value, dtype=float)
        except (TypeError, ValueError):
            raise InputError(
                "expected numbers", field=f"{field}.{side}", value=type(value).__name__
            ) from None
        if array.shape not in ((), (n,)):
            raise InputError(
                f"has the shape {array.shape}, expected ({n},)", field=f"{field}.{side}"
            )
        array = np.array(np.broadcast_to(array, (n,)))
        unusable = np.isnan(array) | (array == (np.inf if side == "lower" else -np.inf))
        if unusable.any():
            i = int(np.argmax(unusable))
            raise InputError(
                "is not a usable bound", field=f"{field}.{side}[{i}]", value=float(array[i])
            )
        result.append(array)
    crossed = result[0] > result[1]
    if crossed.any():
        i = int(np.argmax(crossed))
        message = f"lies above its upper bound {float(result[1][i])!r}"
        raise InputError(message, field=f"{field}.lower[{i}]", value=float(result[0][i]))
    return result[0], result[1]


def check_feasible(lower: np.ndarray, upper: np.ndarray, constraints: LinearConstraints) -> None:
    """Raise InputError, naming the limits that exclude each other, unless some x meets bounds and
    constraints."""
    feasible_point(lower, upper, constraints)


def feasible_point(
    lower: np.ndarray, upper: np.ndarray, constraints: LinearConstraints
) -> np.ndarray:
    """A point (n,) within bounds and constraints, by phase one of a linear programme.

    Minimises the largest violation t of the normalised rows. When t stays positive, the limits with
    nonzero multipliers form a Farkas certificate: together they exclude each other, and InputError
    names them.
    """
    n = constraints.A.shape[1]
    lower, upper = validate_bounds(lower, upper, n)
    if not constraints.rows:
        return np.clip(np.zeros(n), lower, upper)
    matrix, limits, origin = _one_sided(constraints)
    cost = np.append(np.zeros(n), 1.0)
    rows = sp.hstack([matrix, -np.ones((matrix.shape[0], 1))], format="csr")
    result = linprog(
        cost, A_ub=rows, b_ub=limits, bounds=np.c_[np.append(lower, 0.0), np.append(upper, np.inf)]
    )
    if result.x is None:
        raise InputError(
            f"could not be checked for a feasible point: {result.message}", field="constraints"
        )
    if result.fun > _INFEASIBLE * max(1.0, float(np.max(np.abs(limits), initial=0.0))):
        raise InputError(
            _certificate(result, lower, upper, constraints, origin), field="constraints"
        )
    return np.clip(result.x[:n], lower, upper)


def _one_sided(
    constraints: LinearConstraints,
) -> tuple[sp.csr_matrix, np.ndarray, list[tuple[int, str]]]:
    """Rows a.x <= b of unit norm, with the constraint and side that each comes from."""
    norms = np.sqrt(np.asarray(constraints.A.multiply(constraints.A).sum(axis=1)).ravel())
    norms[norms == 0] = 1.0
    scaled = sp.diags(1 / norms) @ constraints.A
    above, below = np.isfinite(constraints.upper), np.isfinite(constraints.lower)
    matrix = sp.vstack([scaled[above], -scaled[below]], format="csr")
    limits = np.concatenate(
        [(constraints.upper / norms)[above], -(constraints.lower / norms)[below]]
    )
    origin = [(int(i), "upper") for i in np.flatnonzero(above)] + [
        (int(i), "lower") for i in np.flatnonzero(below)
    ]
    return matrix, limits, origin


def _certificate(
    result: Any,
    lower: np.ndarray,
    upper: np.ndarray,
    constraints: LinearConstraints,
    origin: list[tuple[int, str]],
) -> str:
    """The limits that exclude each other, from the multipliers of phase one."""
    found = []
    for k in np.flatnonzero(np.abs(result.ineqlin.marginals) > 1e-9):
        row, side = origin[k]
        sign, limit = (
            ("<=", constraints.upper[row]) if side == "upper" else (">=", constraints.lower[row])
        )
        found.append(f"{constraints.names[row]} ({sign} {limit:g})")
    n = lower.size
    for i in np.flatnonzero(np.abs(result.lower.marginals[:n]) > 1e-9):
        found.append(f"x[{i}] >= {lower[i]:g}")
    for i in np.flatnonzero(np.abs(result.upper.marginals[:n]) > 1e-9):
        found.append(f"x[{i}] <= {upper[i]:g}")
    more = f" and {len(found) - _MAX_NAMED} more" if len(found) > _MAX_NAMED else ""
    return f"these limits exclude each other: {', '.join(found[:_MAX_NAMED])}{more}"


def from_cvxpy(constraints: Sequence[Any], variable: Any) -> LinearConstraints:
    """The rows of affine cvxpy constraints on one vector variable.

    Parameters
    ----------
    constraints : cvxpy equations and inequalities; affine expressions of any nesting; parameters
        must have values
    variable : the cvxpy Variable (n,) without attributes (state ``nonneg`` and the like as bounds
        or constraints)

    Raises InputError, naming the constraint, where one is not affine, has another variable or no
    usable value.
    """
    import cvxpy as cp

    _check_variable(variable, cp)
    blocks, lower, upper, names = [], [], [], []
    kept_value = variable.value
    try:
        variable.value = np.zeros(variable.shape)
        for i, constraint in enumerate(constraints):
            name = f"constraints[{i}]"
            matrix, offset, equation = _affine_rows(constraint, variable, name, cp)
            blocks.append(matrix)
            upper.append(-offset)
            lower.append(-offset if equation else np.full(offset.size, -np.inf))
            names += [name] if offset.size == 1 else [f"{name} row {k}" for k in range(offset.size)]
    finally:
        variable.value = kept_value
    if not blocks:
        return LinearConstraints.none(variable.size)
    matrix = sp.vstack(blocks, format="csr")
    return LinearConstraints(matrix, np.concatenate(lower), np.concatenate(upper), tuple(names))


def _check_variable(variable: Any, cp: Any) -> None:
    if not isinstance(variable, cp.Variable) or variable.ndim != 1:
        raise InputError("must be a cvxpy Variable with one axis", field="variable", value=variable)
    restricting = [
        name
        for name, value in variable.attributes.items()
        if value is not None and value is not False
    ]
    if restricting:
        message = f"has the attribute {restricting[0]}: state it as a bound or a constraint instead"
        raise InputError(message, field="variable", value=variable)


def _affine_rows(
    constraint: Any, variable: Any, name: str, cp: Any
) -> tuple[sp.csr_matrix, np.ndarray, bool]:
    """The matrix G (k, n) and offset h (k,) of one constraint G x + h <= 0 or = 0, at
    variable.value = 0."""
    equations = (cp.constraints.Equality, cp.constraints.Zero)
    inequalities = (cp.constraints.Inequality, cp.constraints.NonPos, cp.constraints.NonNeg)
    if not isinstance(constraint, equations + inequalities):
        raise InputError(
            "is not a linear equation or inequality in cvxpy", field=name, value=constraint
        )
    expression = (
        constraint.args[0] if isinstance(constraint, cp.constraints.NonNeg) else constraint.expr
    )
    if not expression.is_affine():
        raise InputError("is not affine", field=name, value=constraint)
    foreign = [v for v in expression.variables() if v.id != variable.id]
    if foreign:
        message = (
            f"contains the unknown variable {foreign[0].name()}; "
            f"only {variable.name()} is optimised"
        )
        raise InputError(message, field=name, value=constraint)
    if any(parameter.value is None for parameter in expression.parameters()):
        raise InputError("contains a parameter without a value", field=name, value=constraint)
    offset = expression.value
    offset = np.asarray(offset.toarray() if sp.issparse(offset) else offset, dtype=float).ravel(
        order="F"
    )
    gradient = expression.grad.get(variable) if expression.variables() else None
    matrix = (
        sp.csr_matrix((offset.size, variable.size))
        if gradient is None
        else _as_rows(gradient, variable.size)
    )
    if not (np.all(np.isfinite(offset)) and np.all(np.isfinite(matrix.data))):
        raise InputError("has coefficients that are not finite", field=name, value=constraint)
    if isinstance(constraint, cp.constraints.NonNeg):
        matrix, offset = -matrix, -offset
    return matrix, offset, isinstance(constraint, equations)


def _as_rows(gradient: Any, n: int) -> sp.csr_matrix:
    """cvxpy's gradient (n, k), column-major in the entries of the expression, as (k, n); a scalar
    for n = k = 1."""
    if not sp.issparse(gradient):
        gradient = np.asarray(gradient, dtype=float).reshape(n, -1)
    return sp.csr_matrix(gradient.T)
