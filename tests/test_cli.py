"""The command line: what it accepts, what it says, and with which exit status it ends."""

import io
import json
import logging
import re
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from kop_exudyn import __version__, cli
from kop_exudyn.analysis import simulation
from kop_exudyn.commands import NAMES
from kop_exudyn.errors import InputError, SimulationFailure
from kop_exudyn.io.kits import load_kit, save_kit
from kop_exudyn.kit.parts import Kit
from kop_exudyn.report import kit_run
from kop_exudyn.structures import base

ANSWER = {
    "design": "arch",
    "unknowns": 120,
    "elements": 20,
    "engine": "fast",
    "newton_iterations": 12,
    "wall_s": 0.5,
    "elastic_energy": 1.25,
    "stable": True,
    "opening_angle": 0.6,
    "assembly_angle": 0.1,
    "exudyn": {
        "version": "1.13",
        "newton_steps": 1,
        "residual": 1e-12,
        "moved": 1e-12,
        "wall_s": 0.1,
    },
    "fit": {
        "max_percent": 1.5,
        "mean_percent": 0.5,
        "pieces_max_percent": 1.75,
        "pieces_mean_percent": 0.75,
        "max": 0.03,
        "mean": 0.01,
        "pieces_max": 0.035,
        "pieces_mean": 0.015,
    },
    "displaced_percent": 2.5,
    "joints": [[0.0, 0.0, 0.0]],
    "strength": {"deployed": {"equivalent_stress": 3e7, "utilisation": 0.75, "element": 3}},
}


@pytest.fixture(autouse=True)
def quiet_loggers():
    """Leaves the package's logger as it was."""
    logger = logging.getLogger("kop_exudyn")
    before = logger.level, logger.handlers[:]
    yield
    logger.setLevel(before[0])
    logger.handlers[:] = before[1]


@pytest.fixture
def design_file(monkeypatch, write_json_file):
    """A design of a class whose reader only keeps the name."""
    monkeypatch.setitem(
        base.CLASSES.items,
        "named",
        lambda data, source: SimpleNamespace(
            middle=np.zeros(3), name=data["name"], fit_weight=1e5, stress_weight=0.0, units=None
        ),
    )
    return write_json_file(
        "set/arch.json",
        {"format": "kop_exudyn/design", "version": 1, "class": "named", "name": "arch"},
    )


@pytest.fixture
def simulated(monkeypatch):
    """Replaces the simulation by a known answer, or by an error put into the dict."""
    outcome = {}

    def simulate(design, loads=None, engine="fast"):
        if "error" in outcome:
            raise outcome["error"]
        return SimpleNamespace(to_dict=lambda: ANSWER)

    monkeypatch.setattr(simulation, "simulate", simulate)
    return outcome


def status_of(*arguments) -> int:
    """The exit status, whether main returns it or argparse exits with it."""
    try:
        return cli.main([str(argument) for argument in arguments])
    except SystemExit as end:
        return end.code


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


class TestArguments:
    @pytest.mark.parametrize(
        "parts, message",
        [
            ("linear", "expected KIND=NUMBER,..., got 'linear'"),
            ("linear=0", "the number of linear parts must be a whole number, at least 1, got '0'"),
            ("linear=-3", "got '-3'"),
            ("linear=2.5", "got '2.5'"),
            ("linear=", "got ''"),
            ("=3", "expected KIND=NUMBER"),
            ("linear=3,,angular=2", "expected KIND=NUMBER"),
            ("linear=3,linear=4", "the kind 'linear' is given twice"),
        ],
    )
    def test_parts_that_make_no_sense(self, parts, message, capsys, tmp_path):
        assert status_of("optimize", tmp_path, "--parts", parts, "--out", tmp_path / "out") == 2
        error = capsys.readouterr().err
        assert message in error and error.count("\n") == 1

    def test_unknown_kind_of_parts(self, capsys, design_file, tmp_path):
        assert (
            status_of(
                "optimize", design_file.parent, "--parts", "cubic=3", "--out", tmp_path / "out"
            )
            == 2
        )
        error = capsys.readouterr().err
        assert "'cubic': unknown kind of parts (known: angular," in error and error.count("\n") == 1
        assert not (tmp_path / "out").exists()

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
    def test_one_line_and_status_2(self, arguments, message, capsys):
        assert status_of(*arguments) == 2
        output = capsys.readouterr()
        assert message in output.err and output.err.count("\n") == 1 and output.out == ""


