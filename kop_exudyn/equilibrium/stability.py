"""How stable an equilibrium is: the softest mode and its eigenvalue."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .direction import Border, bordered_solve, factorise_convex
from .equilibria import Equilibrium
from .system import System

_ROUNDING = 1e3


@dataclass(frozen=True)
class SoftestMode:
    """eigenvalue : energy / rad^2 (negative: unstable); vector : (n_free,), largest rotation 1
    rad."""

    eigenvalue: float
    vector: np.ndarray


def softest_mode(system: System, equilibrium: Equilibrium | None = None) -> SoftestMode:
    """Lowest eigenvalue of K v = lambda M v on the actuation's kernel.

    equilibrium : where the Hessian is taken; default: whatever state was assembled last

    M is the system's metric (1 for rotations, 1 / length_scale^2 for translations), so the
    eigenvalue is an energy and doesn't depend on the unit of length. Shift-and-invert Lanczos;
    leaves a shifted factorisation behind.
    """
    if equilibrium is not None:
        system.linearise(equilibrium.state, equilibrium.q)
    import scipy.sparse.linalg as spla

    shift, border = factorise_convex(system)
    n, metric = system.n_unknowns, system.metric
    # work in the scaled unknowns M^1/2 v, where the problem is a standard one
    root = np.sqrt(metric)
    inverse = spla.LinearOperator(
        (n, n), matvec=lambda v: root * bordered_solve(system, border, root * v.ravel())[0]
    )
    start = _without_symmetry(n)
    if n < 4:
        dense = np.column_stack([inverse.matvec(e) for e in np.eye(n)])
        values, vectors = np.linalg.eigh(0.5 * (dense + dense.T))
        largest, vector = values[-1], vectors[:, -1]
    else:
        values, vectors = spla.eigsh(inverse, k=1, which="LA", v0=start, tol=1e-6)
        largest, vector = values[0], vectors[:, 0]
    vector = vector / root
    scale = np.abs(vector[system.is_rotation]).max(initial=0.0) or np.abs(vector).max()
    return SoftestMode(float(1 / largest - shift), vector / scale)


def rounding_of(system: System) -> float:
    """Eigenvalue below which a mode of the Hessian assembled last is without stiffness.

    Rounding leaves an error of about eps times the largest eigenvalue, which is that of a stretch.
    The softest modes of structures that stand, of up to ten thousand unknowns, are 1e5 times above
    that and more; mechanisms are at it.
    """
    diagonal = np.abs(system.values[system.sparsity.diagonal]) / system.metric
    return float(_ROUNDING * np.finfo(float).eps * diagonal.max(initial=0.0))


def zero_mode(system: System, border: Border | None) -> float | None:
    """The eigenvalue of a mode without stiffness, None where there is none, of a Hessian that is
    positive definite as far as its pivots tell.

    One step of inverse iteration: where rounding alone makes a stiffness positive, all others are
    so far away that the Rayleigh quotient is the eigenvalue.
    """
    if not system.n_unknowns:
        return None
    weighted = system.metric * _without_symmetry(system.n_unknowns)
    mode, _ = bordered_solve(system, border, weighted)
    eigenvalue = float(mode @ weighted) / float(mode @ (system.metric * mode))
    return eigenvalue if not eigenvalue > rounding_of(system) else None


def _without_symmetry(n: int) -> np.ndarray:
    """A fixed vector (n,) that no symmetric mode is orthogonal to: results are reproducible."""
    return np.sin(np.arange(1, n + 1) * 0.7390851)
