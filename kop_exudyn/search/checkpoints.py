"""SQPs of a search that leave a checkpoint after every step, and go on from it."""

from __future__ import annotations

import json
import logging
from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from ..errors import InputError
from ..files.arrays import numbers_of
from ..sqp.history import SQPState
from ..sqp.options import SQPOptions, SQPResult
from ..sqp.problem import Point
from ..sqp.solver import minimise
from .dataset import evaluations_from_arrays, evaluations_to_arrays
from .events import Observer, SQPLabel, StageEvent
from .problems import RelaxedProblem

log = logging.getLogger(__name__)


class Store(Protocol):
    """Where checkpoints go: named sets of plain arrays."""

    def load(self, name: str) -> Mapping[str, np.ndarray] | None: ...

    def save(self, name: str, arrays: Mapping[str, np.ndarray]) -> None: ...


class NoStore:
    """Keeps nothing."""

    def load(self, name: str) -> None:
        return None

    def save(self, name: str, arrays: Mapping[str, np.ndarray]) -> None:
        pass


class PrefixedStore:
    """A store that puts a prefix before the names of its checkpoints."""

    def __init__(self, store: Store, prefix: str):
        self.store, self.prefix = store, prefix

    def load(self, name: str) -> Mapping[str, np.ndarray] | None:
        return self.store.load(self.prefix + name)

    def save(self, name: str, arrays: Mapping[str, np.ndarray]) -> None:
        self.store.save(self.prefix + name, arrays)


def minimise_kept(
    label: SQPLabel,
    problem: Any,
    start: Point,
    options: SQPOptions,
    store: Store,
    observer: Observer,
) -> SQPResult:
    """Minimise, or go on from the store's checkpoint of that name.

    label : which SQP it is; its name is the checkpoint's
    problem, start, options : see `minimise`; the problem's dataset counts what is solved
    store : gets a checkpoint after every accepted step
    observer : sees every accepted step, those of the checkpoint first

    Raises InputError for a checkpoint that is damaged, or of other variables.
    """
    name, tally = label.name, problem.dataset.tally
    before = (tally.equilibria, tally.newton_iterations)
    state, saved = None, store.load(name)
    terms: list[str] = []
    if saved is not None:
        try:
            state, start, terms = _restored(problem, saved, start.x.shape)
            equilibria, iterations = numbers_of(saved, "tally", (2,)).astype(int).tolist()
            rows = [json.loads(row) for row in terms]
        # some array is missing or of another shape
        except (IndexError, KeyError, TypeError, ValueError, AttributeError):
            raise InputError(
                f"the checkpoint {name!r} is damaged: start anew instead of resuming"
            ) from None
        tally.equilibria += equilibria
        tally.newton_iterations += iterations
        for record, row in zip(state.history, rows):
            observer(StageEvent(label, record, row))

    def checkpoint(state: SQPState, point: Point) -> None:
        terms.append(json.dumps(point.data.terms))
        observer(StageEvent(label, state.history[-1], point.data.terms))
        store.save(
            name,
            {
                **{f"sqp/{k}": v for k, v in state.to_arrays().items()},
                **{f"states/{k}": v for k, v in evaluations_to_arrays(point.data.solved).items()},
                "kit": point.data.kit.vector,
                "terms": np.array(terms),
                "tally": np.array(
                    [tally.equilibria - before[0], tally.newton_iterations - before[1]]
                ),
            },
        )

    result = minimise(problem, start.x, options, checkpoint=checkpoint, state=state, start=start)
    log.info("%s: %d steps, J = %.6g, %s", name, result.steps, result.point.value, result.status)
    return result


def _restored(
    problem: Any, saved: Mapping[str, np.ndarray], shape: tuple[int, ...]
) -> tuple[SQPState, Point, list[str]]:
    """State, point (of variables of this shape) and the steps' terms of a checkpoint."""
    state = SQPState.from_arrays({k[4:]: v for k, v in saved.items() if k.startswith("sqp/")})
    if state.x.shape != shape or saved["terms"].shape != (len(state.history),):
        raise ValueError("a checkpoint of other variables, or of other steps")
    evaluations = evaluations_from_arrays(
        problem.dataset, {k[7:]: v for k, v in saved.items() if k.startswith("states/")}
    )
    kit = numbers_of(saved, "kit", (None,))
    point = (
        problem.point(state.x, evaluations, problem.kit.with_vector(kit))
        if isinstance(problem, RelaxedProblem)
        else problem.point(state.x, evaluations)
    )
    return state, point, [str(row) for row in saved["terms"]]
