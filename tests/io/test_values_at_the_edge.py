"""Values that no structure has: refused in one line that names file and field, or harmless."""

from __future__ import annotations

import json

import numpy as np
import pytest
from matplotlib.figure import Figure

import kop_exudyn as kop
from kop_exudyn.cli import main
from kop_exudyn.drawing.style import figure_bytes
from kop_exudyn.errors import InputError
from kop_exudyn.files.files import make_folder, read_bytes, write_bytes, write_text
from kop_exudyn.files.json_files import parse_json
from kop_exudyn.structures.loading import supports_of
from kop_exudyn.structures.loads import LoadCase


@pytest.fixture(scope="module")
def small(repository):
    return json.loads((repository / "models" / "small" / "01_sinh.json").read_text())


def load(tmp_path, data):
    path = tmp_path / "design.json"
    path.write_text(json.dumps(data))
    return kop.load_design(path)


BAD = {
    "section": ({"type": "rectangle", "width": 1e-100, "height": 1e-100}, "(width|height)"),
    "material": ({"young": 1e-300, "poisson": 0.35}, "young"),
    "loads": ({"points": [{"joint": 10**30, "force": [0, 0, 1.0]}]}, "loads.points.*joint"),
    "supports": ([0, 1, 10**30], "supports"),
    "elements_per_piece": (10**25, "elements_per_piece"),
    "name": ("half \ud800 a pair", "ud800"),
}


@pytest.mark.parametrize("field", BAD)
def test_numbers_and_texts_beyond_sense_are_refused_by_name(tmp_path, small, field):
    value, place = BAD[field]
    with pytest.raises(InputError, match=f"design.json.*{place}") as refused:
        load(tmp_path, small | {field: value})
    assert "\n" not in str(refused.value)


def test_pairs_of_surrogates_are_characters():
    assert parse_json('"\\ud83d\\ude00"') == "\U0001f600"
    with pytest.raises(InputError, match="surrogates"):
        parse_json('{"a": ["\\ude00"]}')
    assert parse_json('"\\\\ud800"') == "\\ud800"  # a backslash, not an escape


def test_a_gravity_whose_square_is_zero_still_has_a_direction(tmp_path, small):
    design = load(tmp_path, small)
    unloaded = design.deploy()["deployed"]
    found = [
        supports_of(design, unloaded, LoadCase(gravity=[0.0, 0.0, -g])) for g in (9.81, 1e-320)
    ]
    assert np.array_equal(*found)


@pytest.mark.parametrize("joints", [[10**30], ["a"], [[0], [1, 2]]])
def test_load_cases_of_python_programs(joints):
    with pytest.raises(InputError, match="loads.joints"):
        LoadCase(joints=joints, forces=[[0, 0, 1.0]])


@pytest.mark.parametrize("rods", [2, 3])
def test_rods_that_enclose_nothing(tmp_path, small, rods):
    """One joint, or two, with free ends: no span lies between joints, or no face."""
    lines = [[[0.0, 0.0], [1.0, 0.0]], [[0.3, -0.5], [0.3, 0.5]], [[0.7, -0.5], [0.7, 0.5]]]
    curves = [{"type": "polyline", "points": points} for points in lines[:rods]]
    with pytest.raises(InputError, match=r"design.json: curves"):
        load(tmp_path, small | {"curves": curves, "free_ends": True})


@pytest.mark.parametrize(
    "name", ["cost $5 and $6", "a$b", "$x_{$", "$\\frac$", "$w_c$ and $y_{$", "100 $"]
)
def test_dollars_are_drawn_as_they_are(name):
    """matplotlib reads what stands between two of them as TeX, and fails where it is none."""
    figure = Figure()
    ax = figure.add_subplot(title=name)
    ax.text(0, 0, name)
    ax.set_yscale("log")
    figure_bytes(figure, "svg")
    assert not ax.title.get_parse_math()
    assert Figure().text(0, 0, "$w_c$ = $10^{3}$").get_parse_math()
    formula = Figure()
    text = formula.text(0, 0, "$w_c$ = $10^{-3}$")
    figure_bytes(formula, "svg")
    assert text.get_parse_math()


def test_names_of_files_with_nul(tmp_path):
    path = f"{tmp_path}/a\0b"
    for use in (read_bytes, make_folder, lambda p: write_bytes(p, b""), kop.load_design):
        with pytest.raises(InputError, match="NUL"):
            use(path)
    with pytest.raises(InputError, match="no character"):
        write_text(tmp_path / "x", "a\udcffb")
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize("option", [("--out", "a\0b.html")])
def test_commands_with_nul(repository, capsys, option):
    model = str(repository / "models" / "small" / "01_sinh.json")
    assert main(["view", model, *option]) == 2
    assert "NUL" in capsys.readouterr().err


@pytest.mark.parametrize("value", ["1e-100,0.01", "1e100,0.01", "nan,1", "0.02,inf"])
def test_sizes_on_the_command_line(capsys, value):
    with pytest.raises(SystemExit) as ended:
        main(["import", "x.obj", "--out", "y.json", "--section", value])
    assert ended.value.code == 2 and "--section" in capsys.readouterr().err
