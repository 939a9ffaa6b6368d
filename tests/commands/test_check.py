"""`kop check`: designs and the sizes at which they share parts."""

import pytest
from support.commands import status_of


def test_one_design_and_its_sizes(repository, tmp_path, capsys):
    models = repository / "models" / "small"
    arguments = ("check", models, "--designs", "2", "--parts", "linear=3,angular=2")
    out = tmp_path / "out"
    assert status_of(*arguments, "--harmonise", "0.9,1.1", "--out", out) == 0
    text = capsys.readouterr().out
    assert "2 designs, compared by a kit of 2 angular and 3 linear parts" in text
    assert "small exp" in text and "opens; deviation max" in text and "sizes: small sinh 1," in text
    assert sorted(path.name for path in out.iterdir()) == ["01_sinh.json", "03_exp.json"]


def test_a_design_alone_is_not_compared_with_others(repository, capsys):
    """There are none that could be nearer to their parts without it."""
    models = repository / "models" / "small"
    assert status_of("check", models, "--designs", "1", "--parts", "linear=3,angular=2") == 0
    text = capsys.readouterr().out
    assert text.startswith("1 design, beside a kit of 2 angular and 3 linear parts")
    assert "opens; deviation max" in text and "dearest: " in text and "others" not in text


@pytest.mark.parametrize(
    "more, message",
    [
        (("--harmonise", "0.9,1.1"), "--out: names the folder that --harmonise writes to"),
        (("--out", "x"), "--harmonise: is for rescaled designs"),
        (("--harmonise", "1.1,1.2", "--out", "x"), "expected two factors"),
        (("--parts", "linear=900"), "more parts than elements"),
        (("--parts", "cell=2"), "no elements of this kind"),
    ],
)
def test_what_makes_no_sense(more, message, repository, capsys):
    models = repository / "models" / "small"
    assert status_of("check", models, "--designs", "1", *more) == 2
    assert message in capsys.readouterr().err


def test_nothing_is_written_beside_what_is_there(repository, tmp_path, capsys, monkeypatch):
    """The first design was written, after all the work, and then the second one refused."""
    worked = []
    monkeypatch.setattr("kop_exudyn.analysis.input_check.simulate", worked.append)
    arguments = ("check", repository / "models" / "small", "--designs", "2")
    arguments += ("--harmonise", "0.9,1.1", "--out")
    (tmp_path / "03_exp.json").write_text("mine")
    assert status_of(*arguments, tmp_path) == 2
    said = capsys.readouterr().err
    assert "03_exp.json: exists already: take another folder" in said
    assert [path.name for path in tmp_path.iterdir()] == ["03_exp.json"]
    assert status_of(*arguments, tmp_path / "03_exp.json") == 2
    assert "is a file, expected a folder" in capsys.readouterr().err and not worked
