"""``kop import``: released umbrella meshes as designs."""

from __future__ import annotations

import json
import subprocess
import sys

from kop_exudyn.cli import main
from kop_exudyn.io.designs import load_design
from kop_exudyn.structures.base import FORMATS, design_from_dict, register_format


def test_a_design_is_no_released_mesh(tmp_path, capsys):
    path = tmp_path / "design.json"
    path.write_text('{"format": "kop_exudyn/design"}')
    assert main(["import", str(path), "--out", str(tmp_path / "out.json")]) == 2
    assert "is a file of kop_exudyn already" in capsys.readouterr().err
    path.write_text('{"vertices": [], "faces": []}')
    assert main(["import", str(path), "--out", str(tmp_path / "out.json")]) == 2
    assert "isn't a released umbrella mesh" in capsys.readouterr().err
    assert not (tmp_path / "out.json").exists()


def test_formats_that_a_class_registers_are_imported(tmp_path, capsys, repository):
    """No name of a format or class is known to the command."""
    own = json.loads((repository / "models" / "small" / "01_sinh.json").read_text())
    there = dict(FORMATS.items)
    register_format(
        "box of curves",
        lambda data: isinstance(data, dict) and "boxed" in data,
        lambda data, source: design_from_dict(data["boxed"], source),
        lambda data, name, source: data["boxed"] | {"name": name},
    )
    try:
        path, out = tmp_path / "any.json", tmp_path / "out.json"
        path.write_text(json.dumps({"boxed": own}))
        assert main(["import", str(path), "--out", str(out)]) == 0
        assert load_design(out).name == "any"
        told = capsys.readouterr().out
        assert f"{load_design(out).n_elements}" in told and "cells" not in told
        path.write_text("{}")
        assert main(["import", str(path), "--out", str(tmp_path / "b.json")]) == 2
        assert "isn't a box of curves or a released umbrella mesh" in capsys.readouterr().err
    finally:
        FORMATS.items.clear()
        FORMATS.items.update(there)


def test_a_damaged_drawing_is_told_in_one_line(repository):
    """Not in those of the library that reads it besides."""
    file = repository / "tests" / "corpus" / "files" / "commas_in_numbers.dxf"
    command = [sys.executable, "-m", "kop_exudyn", "import", str(file), "--preview", "no.html"]
    ended = subprocess.run(command, capture_output=True, text=True, cwd=repository)
    assert ended.returncode == 2
    assert len(ended.stderr.splitlines()) == 1 and "damaged DXF file" in ended.stderr


def test_rhino_files_without_its_library(repository, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "rhino3dm", None)
    file = repository / "tests" / "corpus" / "files" / "lines.3dm"
    assert main(["import", str(file), "--preview", "no.html"]) == 2
    told = capsys.readouterr().err
    assert "pip install 'kop_exudyn[rhino]'" in told and "lines.3dm" in told


def test_an_existing_file_is_kept(tmp_path, capsys):
    kept = tmp_path / "out.json"
    kept.write_text("mine")
    assert main(["import", str(tmp_path / "any.json"), "--out", str(kept)]) == 2
    assert kept.read_text() == "mine"


def test_a_released_mesh_becomes_a_design(tmp_path, shared_data):
    out = tmp_path / "saddle.json"
    assert (
        main(["import", str(shared_data / "umbrella" / "saddle_5t.json.gz"), "--out", str(out)])
        == 0
    )
    assert json.loads(out.read_text())["class"] == "umbrella"
    assert (
        main(
            [
                "import",
                str(shared_data / "umbrella" / "saddle_5t.json.gz"),
                "--out",
                str(out),
                "--overwrite",
                "--plates",
                "rigid",
            ]
        )
        == 0
    )
    assert json.loads(out.read_text())["plate_model"] == "rigid"
