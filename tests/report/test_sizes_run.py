"""Searches over kit sizes: what they leave in their folder, and going on after an interruption."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from support.settings import QUICK
from support.zigzags import zigzags

from kop_exudyn.analysis.verdict import VerdictSettings
from kop_exudyn.errors import InputError
from kop_exudyn.fabrication.limits import part_bounds
from kop_exudyn.io.checkpoint import CheckpointStore
from kop_exudyn.io.designs import load_design
from kop_exudyn.io.kits import load_kit
from kop_exudyn.io.results import load_result
from kop_exudyn.report import sizes_run
from kop_exudyn.report.sizes_run import smallest_and_report, tradeoff_and_report
from kop_exudyn.search.settings import JobSettings

STAGES = replace(
    QUICK,
    schedule=(1e3, 1e5),
    path_steps=4,
    leaps=0,
    reassignments=1,
)
SETTINGS = JobSettings(jobs=1, stages=STAGES, baselines=False)
SIZES = [{"linear": n, "angular": 2} for n in (2, 4)]


def shown(folder):
    """The table without what depends on the clock."""
    rows = json.loads((folder / "tradeoff.json").read_text(encoding="utf-8"))["kits"]
    return [{k: v for k, v in row.items() if k not in ("seconds", "equilibria")} for row in rows]


def test_a_trade_off_and_what_is_left_of_it_when_killed(tmp_path, monkeypatch):
    kits = tradeoff_and_report(zigzags(), SIZES, out=tmp_path / "whole", settings=SETTINGS)
    rows = shown(tmp_path / "whole")
    assert [row["linear"] for row in rows] == [2, 4] and rows[0]["parts"] == 4
    with open(tmp_path / "whole" / "tradeoff.csv", encoding="utf-8") as file:
        assert [float(row["max %"]) for row in csv.DictReader(file)] == [
            kit.max_percent for kit in kits
        ]
    page = (tmp_path / "whole" / "index.html").read_text(encoding="utf-8")
    assert "2_linear-2_angular/index.html" in page
    for kit, name in zip(kits, ("2_linear-2_angular", "4_linear-2_angular")):
        assert (
            load_kit(tmp_path / "whole" / name / "kit.json").to_dict() == kit.result.kit.to_dict()
        )

    saves = []
    whole = CheckpointStore.save

    def killed(store, name, arrays):
        saves.append(name)
        if len(saves) == 12:
            raise KeyboardInterrupt
        whole(store, name, arrays)

    monkeypatch.setattr(CheckpointStore, "save", killed)
    again = {"out": tmp_path / "again", "settings": SETTINGS}
    with pytest.raises(KeyboardInterrupt):
        tradeoff_and_report(zigzags(), SIZES, **again)
    monkeypatch.undo()
    tradeoff_and_report(zigzags(), SIZES, **again, resume=True)
    assert shown(tmp_path / "again") == rows
    with pytest.raises(InputError, match="different job"):
        tradeoff_and_report(zigzags(), SIZES[1:], **again, resume=True)


def test_the_smallest_kit_and_its_report(tmp_path, monkeypatch):
    looked, given = [], sizes_run.given_verdicts
    monkeypatch.setattr(
        sizes_run, "given_verdicts", lambda *asked: looked.append(1) or given(*asked)
    )
    asked = VerdictSettings(length=3e-4, angle=2e-4, samples=3)
    chosen, kept = smallest_and_report(
        zigzags(), 50.0, {"linear": 2, "angular": 1}, out=tmp_path, settings=SETTINGS, verdict=asked
    )
    assert kept and chosen.sizes == {"linear": 1, "angular": 1}
    data = load_result(tmp_path / "result.json")
    assert data["settings"]["max_deviation"] == 50.0 and len(data["kit"]["linear"]) == 1
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "The smallest kit found that keeps every design within 50\xa0%" in page
    assert len(shown(tmp_path)) == 2 and len(looked) == 1  # at the inputs, of both searches
    for design in data["designs"]:
        assert design["input"]["buildable"]["verdict"]
        tried = design["buildable"]["tolerance"]  # what cut lists go by; the usual errors, once
        assert (tried["length"], tried["angle"], tried["samples"]) == (3e-4, 2e-4, 3)


@pytest.mark.parametrize("run", ["smallest", "tradeoff"])
def test_parts_keep_to_what_the_workshop_asks_of_them(repository, tmp_path, monkeypatch, run):
    """As in a search for one kit; the job that a folder is resumed for says so as well."""
    designs = [load_design(repository / "models" / "small" / "03_exp.json")]
    wanted = part_bounds(designs)
    seen = []

    def searched(*arguments, settings, **others):
        seen.append(settings.stages.bounds)
        raise KeyboardInterrupt

    monkeypatch.setattr(sizes_run, "smallest_kit", searched)
    monkeypatch.setattr(sizes_run, "trade_off", searched)
    with pytest.raises(KeyboardInterrupt):
        if run == "smallest":
            smallest_and_report(designs, 1.0, SIZES[0], out=tmp_path, settings=SETTINGS)
        else:
            tradeoff_and_report(designs, SIZES, out=tmp_path, settings=SETTINGS)
    assert set(seen[0]) == {"linear", "angular"}
    for kind, sides in wanted.items():
        for side, own in zip(sides, seen[0][kind]):
            assert np.array_equal(side, own)
