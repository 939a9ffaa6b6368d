"""Tries a stress case and judges the outcome with nothing that the solver said about itself."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from kop_exudyn.equilibrium.direction import border_of, is_convex
from kop_exudyn.equilibrium.equilibria import Equilibrium, Start
from kop_exudyn.equilibrium.exudyn_confirm import confirm
from kop_exudyn.equilibrium.newton import NewtonOptions, refine, solve
from kop_exudyn.equilibrium.stability import softest_mode
from kop_exudyn.equilibrium.system import System
from kop_exudyn.errors import SimulationFailure

from .limits import TimeOut, time_limit
from .random_scenes import StressCase

# Residual force that is passed as good: a share of the largest internal force, and a multiple of
# its round-off.
_RESIDUAL, _ROUND_OFF = 1e-8, 100.0

STABLE, FAILED = "stable", "failed"
FORBIDDEN = ("unconverged", "unstable", "not finite", "exception", "hang")


@dataclass(frozen=True)
class Outcome:
    """What became of a case.

    verdict : "stable" (and confirmed by Exudyn), "failed" (an honest SimulationFailure), or one of
        FORBIDDEN
    reason : the failure's reason, or what was found wrong
    softest : lowest eigenvalue in units of EI / length of a piece; nan where there is no state
    """

    seed: int
    verdict: str
    reason: str = ""
    iterations: int = 0
    escapes: int = 0
    wall_s: float = 0.0
    softest: float = np.nan
    moved: float = np.nan
    equilibrium: Equilibrium | None = None

    @property
    def forbidden(self) -> bool:
        return self.verdict in FORBIDDEN


def run_case(
    case: StressCase,
    seconds: float = 60.0,
    options: NewtonOptions = NewtonOptions(),
    start: Start | None = None,
) -> Outcome:
    """Solve a case and judge it.

    seconds : time after which the case counts as a hang (where the system has alarms)
    start : instead of the case's own
    """
    begin = perf_counter()
    try:
        with time_limit(seconds):
            eq = solve(System(case.scene), case.q, start or case.start, case.opening, options)
            found = judge(case, eq)
    except SimulationFailure as failure:
        return Outcome(case.seed, FAILED, failure.reason, wall_s=perf_counter() - begin)
    except TimeOut:
        return Outcome(case.seed, "hang", f"not done after {seconds:g} s", wall_s=seconds)
    except Exception as error:  # whatever it is: no other exception may leave the solver
        return Outcome(
            case.seed,
            "exception",
            f"{type(error).__name__}: {error}",
            wall_s=perf_counter() - begin,
        )
    return Outcome(
        case.seed,
        *found,
        eq.iterations,
        eq.escapes,
        perf_counter() - begin,
        *_measures(case, eq, found[0]),
        eq,
    )


def judge(case: StressCase, eq: Equilibrium) -> tuple[str, str]:
    """The verdict on an equilibrium and its reason: residual, pivots and eigenvalue assembled anew,
    then Exudyn.

    Raises SimulationFailure where Exudyn doesn't confirm: a state that isn't confirmed is never
    passed on.
    """
    arrays = (
        eq.state.positions,
        eq.state.rotations,
        eq.state.angles,
        eq.stress,
        np.array([eq.torque, eq.potential]),
    )
    if not all(np.isfinite(a).all() for a in arrays):
        return "not finite", "the state contains values that are not finite"
    system, residual, gap = _assembled(case, eq)
    force, noise = system.force_scale()
    if residual > _RESIDUAL * force + _ROUND_OFF * noise or gap > 1e-10:
        return (
            "unconverged",
            f"residual {residual / force:.1e} of the largest force, mean angle off by {gap:.1e}",
        )
    if not is_convex(system.factorise(), border_of(system)):
        return "unstable", "a pivot of the stiffness is negative"
    eigenvalue = softest_mode(system).eigenvalue
    if not eigenvalue > 0:
        return "unstable", f"the softest mode's eigenvalue is {eigenvalue:.2e}"
    confirm(case.scene, refine(system, eq))
    return STABLE, ""


def _assembled(case: StressCase, eq: Equilibrium) -> tuple[System, float, float]:
    """A new workspace at the state, the largest residual force, and how far the mean angle is from
    the opening."""
    system = System(case.scene)
    system.set_parameters(case.q)
    system.assemble(eq.state)
    residual, gap = system.gradient[: system.n_unknowns].copy(), 0.0
    if system.constraint is not None:
        residual += eq.torque * system.constraint
        assert case.opening is not None
        gap = abs(float(eq.state.angles[case.scene.actuated].mean()) - case.opening)
    return system, float(np.abs(residual * system.force_weight).max()), gap


def _measures(case: StressCase, eq: Equilibrium, verdict: str) -> tuple[float, float]:
    """Softest eigenvalue in units of EI / L, and the largest displacement from the initial state /
    size."""
    if verdict == "not finite":
        return np.nan, np.nan
    system, _, _ = _assembled(case, eq)
    unit = float(case.scene.stiffness[:, 4:].min()) / case.conditions.unit
    moved = np.abs(eq.state.positions - case.scene.initial.positions).max() / case.scene.size
    return softest_mode(system).eigenvalue / unit, float(moved)
