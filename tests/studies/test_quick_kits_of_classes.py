"""The studies of one kit of each class, in their quick modes: the first finds the kits for all."""

from __future__ import annotations

import pytest
from support.quick_studies import found


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    return tmp_path_factory.mktemp("reports")


def test_direct_vs_relaxed(reports):
    data = found("direct_vs_relaxed", reports)
    rows = data["designs"]
    assert (
        {row["class"] for row in rows}
        == {"C-shells", "grids", "umbrella meshes"}
        == set(data["times"]["kits_s"])
    )
    assert 0 < sum(data["times"]["kits_s"].values()) < data["times"]["wall_s"]
    for row in rows:
        assert row["failed"] == "–" and row["assigned max %"] < row["direct max %"]


def test_robustness(reports):
    data = found("robustness", reports)
    assert len(data["designs"]) == 3 and all(
        row["snapped"] == row["failed"] == 0 for row in data["designs"]
    )
    for small, large in zip(data["missed"]["0.1"], data["missed"]["1"]):
        assert small < 0.1 and small < large


def test_pavilion(reports):
    data = found("pavilion", reports)
    assert len(data["pavilions"]) == 1 and data["pavilions"][0]["elements"] > 0
