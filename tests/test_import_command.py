"""``kop import``: released umbrella meshes as designs."""

from __future__ import annotations

import json

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
