"""Accepted steps survive the way through plain data."""

import json

import numpy as np
import pytest

from kop_exudyn.errors import InputError
from kop_exudyn.search.events import events_from_list, events_to_list
from kop_exudyn.search.stage_results import StageEvent
from kop_exudyn.sqp.history import StepRecord


def event(sqp: str, step: int, weight: float | None, terms: dict[str, float]) -> StageEvent:
    record = StepRecord(
        step,
        1 / step,
        0.5,
        0.25,
        0.2,
        0.0,
        1.0,
        0.1 * step,
        2,
        1,
        3,
        step == 2,
        "piqp",
        {"qp": 0.1, "evaluate": 0.2},
    )
    return StageEvent(sqp, record, terms, weight)


EVENTS = [
    event("relaxed-10", 1, 10.0, {"fit": 1.0, "projection": 2.0}),
    event("relaxed-10", 2, 10.0, {"fit": 0.5}),
    event("assigned-1", 1, None, {"fit": 0.4}),
    event("assigned-2", 1, None, {"fit": 0.3}),
]


def test_round_trip_through_json():
    data = json.loads(json.dumps(events_to_list(EVENTS)))
    assert [entry["sqp"] for entry in data] == ["relaxed-10", "assigned-1", "assigned-2"]
    assert data[0]["value"] == [1.0, 0.5] and data[0]["terms"] == {
        "fit": [1.0, 0.5],
        "projection": [2.0, None],
    }
    assert events_from_list(data) == EVENTS


def test_what_is_not_finite_comes_back():
    data = events_to_list(EVENTS[:1])
    data[0].update(radius=[None], damping=[None])
    record = events_from_list(data)[0].record
    assert record.radius == np.inf and np.isnan(record.damping)


@pytest.mark.parametrize(
    "change",
    [
        lambda e: e.pop("radius"),
        lambda e: e.update(value=[1.0]),
        lambda e: e.update(terms=3),
        lambda e: e.update(step=None),
    ],
)
def test_something_else_is_refused(change):
    data = events_to_list(EVENTS)
    change(data[0])
    with pytest.raises(InputError, match="isn't a history of steps"):
        events_from_list(data)
