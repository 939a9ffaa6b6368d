"""Exudyn's static solver as it comes, on the model of a scene, with settings that its users tune.

Load steps (the opening, and forces of actuators and attraction, grow with them), a mass-like
stabilisation, modified Newton. All of them are tried, and the quickest that converges is what is
compared with.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from statistics import median
from time import process_time
from typing import Any

import numpy as np

from kop_exudyn.equilibrium.exudyn_confirm import model_of
from kop_exudyn.equilibrium.exudyn_library import exu, quiet_settings
from kop_exudyn.errors import SimulationFailure
from kop_exudyn.scene.scene import Scene
from kop_exudyn.scene.state import State

# What is tried, in this order: name -> load steps, stabilisation, modified Newton.
TRIED: Mapping[str, tuple[int, float, bool]] = {
    "1 load step": (1, 0.0, False),
    "1 load step, modified Newton": (1, 0.0, True),
    "10 load steps": (10, 0.0, False),
    "10 load steps, stabilised": (10, 1.0, False),
    "50 load steps": (50, 0.0, False),
}
_LIMIT = 20.0  # s, after which a way is given up
_ITERATIONS = 50  # a load step
_BALANCED = 1e-6  # of the largest force, what is a solution at all
_TOLERANCE = 1e-9  # of the largest force: where the others may stop, too


@dataclass(frozen=True)
class Alone:
    """What became of the best of the settings.

    settings : their name, "" if none led to a solution; reason : why the last one tried didn't
    seconds : of several runs, of the processor; steps : Newton steps
    state : Exudyn's, or None
    """

    settings: str
    reason: str
    seconds: tuple[float, ...]
    steps: int
    state: State | None

    @property
    def columns(self) -> dict[str, Any]:
        """As `Timing.columns` of the benchmark, and the settings."""
        return {
            "seconds": median(self.seconds),
            "least": min(self.seconds),
            "most": max(self.seconds),
            "settings": self.settings,
        }


def settings_of(
    steps: int, stabiliser: float, modified: bool, residual: float
) -> exu.SimulationSettings:
    """Settings of Exudyn's static solver; residual : at which it may stop, in the model's unit."""
    settings = quiet_settings()
    static = settings.staticSolver
    static.numberOfLoadSteps, static.adaptiveStep = steps, steps > 1
    static.minimumStepSize = 1e-3  # of the load
    static.useLoadFactor = True
    static.stabilizerODE2term = stabiliser
    static.newton.useModifiedNewton = modified
    static.newton.maxIterations = _ITERATIONS
    static.newton.absoluteTolerance = residual
    static.newton.relativeTolerance = 1e-10
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    return settings


def best_alone(
    scene: Scene,
    q: np.ndarray,
    start: State | None = None,
    opening: float | None = None,
    *,
    runs: int = 1,
    tried: Mapping[str, tuple[int, float, bool]] = TRIED,
) -> Alone:
    """Exudyn's static solver from a start (default: the scene's own), with the best of settings."""
    model = model_of(scene)
    model.set(scene, q, opening)
    state = scene.held(scene.initial if start is None else start, q)
    mean = None if scene.actuated is None else float(state.angles[scene.actuated].mean())
    best = None
    for name, (steps, stabiliser, modified) in tried.items():
        ramp = None if steps == 1 else (0.0 if mean is None else mean)
        found = _run(model, state, name, (steps, stabiliser, modified), ramp)
        if (
            best is None
            or found.state is not None
            and (best.state is None or found.seconds < best.seconds)
        ):
            best = found
    if best is None or best.state is None or runs == 1:
        assert best is not None
        return best
    chosen = tried[best.settings]
    ramp = None if chosen[0] == 1 else (0.0 if mean is None else mean)
    more = [_run(model, state, best.settings, chosen, ramp) for _ in range(runs - 1)]
    seconds = best.seconds + tuple(t for run in more for t in run.seconds)
    return Alone(best.settings, "", seconds, best.steps, best.state)


def _run(model, state: State, name: str, chosen, ramp: float | None) -> Alone:
    point = model.point(state)
    residual = max(_TOLERANCE * model.largest_force(), 200 * model.round_off)
    settings = settings_of(*chosen, residual)
    begin, solver = process_time(), exu.special.solver
    solver.timeout = _LIMIT
    try:
        found, steps = model.run(point, settings, ramp)
    except SimulationFailure as failure:
        return Alone("", failure.reason, (process_time() - begin,), 0, None)
    finally:
        solver.timeout = -1
    seconds = (process_time() - begin,)
    # where residuals first grow, a relative one can be small without balance
    largest = np.abs(model.residual(found).balance).max()
    if not largest <= max(_BALANCED * model.largest_force(), 200 * model.round_off):
        return Alone("", "ends out of balance", seconds, steps, None)
    return Alone(name, "", seconds, steps, model.state(found))
