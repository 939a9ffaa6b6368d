"""The studies of failures and of wrong files, in their quick modes."""

from __future__ import annotations

from support.quick_studies import found


def test_quick_failure_and_rescue(tmp_path):
    data = found("failure_and_rescue", tmp_path)
    cases = data["cases"]
    failed = [case for case in cases if case["snapped"] or case["no equilibrium"]]
    assert len(cases) >= 2 and len(failed) < len(cases)
    assert all((case["rescue"] is not None) == (case in failed) for case in cases)
    for case in failed:
        assert case["rescue"]["weight"] in (10 * case["weight"], 100 * case["weight"])
    if failed:
        largest = max(case["snap %"] or 0.0 for case in cases)
        assert f"{len(failed)} of {len(cases)} cases" in data["finding"]
        assert f"jumps {largest:.0f} %" in data["finding"]
    else:  # whether anything fails depends on the models; test_rescue.py has cases that do
        assert "snap" in data["finding"]


def test_soak(tmp_path):
    data = found("soak", tmp_path)
    assert len(data["cases"]) == 20 and data["wrong"] == []
    assert {row["class"] for row in data["outcomes"]} == {"C-shells", "grids", "umbrella meshes"}
    assert sum(case["outcome"] == "stable" for case in data["cases"]) >= 15
