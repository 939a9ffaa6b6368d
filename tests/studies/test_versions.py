"""The comparison of versions, of this one with itself."""

from __future__ import annotations

import csv
import runpy
import sys
from pathlib import Path

import pytest

from kop_exudyn.errors import InputError
from lib.versions import Case, Version, compared, copied

STUDY = Path(__file__).resolve().parents[2] / "studies" / "versions.py"


def test_a_version_compared_with_itself(repository, tmp_path, monkeypatch):
    arguments = ["--quick", "--other", str(repository), "--out", str(tmp_path / "report")]
    monkeypatch.setattr(sys, "argv", ["versions", *arguments])
    runpy.run_path(str(STUDY), run_name="__main__")
    with open(tmp_path / "report" / "versions.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3
    for row in rows:
        assert row["same state"] == "yes"
        assert float(row["ratio"]) == pytest.approx(float(row["this"]) / float(row["other"]))
        assert float(row["least ratio"]) <= float(row["most"])
    assert "Both versions" in (tmp_path / "report" / "index.html").read_text()


def test_copies_have_nothing_compiled_and_other_sources_are_refused(repository, tmp_path):
    version = copied(str(repository), "copy", repository, tmp_path)
    assert (version.folder / "models" / "small" / "01_sinh.json").is_file()
    assert not list(version.folder.rglob("__pycache__"))
    file = version.folder / "kop_exudyn" / "__main__.py"  # what runs is the copy, from any folder
    file.write_text('print("{\\"fit\\": {\\"max_percent\\": 7.0}}")\n')
    assert version.measure(Case("a", "warm", "small/01_sinh.json"))[1] == 7.0
    with pytest.raises(InputError, match="neither a folder nor a commit"):
        copied("no-such-commit", "other", repository, tmp_path)


def test_what_fails_and_what_differs_is_said(tmp_path, monkeypatch):
    found = {"this": (1.0, 3.0), "other": (2.0, 3.1)}
    monkeypatch.setattr(Version, "measure", lambda self, case: found[self.name])
    versions = tuple(Version(name, tmp_path, tmp_path) for name in ("this", "other"))
    (row,) = compared([Case("a", "iteration", "4")], *versions)
    assert row["ratio"] == 0.5 and row["same state"] == "no: 3 and 3.1"

    def fails(self, case):
        raise RuntimeError("unknown field")

    monkeypatch.setattr(Version, "measure", fails)
    (row,) = compared([Case("a", "iteration", "4")], *versions)
    assert row["ratio"] is None and row["same state"] == "other failed: unknown field"
