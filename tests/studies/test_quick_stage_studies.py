"""The studies of how the stages proceed, in their quick modes."""

from __future__ import annotations

import pytest
from support.quick_studies import found


def test_two_stage_history(tmp_path):
    rows = found("two_stage_history", tmp_path)["hessians"]
    assert {(row["Hessian"], row["stage"]) for row in rows} >= {
        ("exact", "relaxed"),
        ("bfgs", "relaxed"),
    }
    assert all(row["steps"] >= 1 and row["points tried"] >= row["steps"] for row in rows)


def test_where_time_goes(tmp_path):
    data = found("where_time_goes", tmp_path)
    seconds = {row["phase"]: row["run, s"] for row in data["phases"]}
    assert seconds["all"] == pytest.approx(sum(s for phase, s in seconds.items() if phase != "all"))
    assert min(seconds[phase] for phase in ("assembly", "sensitivities", "QP")) > 0
    assert data["medians"]["relaxed"]["equilibria"] >= 1
