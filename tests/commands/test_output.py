"""What the command line prints whatever the command: messages of one line, colours, verbosity."""

import argparse
import io
import logging
import subprocess
import sys

import pytest
from support.commands import status_of

from kop_exudyn.commands.output import shows_progress
from kop_exudyn.errors import InputError


def test_verbosity(design_file, simulated):
    for flags, level in (
        ([], logging.WARNING),
        (["-v"], logging.INFO),
        (["-vv"], logging.DEBUG),
        (["-q"], logging.ERROR),
    ):
        assert status_of("simulate", design_file, *flags) == 0
        assert logging.getLogger("kop_exudyn").level == level
        assert len(logging.getLogger("kop_exudyn").handlers) == 1


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize(
    "variables, coloured",
    [({}, True), ({"NO_COLOR": "1"}, False), ({"NO_COLOR": ""}, True), ({"TERM": "dumb"}, False)],
)
def test_colours_on_terminals_only(variables, coloured, monkeypatch, tmp_path, capsys):
    for name, value in ({"TERM": "xterm"} | variables).items():
        monkeypatch.setenv(name, value)
    if "NO_COLOR" not in variables:
        monkeypatch.delenv("NO_COLOR", raising=False)
    assert status_of("simulate", tmp_path / "no.json") == 2
    assert "\033" not in capsys.readouterr().err
    monkeypatch.setattr(sys, "stderr", Terminal())
    assert status_of("simulate", tmp_path / "no.json") == 2
    assert sys.stderr.getvalue().startswith("\033[31mkop:\033[0m " if coloured else "kop: ")
    logging.getLogger("kop_exudyn").warning("mind the gap")
    assert sys.stderr.getvalue().endswith(
        "kop: \033[33mWARNING\033[0m: mind the gap\n"
        if coloured
        else "kop: WARNING: mind the gap\n"
    )


def test_messages_are_one_line_whatever_the_value(design_file, simulated, capsys):
    simulated["error"] = InputError("is odd", field="points", value="a\nb")
    assert status_of("simulate", design_file) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("joints", [1, 100_000])
def test_a_reader_that_stops_early_is_no_error(joints):
    lines = [
        "import sys",
        "from types import SimpleNamespace",
        "from kop_exudyn import cli",
        "from kop_exudyn.analysis import simulation",
        "from kop_exudyn.io import designs",
        "designs.load_design = lambda path: SimpleNamespace(units=None)",
        f"answer = {{'joints': [[0.0] * 3] * {joints}}}",
        "result = SimpleNamespace(to_dict=lambda: answer)",
        "simulation.simulate = lambda design, loads, engine: result",
        "sys.exit(cli.main(['simulate', sys.executable, '--json']))",
    ]
    process = subprocess.Popen(
        [sys.executable, "-c", "\n".join(lines)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    process.stdout.close()
    with process.stderr:
        assert process.stderr.read() == ""
    assert process.wait() == 0


def test_a_bar_is_drawn_on_terminals_only(monkeypatch):
    """Files got it all on one line, with carriage returns."""
    args = argparse.Namespace(quiet=False)
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    assert not shows_progress(args)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    assert shows_progress(args) and not shows_progress(argparse.Namespace(quiet=True))