class TestSimulate:
    def test_json(self, design_file, simulated, capsys):
        assert status_of("simulate", design_file, "--json") == 0
        output = capsys.readouterr()
        assert json.loads(output.out) == ANSWER and output.err == ""

    def test_for_people(self, design_file, simulated, capsys):
        assert status_of("simulate", design_file) == 0
        text = capsys.readouterr().out
        for piece in ("arch", "max 1.5 %", "20 elements", "0.6 rad", "1.25"):
            assert piece in text

    def test_a_failure_is_data_with_json(self, design_file, simulated, capsys):
        simulated["error"] = SimulationFailure("no equilibrium", where="deployed state")
        assert status_of("simulate", design_file, "--json") == 1
        output = capsys.readouterr()
        assert json.loads(output.out) == {
            "design": "arch",
            "failed": "deployed state: no equilibrium",
        }
        assert output.err == "kop: simulation failed: deployed state: no equilibrium\n"

    def test_a_failure_is_one_line_without(self, design_file, simulated, capsys):
        simulated["error"] = SimulationFailure("no equilibrium,\nnot even one")
        assert status_of("simulate", design_file) == 1
        output = capsys.readouterr()
        assert (
            output.out == ""
            and output.err == "kop: simulation failed: no equilibrium, not even one\n"
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
    def test_unusable_files(self, content, message, tmp_path, capsys):
        file = tmp_path / "bad.json"
        file.write_text(content)
        assert status_of("simulate", file, "--json") == 2
        output = capsys.readouterr()
        assert output.out == "" and output.err.startswith(f"kop: {file}: ")
        assert message in output.err and output.err.count("\n") == 1

    def test_missing_file(self, tmp_path, capsys):
        assert status_of("simulate", tmp_path / "no.json") == 2
        assert capsys.readouterr().err == f"kop: {tmp_path / 'no.json'}: no such file\n"

    def test_several_files_are_to_be_a_folder(self, tmp_path, capsys):
        files = [tmp_path / name for name in ("a.json", "b.json")]
        for file in files:
            file.write_text("{}")
        out = tmp_path / "out"
        assert status_of("optimize", *files, "--parts", "linear=3", "--out", out) == 2
        assert "are one folder, or some of a folder by --designs" in capsys.readouterr().err

    @pytest.mark.parametrize("typed", ["01_sinh", "01_sihn.json", "01_Sinh.jsn"])
    def test_a_file_that_is_nearly_there_is_named(self, typed, tmp_path, capsys):
        """Without its ending, with letters swapped, with another ending."""
        (tmp_path / "01_sinh.json").write_text("{}")
        (tmp_path / "03_exp.json").write_text("{}")
        assert status_of("simulate", tmp_path / typed) == 2
        meant = tmp_path / "01_sinh.json"
        assert capsys.readouterr().err.endswith(f"(did you mean {str(meant)!r}?)\n")

    def test_interruption(self, design_file, simulated, capsys):
        simulated["error"] = KeyboardInterrupt()
        assert status_of("simulate", design_file) == 130
        assert capsys.readouterr().err == "kop: interrupted\n"

    def test_a_bug_is_not_hidden(self, design_file, simulated):
        simulated["error"] = ZeroDivisionError()
        with pytest.raises(ZeroDivisionError):
            status_of("simulate", design_file)


class TestOptimize:
    @pytest.fixture
    def asked(self, monkeypatch):
        """Replaces the optimisation; collects what it was asked for."""
        asked = {"failed": []}

        def optimize_and_report(designs, parts, **options):
            asked.update(designs=[design.name for design in designs], parts=parts, **options)

            def summary(stage, n):
                return {"failed": "no"} if designs[n].name in asked["failed"] else {}

            return SimpleNamespace(
                designs=designs, summary=summary, buildable=(), verdict=(), warnings=()
            )

        monkeypatch.setattr(kit_run, "optimize_and_report", optimize_and_report)
        return asked

    def test_options_arrive(self, asked, design_file, tmp_path, capsys):
        out = tmp_path / "out"
        assert (
            status_of(
                "optimize",
                design_file.parent,
                "--parts",
                "linear=12,angular=5",
                "--out",
                out,
                "--seed",
                3,
                "--jobs",
                2,
                "--max-steps",
                7,
                "--designs",
                1,
                "--resume",
                "-q",
            )
            == 0
        )
        assert asked["designs"] == ["arch"] and asked["parts"] == {"linear": 12, "angular": 5}
        assert asked["out"] == out and asked["inputs"] == (design_file,)
        assert (asked["resume"], asked["overwrite"], asked["progress"]) == (True, False, False)
        settings = asked["settings"]
        assert (settings.jobs, settings.stages.seed) == (2, 3)
        assert settings.stages.relaxed_steps == settings.stages.assigned_steps == 7
        assert capsys.readouterr().out == f"{out / 'index.html'}\n"

    def test_a_study_file_and_options_that_come_before_it(
        self, asked, design_file, tmp_path, capsys
    ):
        study = tmp_path / "study.toml"
        study.write_text(
            'format = "kop_exudyn/study"\nversion = 1\ndesigns = ["set/arch.json"]\nbaselines = '
            "false\n"
            "parts = {linears = 7}\nsettings = {seed = 4, redeployments = 2, relaxed_steps = 9}\n"
        )
        assert status_of("optimize", study, "--out", tmp_path / "out", "--jobs", 1) == 0
        assert asked["parts"] == {"linear": 7} and asked["inputs"] == (design_file,)
        settings = asked["settings"]
        assert (
            settings.stages.seed,
            settings.stages.redeployments,
            settings.stages.relaxed_steps,
        ) == (4, 2, 9)
        assert settings.baselines is False
        assert (
            status_of(
                "optimize",
                study,
                "--out",
                tmp_path / "out",
                "--seed",
                0,
                "--parts",
                "linear=3,angular=1",
                "--max-steps",
                5,
            )
            == 0
        )
        assert asked["parts"] == {"linear": 3, "angular": 1}
        stages = asked["settings"].stages
        assert (stages.seed, stages.redeployments, stages.relaxed_steps, stages.assigned_steps) == (
            0,
            2,
            5,
            5,
        )

    def test_parts_must_come_from_somewhere(self, asked, design_file, tmp_path, capsys):
        assert status_of("optimize", design_file.parent, "--out", tmp_path / "out") == 2
        assert (
            "--parts, --kit or --stock is required" in capsys.readouterr().err
            and "parts" not in asked
        )

    def test_a_kit_that_exists(self, asked, design_file, tmp_path, capsys):
        file = save_kit(
            tmp_path / "kit.json", Kit({"linear": [[0.1, 0.2], [0.3, 0.3]], "angular": [0.2]})
        )
        arguments = ("optimize", design_file.parent, "--out", tmp_path / "out", "--kit")
        assert status_of(*arguments, file) == 0
        assert asked["parts"] is None and asked["kit"].to_dict() == load_kit(file).to_dict()
        assert status_of(*arguments, file, "--parts", "linear=2") == 2
        assert "give --kit or --parts" in capsys.readouterr().err
        assert status_of(*arguments, tmp_path / "no.json") == 2
        assert "no.json: no such file" in capsys.readouterr().err

    def test_a_stock(self, asked, design_file, tmp_path, capsys):
        file = tmp_path / "store.csv"
        file.write_text("kind,count,l1,l2,angle\nlinear,7,0.2,0.1,\nangular,3,,,-0.4\n")
        arguments = ("optimize", design_file.parent, "--out", tmp_path / "out", "--stock")
        assert status_of(*arguments, file, "--together") == 0
        stock = asked["kit"]
        assert stock.together and stock.to_dict() == {"angular": [3], "linear": [7]}
        assert stock.kit.to_dict() == {"angular": [0.4], "linear": [[0.1, 0.2]]}
        assert status_of(*arguments, file) == 0 and not asked["kit"].together
        assert status_of(*arguments, file, "--parts", "linear=2") == 2
        assert "give it without --kit and --parts" in capsys.readouterr().err
        assert status_of(*arguments[:-1], "--together", "--parts", "linear=2") == 2
        assert "give it with --stock" in capsys.readouterr().err

    def test_weights_of_terms(self, asked, design_file, tmp_path, capsys):
        arguments = (
            "optimize",
            design_file.parent,
            "--parts",
            "linear=1",
            "--out",
            tmp_path / "out",
            "--weights",
        )
        assert status_of(*arguments, "energy=0.5,stress=2") == 0
        weights = asked["settings"].weights
        assert (weights.fit, weights.energy, weights.others) == (1e5, 0.5, (("stress", 2.0),))
        for text, message in (
            ("beauty=1", "weights = 'beauty': unknown term"),
            ("stress=x", "expected TERM=WEIGHT"),
            ("stress=-1", "weights.stress = -1"),
            ("fit=1,fit=2", "given twice"),
        ):
            capsys.readouterr()
            assert status_of(*arguments, text) == 2
            error = capsys.readouterr().err
            assert message in error and error.count("\n") == 1

    def test_names_that_are_too_long_for_a_file(self, capsys, tmp_path):
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

    def test_a_design_that_fails_in_the_end(self, asked, design_file, tmp_path, capsys):
        asked["failed"] = ["arch"]
        arguments = (
            "optimize",
            design_file.parent,
            "--parts",
            "linear=1",
            "--out",
            tmp_path / "out",
        )
        assert status_of(*arguments) == 1
        assert "can't be built from the kit: arch" in capsys.readouterr().err
        assert status_of(*arguments, "--json") == 1
        data = json.loads(capsys.readouterr().out)
        assert data["designs"] == [{"name": "arch", "failed": "no"}]
        assert data["result"] == (tmp_path / "out" / "result.json").as_posix()

    def test_designs_by_name(self, asked, design_file, tmp_path, capsys):
        arguments = (
            "optimize",
            design_file.parent,
            "--parts",
            "linear=1",
            "--out",
            tmp_path / "out",
            "--designs",
        )
        assert status_of(*arguments, "arch") == 0
        assert status_of(*arguments, "arch,vault") == 2
        assert "designs = 'vault': no such design (there are arch)" in capsys.readouterr().err


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


class TestCheck:
    def test_one_design_and_its_sizes(self, repository, tmp_path, capsys):
        models = repository / "models" / "small"
        arguments = ("check", models, "--designs", "2", "--parts", "linear=3,angular=2")
        out = tmp_path / "out"
        assert status_of(*arguments, "--harmonise", "0.9,1.1", "--out", out) == 0
        text = capsys.readouterr().out
        assert "2 designs, compared by a kit of 2 angular and 3 linear parts" in text
        assert (
            "small exp" in text
            and "opens; deviation max" in text
            and "sizes: small sinh 1," in text
        )
        assert sorted(path.name for path in out.iterdir()) == ["01_sinh.json", "03_exp.json"]

    @pytest.mark.parametrize(
        "more, message",
        [
            (("--harmonise", "0.9,1.1"), "give it with --out"),
            (("--out", "x"), "give it with --out"),
            (("--harmonise", "1.1,1.2", "--out", "x"), "expected two factors"),
            (("--parts", "linear=900"), "more parts than elements"),
            (("--parts", "cell=2"), "no elements of this kind"),
        ],
    )
    def test_what_makes_no_sense(self, more, message, repository, capsys):
        models = repository / "models" / "small"
        assert status_of("check", models, "--designs", "1", *more) == 2
        assert message in capsys.readouterr().err


class TestSizes:
    def test_ranges(self):
        from kop_exudyn.commands.values import kit_cost, part_ranges

        assert part_ranges("linear=2:6:2,angular=5") == {"linear": [2, 4, 6], "angular": [5]}
        assert kit_cost("part=1,piece=0.5") == {"part": 1.0, "piece": 0.5}

    @pytest.mark.parametrize(
        "command, message",
        [
            (("tradeoff", "--parts", "linear=6:2"), "expected A:B or A:B:STEP"),
            (("tradeoff", "--parts", "linear=0:2"), "at least 1"),
            (("tradeoff", "--parts", "linear=2:4,angular=2:3"), "need as many numbers"),
            (("optimize", "--max-deviation", "0"), "positive number"),
            (("optimize", "--max-deviation", "0.5 %", "--kit", "KIT"), "without --kit and --stock"),
            (("optimize", "--max-deviation", "1", "--cost", "colour=1"), "expected part=W"),
            (("optimize", "--parts", "linear=2,angular=2", "--cost", "part=1"), "give it with"),
            (("optimize", "--max-deviation", "1", "--kit", "KIT"), "without --kit and --stock"),
        ],
    )
    def test_what_makes_no_sense(self, command, message, design_file, tmp_path, capsys):
        kit = save_kit(tmp_path / "kit.json", Kit({"linear": [[0.1, 0.2]], "angular": [0.2]}))
        name, *options = (kit if word == "KIT" else word for word in command)
        arguments = (name, design_file.parent, "--out", tmp_path / "out", *options)
        assert status_of(*arguments) == 2
        assert message in capsys.readouterr().err and not (tmp_path / "out").exists()


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
    words = [str(places.get(word, word)) for word in line.split()]
    try:
        status = cli.main(words)
    except SystemExit as end:
        status = end.code
    assert status == 2
    assert re.search(message, capsys.readouterr().err)
    assert not (tmp_path / "out").exists() and [p.name for p in full.iterdir()] == ["notes.txt"]
