"""What two versions are compared on: run as a script by the version that the path leads to.

    python version_cases.py CASE ARGUMENT RUNS

prints {"amount": seconds of processor time or MiB, "state": a number that tells the state} as
JSON. It uses only what has long been there, since other versions have to run it too.
"""

from __future__ import annotations

import json
import resource
import sys
from collections.abc import Callable
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

import numpy as np
from benchmark_scenes import gridshell

from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.equilibrium.sensitivities import Sensitivities
from kop_exudyn.equilibrium.system import System
from kop_exudyn.io.designs import load_design

_SHRINK, _PIECES = 1e-3, 3


def deployment(model: str, runs: int) -> tuple[float, float]:
    """A design's states from its input, its file read and its workspaces made before."""

    def prepared() -> Any:
        design = load_design(Path(model))
        design.systems
        return design

    prepared().deploy()  # compiles, where that has to be
    return _timed(lambda design: design.deploy(), runs, prepared, _energy)


def iteration(joints: str, runs: int) -> tuple[float, float]:
    """A Newton iteration of a gridshell, everything that belongs to it."""
    scene, q = gridshell(int(joints), _PIECES, _SHRINK)
    system = System(scene)
    found = solve(system, q)
    seconds, state = _timed(
        lambda _: solve(system, q), runs, lambda: None, lambda eq: eq.elastic_energy
    )
    return seconds / found.iterations, state


def sensitivities(model: str, runs: int) -> tuple[float, float]:
    """All derivatives of a deployed design's joints, and its energy's Hessian."""
    design = load_design(Path(model))
    role = design.fitted_role.name
    system, equilibrium = design.systems[role], design.deploy()[role]

    def derivatives(_: None) -> np.ndarray:
        found = Sensitivities(system, equilibrium)
        found.positions(np.asarray(design.joints))
        return found.energy_hessian

    derivatives(None)
    return _timed(derivatives, runs, lambda: None, lambda H: float(np.abs(H).sum()))


def memory(joints: str, runs: int) -> tuple[float, float]:
    """Peak memory of a process that solves a gridshell, MiB."""
    scene, q = gridshell(int(joints), _PIECES, _SHRINK)
    energy = solve(System(scene), q).elastic_energy
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (2**20 if sys.platform == "darwin" else 2**10), energy


def _timed(
    function: Callable[[Any], Any],
    runs: int,
    prepare: Callable[[], Any],
    state: Callable[[Any], float],
) -> tuple[float, float]:
    """Median seconds of some runs, and the number that tells the last one's state."""
    times, value = [], None
    for _ in range(runs):
        prepared = prepare()
        begin = process_time()
        value = function(prepared)
        times.append(process_time() - begin)
    return median(times), state(value)


def _energy(equilibria: Any) -> float:
    """Of the deployed state, in a form that doesn't depend on its unit: log E."""
    return float(np.log(next(iter(equilibria.values())).elastic_energy))


if __name__ == "__main__":
    case, argument, count = sys.argv[1:]
    amount, told = globals()[case](argument, int(count))
    print(json.dumps({"amount": amount, "state": told}))
