"""The designs that come with the package."""

import pytest

from kop_exudyn.cli import main
from kop_exudyn.errors import InputError
from kop_exudyn.io.designs import load_design
from kop_exudyn.io.examples import copy_examples, example_files


def test_copies_can_be_read_and_are_not_overwritten(tmp_path, capsys):
    assert main(["examples", str(tmp_path / "models")]) == 0
    assert str(tmp_path / "models" / "small") in capsys.readouterr().out
    copies = [tmp_path / "models" / f.parent.name / f.name for f in example_files()]
    assert [copy.read_bytes() for copy in copies] == [f.read_bytes() for f in example_files()]
    assert load_design(tmp_path / "models" / "small" / "01_sinh.json").name == "small sinh"
    copies[0].write_text("mine")
    copies[-1].unlink()
    with pytest.raises(InputError, match="exists"):
        copy_examples(tmp_path / "models")
    assert copies[0].read_text() == "mine" and not copies[-1].exists()
    copy_examples(tmp_path / "models", overwrite=True)
    assert copies[0].read_text() != "mine"
