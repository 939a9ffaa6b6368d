"""``kop export``: errors before anything is written."""

from __future__ import annotations

from kop_exudyn.cli import main


def test_a_folder_without_a_result_is_named(tmp_path, repository, capsys):
    status = main(
        [
            "export",
            str(tmp_path),
            str(repository / "models" / "grids"),
            "--unit",
            "m",
            "--out",
            str(tmp_path / "out"),
        ]
    )
    assert status == 2
    assert "result.json" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
