"""`kop optimize`: what its options ask for, and how it ends."""

import json
from types import SimpleNamespace

import pytest
from support.commands import status_of

from kop_exudyn.io.kits import load_kit, save_kit
from kop_exudyn.kit.parts import Kit
from kop_exudyn.report import kit_run


@pytest.fixture
def asked(monkeypatch):
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


def test_options_arrive(asked, design_file, tmp_path, capsys):
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


def test_several_requirements_are_left_out(asked, design_file, tmp_path):
    """Only the last one was."""
    parts = ("--parts", "linear=2,angular=2", "--out", tmp_path / "out")
    both = ("--without", "opening", "--without", "stress")
    assert status_of("optimize", design_file.parent, *parts, *both, "-q") == 0
    required = asked["settings"].stages.requirements
    assert (required.opening, required.stress, required.loads) == (False, False, True)


def test_a_study_file_and_options_that_come_before_it(asked, design_file, tmp_path, capsys):
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


def test_parts_must_come_from_somewhere(asked, design_file, tmp_path, capsys):
    assert status_of("optimize", design_file.parent, "--out", tmp_path / "out") == 2
    assert (
        "--parts, --kit or --stock is required" in capsys.readouterr().err and "parts" not in asked
    )


def test_a_kit_that_exists(asked, design_file, tmp_path, capsys):
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


def test_a_stock(asked, design_file, tmp_path, capsys):
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


def test_weights_of_terms(asked, design_file, tmp_path, capsys):
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


def test_a_design_that_fails_in_the_end(asked, design_file, tmp_path, capsys):
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


def test_designs_by_name(asked, design_file, tmp_path, capsys):
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


def test_several_files_are_to_be_a_folder(tmp_path, capsys):
    files = [tmp_path / name for name in ("a.json", "b.json")]
    for file in files:
        file.write_text("{}")
    out = tmp_path / "out"
    assert status_of("optimize", *files, "--parts", "linear=3", "--out", out) == 2
    assert "are one folder, or some of a folder by --designs" in capsys.readouterr().err


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
def test_parts_that_make_no_sense(parts, message, capsys, tmp_path):
    assert status_of("optimize", tmp_path, "--parts", parts, "--out", tmp_path / "out") == 2
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1


def test_unknown_kind_of_parts(capsys, design_file, tmp_path):
    assert (
        status_of("optimize", design_file.parent, "--parts", "cubic=3", "--out", tmp_path / "out")
        == 2
    )
    error = capsys.readouterr().err
    assert "'cubic': unknown kind of parts (known: angular," in error and error.count("\n") == 1
    assert not (tmp_path / "out").exists()
