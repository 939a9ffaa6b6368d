"""Accepted steps survive the way through plain data."""

import json

import numpy as np
import pytest

from kop_exudyn.errors import InputError
from kop_exudyn.search.events import (
    SQPLabel,
    Stage,
    StageEvent,
    events_from_list,
    events_to_list,
)
from kop_exudyn.sqp.history import StepRecord


def event(label: SQPLabel, step: int, terms: dict[str, float]) -> StageEvent:
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
    return StageEvent(label, record, terms)


RELAXED = SQPLabel("relaxed-10", Stage.RELAXED, weight=10.0)
EVENTS = [
    event(RELAXED, 1, {"fit": 1.0, "projection": 2.0}),
    event(RELAXED, 2, {"fit": 0.5}),
    event(SQPLabel.of_round(1), 1, {"fit": 0.4}),
    event(SQPLabel.of_round(2), 1, {"fit": 0.3}),
]


def test_round_trip_through_json():
    data = json.loads(json.dumps(events_to_list(EVENTS)))
    assert [entry["sqp"] for entry in data] == ["relaxed-10", "assigned-1", "assigned-2"]
    assert data[0]["value"] == [1.0, 0.5] and data[0]["terms"] == {
        "fit": [1.0, 0.5],
        "projection": [2.0, None],
    }
    assert events_from_list(data) == EVENTS


def test_stage_and_round_are_fields():
    named = SQPLabel("any name-7", Stage.ASSIGNED, 3)
    (entry,) = events_to_list([event(named, 1, {"fit": 1.0})])
    assert (entry["stage"], entry["round"], entry["weight"]) == ("assigned", 3, None)
    (back,) = events_from_list([entry])
    assert (back.sqp, back.stage, back.round) == ("any name-7", Stage.ASSIGNED, 3)


@pytest.mark.parametrize(
    ("name", "weight", "stage", "number"),
    [
        ("relaxed-0.1", 0.1, Stage.RELAXED, None),
        ("rescue-1", 1e3, Stage.RELAXED, None),
        ("assigned", None, Stage.ASSIGNED, None),
        ("assigned-12", None, Stage.ASSIGNED, 12),
        ("unrelaxed", None, Stage.UNRELAXED, None),
    ],
)
def test_files_of_earlier_versions_have_them_in_the_name(name, weight, stage, number):
    (entry,) = events_to_list([event(SQPLabel(name, Stage.RELAXED, None, weight), 1, {})])
    del entry["stage"], entry["round"]
    (back,) = events_from_list([entry])
    assert back.label == SQPLabel(name, stage, number, weight)


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
        lambda e: e.update(stage="somewhere"),
        lambda e: [e.pop(name) for name in ("stage", "round")] + [e.update(sqp="x", weight=None)],
    ],
)
def test_something_else_is_refused(change):
    data = events_to_list(EVENTS)
    change(data[0])
    with pytest.raises(InputError, match="isn't a history of steps"):
        events_from_list(data)
