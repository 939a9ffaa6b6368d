"""Stores that fail at a given moment, and what makes two outcomes the same."""

from __future__ import annotations

import errno
import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from kop_exudyn.errors import SimulationFailure
from kop_exudyn.search.events import StageEvent
from kop_exudyn.search.result import KitResult
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings
from kop_exudyn.structures.base import Design


class MemoryStore:
    """Checkpoints in memory, as bytes would keep them: copies."""

    def __init__(self) -> None:
        self.kept: dict[str, dict[str, np.ndarray]] = {}
        self.saves = 0

    def load(self, name: str) -> dict[str, np.ndarray] | None:
        return self.kept.get(name)

    def save(self, name: str, arrays: Mapping[str, np.ndarray]) -> None:
        self.saves += 1
        self.kept[name] = {key: np.array(value) for key, value in arrays.items()}


class FailingStore(MemoryStore):
    """Raises an error at its n-th save, before or after it has kept the arrays."""

    def __init__(self, at: int, error: BaseException, after: bool = False):
        super().__init__()
        self.at, self.error, self.after = at, error, after

    def save(self, name: str, arrays: Mapping[str, np.ndarray]) -> None:
        if self.saves + 1 == self.at and not self.after:
            raise self.error
        super().save(name, arrays)
        if self.saves == self.at and self.after:
            raise self.error


def disk_full() -> OSError:
    return OSError(errno.ENOSPC, "No space left on device")


def resumed_at(
    at: int,
    designs: Sequence[Design],
    parts: Mapping[str, int],
    settings: JobSettings,
    after: bool = False,
) -> tuple[KitResult, list[Any]] | None:
    """A job interrupted at its n-th checkpoint and gone on with; None when it ends before.

    Returns the outcome and the events that the resumed run reported.
    """
    store = FailingStore(at, KeyboardInterrupt(), after)
    events: list[StageEvent] = []
    try:
        optimize_kit(designs, parts, settings=settings, store=store)
        return None
    except KeyboardInterrupt:
        again = MemoryStore()
        again.kept = store.kept
        return optimize_kit(
            designs, parts, settings=settings, store=again, observer=events.append
        ), events


def fingerprint(outcome: KitResult, events: Sequence[Any] = ()) -> dict[str, Any]:
    """Everything of an outcome that an interruption must not change, bit for bit: no times, no step
    counters of ours."""
    stages = {}
    for name, stage in outcome.stages.items():
        stages[name] = {
            "kit": stage.kit.vector.tobytes(),
            "value": stage.value,
            "steps": stage.steps,
            "status": stage.status,
            "parts": [part.tolist() for part in stage.assignment.part],
            "variants": [variant.tolist() for variant in stage.assignment.variant],
            "jumps": [(jump.design, jump.fraction, jump.distance) for jump in stage.jumps],
            "designs": [
                str(e)
                if isinstance(e, SimulationFailure)
                else (
                    e.q.tobytes(),
                    e.value,
                    {role: eq.state.positions.tobytes() for role, eq in e.equilibria.items()},
                )
                for e in stage.designs
            ],
        }
    return {
        "stages": stages,
        "events": [
            (
                e.sqp,
                e.record.step,
                e.record.value,
                e.record.gradient_norm,
                json.dumps(dict(e.terms)),
            )
            for e in events
        ],
    }
