"""`kop simulate`: what it prints, and how it ends."""

import json

import pytest
from support.commands import status_of

from kop_exudyn.errors import SimulationFailure


def test_json(design_file, simulated, answer, capsys):
    assert status_of("simulate", design_file, "--json") == 0
    output = capsys.readouterr()
    assert json.loads(output.out) == answer and output.err == ""


def test_for_people(design_file, simulated, capsys):
    assert status_of("simulate", design_file) == 0
    text = capsys.readouterr().out
    for piece in ("arch", "max 1.5 %", "20 elements", "0.6 rad", "1.25"):
        assert piece in text


def test_a_failure_is_data_with_json(design_file, simulated, capsys):
    simulated["error"] = SimulationFailure("no equilibrium", where="deployed state")
    assert status_of("simulate", design_file, "--json") == 1
    output = capsys.readouterr()
    assert json.loads(output.out) == {
        "design": "arch",
        "failed": "deployed state: no equilibrium",
    }
    assert output.err == "kop: simulation failed: deployed state: no equilibrium\n"


def test_a_failure_is_one_line_without(design_file, simulated, capsys):
    simulated["error"] = SimulationFailure("no equilibrium,\nnot even one")
    assert status_of("simulate", design_file) == 1
    output = capsys.readouterr()
    assert (
        output.out == "" and output.err == "kop: simulation failed: no equilibrium, not even one\n"
    )


@pytest.mark.parametrize(
    "content, message",
    [
        ("{", "not JSON: line 1, column 2"),
        (
            '{"format": "kop_exudyn/design", "version": 1, "class": "c_shell", "name": "a", '
            '"young": NaN}',
            "NaN is not",
        ),
        (
            '{"format": "kop_exudyn/design", "version": 9}',
            "version = 9: written for a newer kop_exudyn",
        ),
    ],
)
def test_unusable_files(content, message, tmp_path, capsys):
    file = tmp_path / "bad.json"
    file.write_text(content)
    assert status_of("simulate", file, "--json") == 2
    output = capsys.readouterr()
    assert output.out == "" and output.err.startswith(f"kop: {file}: ")
    assert message in output.err and output.err.count("\n") == 1


def test_missing_file(tmp_path, capsys):
    assert status_of("simulate", tmp_path / "no.json") == 2
    assert capsys.readouterr().err == f"kop: {tmp_path / 'no.json'}: no such file\n"


@pytest.mark.parametrize("typed", ["01_sinh", "01_sihn.json", "01_Sinh.jsn"])
def test_a_file_that_is_nearly_there_is_named(typed, tmp_path, capsys):
    """Without its ending, with letters swapped, with another ending."""
    (tmp_path / "01_sinh.json").write_text("{}")
    (tmp_path / "03_exp.json").write_text("{}")
    assert status_of("simulate", tmp_path / typed) == 2
    meant = tmp_path / "01_sinh.json"
    assert capsys.readouterr().err.endswith(f"(did you mean {str(meant)!r}?)\n")


def test_interruption(design_file, simulated, capsys):
    simulated["error"] = KeyboardInterrupt()
    assert status_of("simulate", design_file) == 130
    assert capsys.readouterr().err == "kop: interrupted\n"


def test_a_bug_is_not_hidden(design_file, simulated):
    simulated["error"] = ZeroDivisionError()
    with pytest.raises(ZeroDivisionError):
        status_of("simulate", design_file)
