"""Who solves the equations: this package's own solver, or Exudyn alone."""

from __future__ import annotations

from collections.abc import Callable

from ..errors import InputError
from .equilibria import Equilibrium

FAST, EXUDYN = "fast", "exudyn"
ENGINES = (FAST, EXUDYN)


def engine(name: str) -> Callable[..., Equilibrium]:
    """An engine's `solve`, with the parameters and errors of `newton.solve`.

    name : "fast", the mixed-stress Newton iteration of this package, or "exudyn", which leaves
        residuals and steps to Exudyn
    Raises InputError for another name.
    """
    if name == FAST:
        from .newton import solve as fast

        return fast
    if name == EXUDYN:
        from .exudyn_solver import solve as exudyn

        return exudyn
    raise InputError(f"unknown engine (known: {', '.join(ENGINES)})", field="engine", value=name)
