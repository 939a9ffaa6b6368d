"""``kop import``: released umbrella meshes as designs."""

from __future__ import annotations

import json

from kop_exudyn.cli import main


def test_a_design_is_no_released_mesh(tmp_path, capsys):
    path = tmp_path / "design.json"
    path.write_text('{"format": "kop_exudyn/design"}')
    assert main(["import", str(path), "--out", str(tmp_path / "out.json")]) == 2
    assert "is a file of kop_exudyn already" in capsys.readouterr().err
    path.write_text('{"vertices": [], "faces": []}')
    assert main(["import", str(path), "--out", str(tmp_path / "out.json")]) == 2
    assert "isn't a released umbrella mesh" in capsys.readouterr().err
    assert not (tmp_path / "out.json").exists()


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
