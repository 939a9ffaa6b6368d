"""The benchmark in its quick mode: all parts are there, and their figures hang together."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

STUDY = Path(__file__).resolve().parents[2] / "studies" / "benchmark.py"


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    out = tmp_path_factory.mktemp("benchmark")
    subprocess.run([sys.executable, str(STUDY), "--quick", "--out", str(out)], check=True, cwd=out)
    assert "goals are met" in (out / "index.html").read_text()
    return json.loads((out / "data.json").read_text())


def test_finer_elements_are_nearer_to_the_fine_solution(found):
    for case in ("C-shell", "grid"):
        coarse, fine = (row["error %"] for row in found["deployments"] if row["case"] == case)
        assert 0 < fine < coarse < 1


def test_all_ways_agree_where_they_converge(found):
    strip = [row for row in found["ways"] if row["case"] == "cantilever"]
    assert all(isinstance(row["iterations"], int) for row in strip)
    for n in (1, 2):
        errors = [row["error %"] for row in strip if row["elements a piece"] == n]
        assert max(errors) - min(errors) < 1e-6


def test_phases_add_up_and_memory_is_bounded(found):
    for row in found["scaling"]:
        assert row["assembly"] + row["factorisation"] + row["rest"] == pytest.approx(
            row["seconds"], rel=1e-6
        )
        assert row["before MiB"] <= row["peak MiB"] < 2048
    assert [row["unknowns"] for row in found["scaling"]] == sorted(
        row["unknowns"] for row in found["scaling"]
    )


def test_steps_lower_the_objective(found):
    for row in found["steps"]:
        assert row["after"] < row["objective before"] and row["equilibria a step"] >= 1
