"""The Grasshopper script component, run as Grasshopper does: inputs are globals, so are outputs."""

import runpy
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "docs" / "grasshopper" / "kop_component.py"


@pytest.fixture
def program(tmp_path, monkeypatch):
    """kop as one file, as components know it."""
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    path = tmp_path / "kop"
    path.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m kop_exudyn "$@"\n')
    path.chmod(0o755)
    return path


def component(**inputs):
    return runpy.run_path(str(SCRIPT), init_globals=inputs)


@pytest.mark.skipif(sys.platform == "win32", reason="needs a shell")
def test_a_design_is_simulated(program):
    design = ROOT / "models" / "small" / "01_sinh.json"
    found = component(kop=program, arguments=["simulate", str(design)], run=True)
    assert found["error"] == "" and len(found["joints"]) > 5
    assert all(len(place) == 3 for place in found["joints"])
    names = [line.split(":")[0] for line in found["figures"]]
    assert {"design", "fit.max_percent", "fit.pieces_max", "stable"} <= set(names)


@pytest.mark.skipif(sys.platform == "win32", reason="needs a shell")
def test_files_that_an_export_writes_are_named(program, tmp_path):
    design = ROOT / "models" / "small" / "01_sinh.json"
    arguments = ["export", str(design), "--out", str(tmp_path / "out")]
    found = component(kop=program, arguments=arguments, run=True)
    assert found["error"] == "" and all(Path(file).is_file() for file in found["files"])
    assert any(file.endswith(".3dm") for file in found["files"])


@pytest.mark.skipif(sys.platform == "win32", reason="needs a shell")
def test_what_is_wrong_is_said(program, tmp_path):
    found = component(kop=program, arguments=["simulate", str(tmp_path / "no.json")], run=True)
    assert "no such file" in found["error"] and found["joints"] == []
    missing = component(kop=tmp_path / "absent", arguments=[], run=True)
    assert "absent" in missing["error"]


def test_nothing_runs_before_the_button_is_pressed():
    found = component(kop="nothing", arguments=[], run=False)
    assert (found["joints"], found["files"], found["error"]) == ([], [], "")
