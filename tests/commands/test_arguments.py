"""What the command line accepts, and what it says of what it doesn't."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from support.commands import status_of

from kop_exudyn import __version__
from kop_exudyn.cli import make_parser
from kop_exudyn.commands import NAMES


class TestHelp:
    def test_help_lists_commands_and_exit_status(self, capsys):
        assert status_of("--help") == 0
        text = capsys.readouterr().out
        for word in (*NAMES, "exit status", "130", "examples:", "NO_COLOR"):
            assert word in text

    @pytest.mark.parametrize("name", NAMES)
    def test_every_command_has_examples(self, name, capsys):
        assert status_of(name, "--help") == 0
        text = capsys.readouterr().out
        assert f"examples:\n  kop {name} " in text and "exit status" in text
        for option in ("--json", "--quiet", "--verbose"):
            assert option in text
        assert max(map(len, text.splitlines())) <= 120

    def test_version(self, capsys):
        assert status_of("--version") == 0
        assert capsys.readouterr().out == f"kop_exudyn {__version__}\n"

    def test_help_loads_no_library(self):
        """So that it is there at once: the time that it takes is that of its imports."""
        code = (
            "import sys\nfrom kop_exudyn.cli import make_parser\nmake_parser().format_help()\n"
            "print(*(m for m in ('numpy', 'scipy', 'exudyn', 'matplotlib', 'jsonschema', 'shtab') "
            "if m in sys.modules), sum(m.startswith('kop_exudyn') for m in sys.modules))"
        )
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        )
        assert int(done.stdout) < 30

    def test_as_a_module(self):
        done = subprocess.run(
            [sys.executable, "-m", "kop_exudyn", "--version"], capture_output=True, text=True
        )
        assert (done.returncode, done.stdout) == (0, f"kop_exudyn {__version__}\n")


@pytest.mark.parametrize(
    "arguments, message",
    [
        ((), "required: COMMAND"),
        (("fly",), "invalid choice: 'fly'"),
        (("simulate",), "required: DESIGN"),
        (("optimize", "x", "--parts", "linear=1"), "required: --out"),
        (
            ("optimize", "x", "--parts", "linear=1", "--out", "y", "--jobs", "0"),
            "--jobs: the value must be a whole",
        ),
        (
            ("optimize", "x", "--parts", "linear=1", "--out", "y", "--designs", "0"),
            "--designs: the number of",
        ),
        (
            ("optimize", "x", "--parts", "linear=1", "--out", "y", "--designs", "a,,b"),
            "--designs: expected a number",
        ),
        (
            ("optimize", "x", "--parts", "linear=1", "--out", "y", "--seed", "-1"),
            "--seed: the value must be a whole",
        ),
        (("simulate", "x", "-q", "-v"), "not allowed with"),
    ],
)
def test_one_line_and_status_2(arguments, message, capsys):
    assert status_of(*arguments) == 2
    output = capsys.readouterr()
    assert message in output.err and output.err.count("\n") == 1 and output.out == ""


def test_names_that_are_too_long_for_a_file(capsys, tmp_path):
    long = "n" * 300
    for arguments in (
        ("simulate", long),
        ("view", long, "--out", "y"),
        ("optimize", long, "--parts", "linear=1", "--out", "y"),
        ("export", long, long, "--unit", "m", "--out", long),
    ):
        assert status_of(*arguments) == 2
        error = capsys.readouterr().err
        assert error.startswith(f"kop: {long}: ") and error.count("\n") == 1


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("optimze models", "did you mean 'optimize'"),
        ("simulate DESIGN --jsn", "unknown argument --jsn: did you mean '--json'"),
        ("-q simulate DESIGN", "-q: it goes after the command, as in kop simulate -q"),
        ("simulate DESIGN --engine exudin", "did you mean 'exudyn'"),
        ("optimize FOLDER --parts linera=3 --out OUT", "--parts = 'linera'.*did you mean 'linear'"),
        ("view DESIGN --out DESIGN", "exists already .--overwrite replaces it"),
        ("optimize FOLDER --parts linear=2,angular=2 --out FULL", "overwriting .--overwrite repl"),
        ("import no.dxf --out a.json", "no.dxf: no such file"),
        ("export none FOLDER --out OUT", "none: no such folder"),
    ],
)
def test_messages_say_what_was_meant(line, message, repository, tmp_path, capsys):
    small = repository / "models" / "small"
    full = tmp_path / "full"
    full.mkdir()
    (full / "notes.txt").write_text("mine")
    places = {"DESIGN": small / "01_sinh.json", "FOLDER": small, "OUT": tmp_path / "out"}
    places["FULL"] = full
    words = [places.get(word, word) for word in line.split()]
    assert status_of(*words) == 2
    assert re.search(message, capsys.readouterr().err)
    assert not (tmp_path / "out").exists() and [p.name for p in full.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize("columns", [60, 80, 120])
def test_help_is_as_wide_as_the_terminal(monkeypatch, columns):
    """Paragraphs were written for 100 columns once, and broken anyhow by narrower terminals. Lines
    to type stay whole."""
    monkeypatch.setenv("COLUMNS", str(columns))
    subparsers = make_parser()._subparsers._group_actions[0].choices
    assert set(subparsers) == set(NAMES)
    for parser in subparsers.values():
        text = parser.format_help()
        described = text.split("\n\n", 1)[1]
        for line in described.split("\nexamples:")[0].splitlines():
            assert len(line) <= columns
        words = " ".join(described.split())
        assert " ".join(parser.description.split())[:200] in words
        assert parser.epilog.split("\n\n")[0] in text  # the examples, line by line


@pytest.mark.parametrize(
    "command",
    [
        "import net.dxf --as grid --surface vualt.obj --out a.json",
        "import net.dxf --target vualt.obj --out a.json",
        "optimize . --stock vualt.obj --out out",
        "optimize . --kit vualt.obj --parts liner=3 --out out",
    ],
)
def test_files_that_options_name_are_looked_for_first(command, tmp_path, monkeypatch, capsys):
    """Before anything else is missed: a section, say."""
    monkeypatch.chdir(tmp_path)
    Path("net.dxf").touch()
    Path("vault.obj").touch()
    assert status_of(*command.split()) == 2
    told = capsys.readouterr().err
    assert told == "kop: vualt.obj: no such file (did you mean 'vault.obj'?)\n"
    assert not Path("out").exists()


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")
@pytest.mark.parametrize("redirected, status", [("> /dev/full", 2), (">&-", 0)])
def test_output_that_can_not_be_written(repository, redirected, status):
    """One line; they were tracebacks, with the status of a failed simulation."""
    model = repository / "models" / "small" / "01_sinh.json"
    command = f"'{sys.executable}' -m kop_exudyn simulate '{model}' {redirected}"
    done = subprocess.run(command, shell=True, stderr=subprocess.PIPE, text=True, cwd=repository)
    assert done.returncode == status and "Traceback" not in done.stderr
    assert ("standard output can't be written: no space" in done.stderr) == (status == 2)
