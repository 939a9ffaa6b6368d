"""Accepted steps as plain data: one entry an SQP, with a list of numbers for each figure of its
steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from itertools import groupby
from typing import Any

import numpy as np

from ..errors import InputError
from ..sqp.history import StepRecord
from .stage_results import StageEvent

_FIGURES = [field.name for field in fields(StepRecord) if field.name != "seconds"]


def events_to_list(events: Sequence[StageEvent]) -> list[dict[str, Any]]:
    """One entry for all steps of an SQP: its name and w_c, and lists of the figures in
    `StepRecord`.

    "terms" (of the objective) and "seconds" (by phase) have a list for each name; None where a step
    has no such value.
    """
    found = []
    for (sqp, weight), group in groupby(events, key=lambda event: (event.sqp, event.weight)):
        own = list(group)
        found.append(
            {
                "sqp": sqp,
                "weight": weight,
                **{name: [getattr(event.record, name) for event in own] for name in _FIGURES},
                "terms": _columns([event.terms for event in own]),
                "seconds": _columns([event.record.seconds for event in own]),
            }
        )
    return found


def events_from_list(data: Sequence[Mapping[str, Any]]) -> list[StageEvent]:
    """The events that `events_to_list` described. Raises InputError for data of something else."""
    try:
        return [event for entry in data for event in _events(entry)]
    except (KeyError, IndexError, TypeError, AttributeError) as error:
        raise InputError(
            f"isn't a history of steps ({type(error).__name__}: {error})", field="history"
        ) from None


def _events(entry: Mapping[str, Any]) -> list[StageEvent]:
    """The steps of one SQP."""
    found = []
    for k in range(len(entry["step"])):
        figures = {name: _number(name, entry[name][k]) for name in _FIGURES}
        found.append(
            StageEvent(
                entry["sqp"],
                StepRecord(**figures, seconds=_row(entry["seconds"], k)),
                _row(entry["terms"], k),
                entry["weight"],
            )
        )
    return found


def _columns(rows: Sequence[Mapping[str, float]]) -> dict[str, list[float | None]]:
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: [row.get(name) for row in rows] for name in names}


def _row(columns: Mapping[str, Sequence[float | None]], k: int) -> dict[str, float]:
    return {name: value for name, values in columns.items() if (value := values[k]) is not None}


def _number(name: str, value: Any) -> Any:
    """JSON's null is what isn't a finite number: a trust radius without limit, or unknown."""
    if value is not None:
        return value
    return np.inf if name == "radius" else np.nan
