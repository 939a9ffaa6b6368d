"""The studies of what can be built and how surely it is found, in their quick modes."""

from __future__ import annotations

from support.quick_studies import found


def test_buildable(tmp_path):
    data = found("buildable", tmp_path)
    rows = data["designs"]
    assert [row["required"] for row in rows] == ["nothing", "opening", "+ load"]
    assert all(row["opened max %"] > 0 and row["snow"] > 0 for row in rows)
    opened = [row for row in rows if row["required"] != "nothing"]
    assert all(row["opens"] and row["utilisation"] > 0 for row in opened)


def test_repeatability(tmp_path):
    data = found("repeatability", tmp_path)
    (case,) = data["cases"]
    assert len(data["runs"]) == case["runs"] == 2 and case["smallest J"] > 0
    values = [one["J"] for one in data["runs"]]
    assert case["spread of J %"] == 100 * (max(values) / min(values) - 1) > 0
