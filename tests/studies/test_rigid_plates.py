"""The study of rigid plates, in its quick mode."""

from __future__ import annotations

import json
import runpy
import sys
from pathlib import Path

from support.quick_studies import words_of

STUDY = Path(__file__).resolve().parents[2] / "studies" / "rigid_plates.py"


def test_quick_run_reports_what_rigid_plates_cost(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", [str(STUDY), "--quick", "--out", str(tmp_path)])
    runpy.run_path(str(STUDY), run_name="__main__")
    found = json.loads((tmp_path / "data.json").read_text())
    rods, rigid = (
        [row for row in found["plates"] if row["plates"] == model] for model in ("rods", "rigid")
    )
    assert len(rods) == len(rigid) == 2
    for a, b in zip(rods, rigid):
        assert b["unknowns"] < a["unknowns"] and a["stable"] and b["stable"]
        assert (
            a["moved_max_percent"] < 1e-9 < b["moved_max_percent"] < 1 and b["energy_percent"] > 0
        )
    apart = [row["joints apart, max %"] for row in found["stiffer"]]
    assert apart == sorted(apart, reverse=True) and apart[-1] < 0.01 * apart[0]
    assert found["finding"].startswith("Rigid plates") and found["finding"] in words_of(
        tmp_path / "index.html"
    )
