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
    return json.loads((out / "data.json").read_text())


def test_what_misses_its_goal_is_said_first(found):
    missed = [row["goal"] for row in found["goals"] if row["met"] != "yes"]
    beginning = found["finding"].partition(").")[0]
    assert all(goal in beginning for goal in missed)
    assert beginning.startswith("Short of what was asked for") == bool(missed)


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
