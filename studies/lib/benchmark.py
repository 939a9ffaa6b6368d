"""Run time against error: full deployments, and one solve three ways, for any number of rod
elements a piece."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from statistics import median
from time import process_time
from typing import Any

import numpy as np

from kop_exudyn.equilibrium.newton import NewtonOptions, solve
from kop_exudyn.equilibrium.system import System
from kop_exudyn.errors import SimulationFailure
from kop_exudyn.scene.scene import Scene
from kop_exudyn.scene.state import State
from kop_exudyn.structures.base import Design, design_from_dict

from .exudyn_alone import TRIED, best_alone

Row = dict[str, Any]
MIXED, PLAIN, EXUDYN = "mixed-stress Newton", "plain Newton", "Exudyn's static solver"


@dataclass(frozen=True)
class Timing:
    """median, low, high : seconds of several runs; value : what the last one returned.

    Processor time: all that is timed runs in one thread, where it is the wall time of a machine
    that does nothing else.
    """

    median: float
    low: float
    high: float
    value: Any

    @property
    def columns(self) -> Row:
        return {"seconds": self.median, "least": self.low, "most": self.high}


def timed(
    function: Callable[[Any], Any], runs: int, prepare: Callable[[], Any] = lambda: None
) -> Timing:
    """Time runs of a function of what `prepare` made for each of them, which is not timed."""
    times, value = [], None
    for _ in range(runs):
        prepared = prepare()
        begin = process_time()
        value = function(prepared)
        times.append(process_time() - begin)
    return Timing(median(times), min(times), max(times), value)


def fresh(data: Mapping[str, Any], changes: Mapping[str, Any]) -> Design:
    """A design as its file has it with some fields changed, its workspaces made, nothing kept from
    earlier."""
    design = design_from_dict(dict(data) | dict(changes), str(data.get("name")))
    design.systems
    return design


def deployments(
    case: str, prepare: Callable[[int], Design], refinements: tuple[int, ...], fine: int, runs: int
) -> list[Row]:
    """Full deployments of a design made with n elements a piece; errors against `fine` elements.

    Error: largest distance of a joint from the fine solution, % of the target's bounding box.
    """
    design = prepare(fine)
    role, size = design.fitted_role.name, design.target.size
    exact = _joints(design, prepare(fine).deploy()[role])
    rows = []
    for n in refinements:
        timing = timed(lambda own: own.deploy()[role], runs, partial(prepare, n))
        own = prepare(n)
        error = 100 * np.linalg.norm(_joints(own, timing.value) - exact, axis=1).max() / size
        rows.append(
            {
                "case": case,
                "elements a piece": n,
                "unknowns": own.systems[role].n_unknowns,
                "iterations": timing.value.iterations,
                **timing.columns,
                "error %": float(error),
            }
        )
    return rows


def _joints(design: Design, equilibrium: Any) -> np.ndarray:
    return equilibrium.state.positions[design.joints]


def three_ways(
    case: str,
    make: Callable[[int], tuple[Scene, np.ndarray, State | None]],
    joints: Callable[[int], Any],
    refinements: tuple[int, ...],
    fine: int,
    size: float,
    runs: int,
) -> list[Row]:
    """The same solve from the same start by mixed-stress Newton, plain Newton and Exudyn's own
    static solver.

    make : scene, parameters and start (None: the scene's own) for n elements a piece
    joints : body numbers that are compared for n elements a piece; errors are in % of `size`

    A way that doesn't get there says why, and has no error.
    """
    scene, q, start = make(fine)
    exact = solve(System(scene), q, start).state.positions[joints(fine)]
    rows, tried = [], TRIED
    for n in refinements:
        scene, q, start = make(n)
        system = System(scene)
        for way, options in ((MIXED, NewtonOptions()), (PLAIN, NewtonOptions(mixed=False))):
            attempt = partial(_attempt, system, q, start, options)
            timing = timed(lambda _, attempt=attempt: attempt(), runs)
            outcome: Row = {"iterations": str(timing.value), "error %": None}
            if not isinstance(timing.value, SimulationFailure):
                apart = np.linalg.norm(timing.value.state.positions[joints(n)] - exact, axis=1)
                error = 100 * float(apart.max()) / size
                outcome = {"iterations": timing.value.iterations, "error %": error}
            rows.append(
                {
                    "case": case,
                    "elements a piece": n,
                    "unknowns": system.n_unknowns,
                    "way": way,
                    "iterations": outcome["iterations"],
                    **timing.columns,
                    "error %": outcome["error %"],
                }
            )
        rows.append(_exudyn(case, n, system, q, start, joints(n), exact, size, runs, tried))
        # what does best with the fewest elements is taken for all
        tried = {name: way for name, way in tried.items() if name == rows[-1]["settings"]} or tried
    return rows


def _exudyn(
    case: str,
    n: int,
    system: System,
    q: np.ndarray,
    start: State | None,
    joints: np.ndarray,
    exact: np.ndarray,
    size: float,
    runs: int,
    tried: Mapping[str, tuple[int, float, bool]],
) -> Row:
    """Exudyn's row; its error is that of its own positions."""
    found = best_alone(system.scene, q, start, runs=runs, tried=tried)
    error = None
    if found.state is not None:
        apart = np.linalg.norm(found.state.positions[joints] - exact, axis=1)
        error = 100 * float(apart.max()) / size
    return {
        "case": case,
        "elements a piece": n,
        "unknowns": system.n_unknowns,
        "way": EXUDYN,
        "iterations": found.steps if found.state is not None else found.reason,
        **found.columns,
        "error %": error,
    }


def _attempt(system: System, q: np.ndarray, start: State | None, options: NewtonOptions) -> Any:
    try:
        return solve(system, q, start, options=options)
    except SimulationFailure as failure:
        return failure


def speedups(rows: list[Row]) -> list[Row]:
    """How many times as long Exudyn's own solver takes, at equal error, where both converge."""
    by_key = {(r["case"], r["elements a piece"], r["way"]): r for r in rows}
    return [
        {
            "case": case,
            "elements a piece": n,
            "unknowns": r["unknowns"],
            "times as fast as Exudyn": r["seconds"] / by_key[case, n, MIXED]["seconds"],
        }
        for (case, n, way), r in by_key.items()
        if way == EXUDYN and r["error %"] is not None
    ]
