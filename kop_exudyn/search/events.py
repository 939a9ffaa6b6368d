"""Accepted steps of a search: what observers see of them, and the same as plain data, one entry an
SQP with a list of numbers for each figure of its steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from enum import StrEnum
from itertools import groupby
from typing import Any

import numpy as np

from ..errors import InputError
from ..sqp.history import StepRecord

_FIGURES = [field.name for field in fields(StepRecord) if field.name != "seconds"]


class Stage(StrEnum):
    """The stages of a search, in the order of a result file."""

    DIRECT = "direct"
    UNRELAXED = "unrelaxed"
    PUBLISHED = "published"
    PUBLISHED_OPENED = "published_opened"
    RELAXED = "relaxed"
    ASSIGNED = "assigned"


@dataclass(frozen=True)
class SQPLabel:
    """Which SQP of a search it is.

    name : of its own in the search; its checkpoint has it
    stage : that it belongs to: to the relaxed one with all its w_c and rescues, to the assigned
        one with all its rounds
    round : of the assigned stage, from 1; None without rounds
    weight : w_c of the projection energy; None without one
    """

    name: str
    stage: Stage
    round: int | None = None
    weight: float | None = None

    @classmethod
    def of_round(cls, number: int) -> SQPLabel:
        """The SQP of a round of the assigned stage."""
        return cls(f"{Stage.ASSIGNED}-{number}", Stage.ASSIGNED, number)

    @classmethod
    def of_levelling(cls, number: int) -> SQPLabel:
        """The SQP of a round in which large deviations weigh more, see levelling.py."""
        return cls(f"{Stage.ASSIGNED}-levelled-{number}", Stage.ASSIGNED)


ASSIGNED = SQPLabel(Stage.ASSIGNED, Stage.ASSIGNED)  # the assigned stage without rounds
UNRELAXED = SQPLabel(Stage.UNRELAXED, Stage.UNRELAXED)


@dataclass(frozen=True)
class StageEvent:
    """One accepted step, as observers see it.

    label : which SQP's
    record : the SQP's figures of the step
    terms : the objective's terms after it, by name; their sum is the objective
    """

    label: SQPLabel
    record: StepRecord
    terms: Mapping[str, float]

    @property
    def sqp(self) -> str:
        """The name of the SQP."""
        return self.label.name

    @property
    def stage(self) -> Stage:
        """The stage that the step belongs to."""
        return self.label.stage

    @property
    def round(self) -> int | None:
        """The round of the assigned stage, from 1; None without rounds."""
        return self.label.round

    @property
    def weight(self) -> float | None:
        """w_c of the projection energy; None without one."""
        return self.label.weight


Observer = Callable[[StageEvent], None]


def events_to_list(events: Sequence[StageEvent]) -> list[dict[str, Any]]:
    """One entry for all steps of an SQP: its name, stage, round and w_c, and lists of the figures
    in `StepRecord`.

    "terms" (of the objective) and "seconds" (by phase) have a list for each name; None where a step
    has no such value.
    """
    found = []
    for label, group in groupby(events, key=lambda event: event.label):
        own = list(group)
        found.append(
            {
                "sqp": label.name,
                "stage": label.stage.value,
                "round": label.round,
                "weight": label.weight,
                **{name: [getattr(event.record, name) for event in own] for name in _FIGURES},
                "terms": _columns([event.terms for event in own]),
                "seconds": _columns([event.record.seconds for event in own]),
            }
        )
    return found


def events_from_list(data: Sequence[Mapping[str, Any]]) -> list[StageEvent]:
    """The events that `events_to_list` described. Raises InputError for data of something else.

    Files of earlier versions have the stage and the round only in the SQP's name.
    """
    try:
        return [event for entry in data for event in _events(entry)]
    except (KeyError, IndexError, TypeError, AttributeError, ValueError) as error:
        raise InputError(
            f"isn't a history of steps ({type(error).__name__}: {error})", field="history"
        ) from None


def _events(entry: Mapping[str, Any]) -> list[StageEvent]:
    """The steps of one SQP."""
    label, found = _label(entry), []
    for k in range(len(entry["step"])):
        figures = {name: _number(name, entry[name][k]) for name in _FIGURES}
        found.append(
            StageEvent(
                label,
                StepRecord(**figures, seconds=_row(entry["seconds"], k)),
                _row(entry["terms"], k),
            )
        )
    return found


def _label(entry: Mapping[str, Any]) -> SQPLabel:
    """Which SQP an entry is of."""
    name, weight = entry["sqp"], entry["weight"]
    if "stage" in entry:
        return SQPLabel(name, Stage(entry["stage"]), entry["round"], weight)
    head, _, number = name.partition("-")  # as earlier versions named their SQPs
    stage = Stage.RELAXED if weight is not None else Stage(head)
    rounds = stage is Stage.ASSIGNED and number
    return SQPLabel(name, stage, int(number) if rounds else None, weight)


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
