"""Where a run's time goes: wall seconds by phase, measured around the functions that do the work.

The functions are wrapped while the clock runs and put back afterwards, so nothing is measured, and
nothing costs anything, in other runs. Works within one process: run with one job.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import wraps
from time import perf_counter
from typing import Any
from unittest.mock import patch

import numpy as np

from kop_exudyn.equilibrium.sensitivities import Sensitivities
from kop_exudyn.equilibrium.system import System
from kop_exudyn.kit.projection import Projection
from kop_exudyn.search import objective
from kop_exudyn.search.events import StageEvent
from kop_exudyn.search.objective import DesignObjective
from kop_exudyn.sqp.qp import QPSolver

REST = "rest"
# Phase -> (owner, function): who does it. Time is counted for the innermost phase only.
PHASES: Mapping[str, Sequence[tuple[Any, str]]] = {
    "assembly": [(System, "assemble")],
    "factorisation": [(System, "factorise")],
    "Newton, rest": [(objective, "solve"), (objective, "refine")],
    "sensitivities": [(DesignObjective, "derivatives"), (Sensitivities, "predict")],
    "target fitting": [(DesignObjective, "judge")],
    "Exudyn": [(objective, "confirm")],
    "projection": [(Projection, "minimise"), (Projection, "hessian")],
    "QP": [(QPSolver, "solve")],
}


@dataclass
class PhaseClock:
    """Counts seconds by phase, each moment for one phase; `calls` counts the calls of the wrapped
    functions."""

    seconds: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))
    calls: Counter = field(default_factory=Counter)
    _stack: list[str] = field(default_factory=lambda: [REST])
    _since: float = 0.0

    @contextmanager
    def running(
        self, phases: Mapping[str, Sequence[tuple[Any, str]]] = PHASES
    ) -> Iterator[PhaseClock]:
        """Measure whatever runs inside of the `with` block."""
        with ExitStack() as stack:
            for phase, functions in phases.items():
                for owner, name in functions:
                    stack.enter_context(
                        patch.object(owner, name, self._wrapped(getattr(owner, name), phase))
                    )
            self._since = perf_counter()
            try:
                yield self
            finally:
                self.lap()

    def lap(self) -> dict[str, float]:
        """Seconds by phase so far; the phase that runs is counted up to now."""
        now = perf_counter()
        self.seconds[self._stack[-1]] += now - self._since
        self._since = now
        return dict(self.seconds)

    def _wrapped(self, function: Callable, phase: str) -> Callable:
        @wraps(function)
        def timed(*args: Any, **kwargs: Any) -> Any:
            self.calls[function.__qualname__] += 1
            self.lap()
            self._stack.append(phase)
            try:
                return function(*args, **kwargs)
            finally:
                self.lap()
                self._stack.pop()

        return timed


@dataclass(frozen=True)
class StepCost:
    """What one accepted step cost.

    sqp, stage : see `StageEvent`
    seconds : by phase; equilibria : solved, some perhaps in vain; trials : points tried
    """

    sqp: str
    stage: str
    seconds: Mapping[str, float]
    equilibria: int
    trials: int


class StepCosts:
    """An observer of stages that reads the clock at every accepted step."""

    def __init__(self, clock: PhaseClock):
        self.clock, self.steps = clock, list[StepCost]()
        self._sqp, self._seconds, self._solved = "", dict[str, float](), 0  # at the step before

    def __call__(self, event: StageEvent) -> None:
        seconds, solved = self.clock.lap(), self.clock.calls[objective.solve.__qualname__]
        spent = {phase: value - self._seconds.get(phase, 0.0) for phase, value in seconds.items()}
        # the first step of an SQP also carries what came before it: clustering, trials
        if event.sqp == self._sqp:
            self.steps.append(
                StepCost(event.sqp, event.stage, spent, solved - self._solved, event.record.trials)
            )
        self._sqp, self._seconds, self._solved = event.sqp, seconds, solved


def medians(steps: Sequence[StepCost]) -> dict[str, dict[str, float]]:
    """stage -> medians over its steps: of the seconds of every phase, of all seconds, of equilibria
    and trials."""
    found = {}
    for stage in dict.fromkeys(step.stage for step in steps):
        own = [step for step in steps if step.stage == stage]
        phases = [*PHASES, REST]
        columns = {phase: [step.seconds.get(phase, 0.0) for step in own] for phase in phases}
        columns["all"] = [sum(step.seconds.values()) for step in own]
        columns |= {
            "equilibria": [step.equilibria for step in own],
            "trials": [step.trials for step in own],
        }
        found[stage] = {name: float(np.median(values)) for name, values in columns.items()} | {
            "steps": len(own)
        }
    return found
