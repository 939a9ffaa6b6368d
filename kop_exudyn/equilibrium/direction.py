"""Newton directions of a scene with or without the mean-angle equation, convexified where they have
to be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import SimulationFailure
from .system import System

# of the median rotational stiffness; a soft mode of a large structure is about that soft
_SHIFT_START = 1e-6
_SHIFT_GROWTH = 8.0
# Just enough of a shift leaves the softest mode so soft that the step overshoots along it: released
# umbrella meshes then take 60 to 80 iterations, with the margin 25 to 50. Flat starts of actuated
# scenes have to leave along that mode.
_SHIFT_MARGIN = 4.0
_MAX_SHIFTS = 40


@dataclass(frozen=True)
class Border:
    """The constraint seen through the factorised matrix: K^-1 c and c.K^-1 c.

    number : of the factorisation, as `System.number`; a border serves that one alone
    """

    column: np.ndarray
    schur: float
    number: int = 0


def factorise_convex(system: System, shift: float = 0.0) -> tuple[float, Border | None]:
    """Factorise K + shift M with a shift that makes it positive definite on the constraint's
    kernel.

    The given shift is kept if it does, otherwise the smallest one tried that does is taken, times a
    margin in scenes without actuation. Returns the shift that was used and the border (None without
    actuation).
    """
    base, most = None, 0 if system.constraint is None else 1  # with more it can't be convex
    for _ in range(_MAX_SHIFTS):
        negative = system.factorise(shift, most)
        border = border_of(system) if negative <= 1 and system.constraint is not None else None
        if is_convex(negative, border):
            if base is not None and system.constraint is None:
                shift *= _SHIFT_MARGIN
                system.factorise(shift)
            return shift, border
        if base is None:
            base = shift_unit(system)
        shift = max(_SHIFT_GROWTH * shift, base)
    raise SimulationFailure("no shift makes the stiffness positive definite")


def shift_unit(system: System) -> float:
    """The smallest shift that is worth trying."""
    rotational = np.abs(system.values[system.sparsity.diagonal][system.is_rotation])
    return _SHIFT_START * float(np.median(rotational))


def border_of(system: System) -> Border | None:
    """K^-1 c with the factorisation at hand, or None without actuation."""
    if system.constraint is None:
        return None
    if system.singular:
        return Border(np.full(system.n_unknowns, np.nan), 0.0, system.number)
    column = system.solve_constraint()
    return Border(column, float(system.constraint @ column), system.number)


def is_convex(negative: int, border: Border | None) -> bool:
    """Whether K is positive definite on the constraint's kernel, given its non-positive pivots.

    The bordered matrix [[K, c], [c^T, 0]] has the inertia of K plus the sign of -c.K^-1 c; K is
    positive definite on the kernel of c exactly when the bordered matrix has one negative
    eigenvalue (Haynsworth; Gould 1985).
    """
    if border is None:
        return negative == 0
    return (negative == 0 and border.schur > 0) or (negative == 1 and border.schur < 0)


def bordered_solve(
    system: System, border: Border | None, rhs: np.ndarray, gap: float | np.ndarray = 0.0
) -> tuple[np.ndarray, np.ndarray | float]:
    """Solve K d + c t = rhs, c.d = gap; rhs (n,) or (n, k), gap scalar or (k,). Returns d and t (0
    without border). Raises RuntimeError for a border of another factorisation than the one at
    hand."""
    if border is not None and border.number != system.number:
        raise RuntimeError("the border belongs to an earlier factorisation; see border_of")
    d = system.solve(rhs)
    if border is None:
        return d, 0.0
    multiplier = (system.constraint @ d - gap) / border.schur
    if d.ndim == 1:
        return d - border.column * multiplier, multiplier
    return d - border.column[:, None] * multiplier, multiplier
