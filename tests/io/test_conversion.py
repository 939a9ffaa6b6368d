"""Designs in other units are the same designs."""

from __future__ import annotations

import json

import numpy as np
import pytest

from kop_exudyn.cli import main
from kop_exudyn.errors import InputError
from kop_exudyn.io.conversion import in_units
from kop_exudyn.units import Units

LOADS = {
    "gravity": [0, 0, -9.81],
    "line": [0, 0, -0.4],
    "plan": [0, 0, -1.5],
    "points": [{"joint": 3, "force": [0.0, 0.1, -0.2]}],
    "deflection": {"absolute": 0.05, "span_over": 200},
}


def model(repository, path, **fields):
    """A model's content, with other fields and a material of all properties."""
    data = json.loads((repository / "models" / path).read_text())
    data["material"] |= {"density": 450.0, "elastic_limit": 4e7}
    return data | fields


def told(capsys, *arguments):
    capsys.readouterr()
    assert main([*map(str, arguments), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("path", ["small/01_sinh.json", "grids/06_mesh.json"])
def test_the_same_state_in_other_units(path, repository, tmp_path, capsys):
    """A kN mm is a J: energies are the same numbers; lengths are a thousand times theirs."""
    old = repository / "models" / path
    new = tmp_path / "in" / "mm.json"
    new.parent.mkdir()
    told(capsys, "import", old, "--unit", "mm", "--force-unit", "kN", "--out", new)
    a, b = (told(capsys, "simulate", file) for file in (old, new))
    assert b["units"] == {"length": "mm", "force": "kN"} and b["stable"]
    assert b["elastic_energy"] == pytest.approx(a["elastic_energy"], rel=1e-7)
    assert b["fit"]["max_percent"] == pytest.approx(a["fit"]["max_percent"], rel=1e-4)
    assert b["fit"]["max"] == pytest.approx(1e3 * a["fit"]["max"], rel=1e-4)
    stress = [x["strength"]["deployed"]["equivalent_stress"] for x in (a, b)]
    assert stress[1] == pytest.approx(1e-9 * stress[0], rel=1e-4)  # GPa and Pa


def test_every_number_is_converted(repository):
    """By hand, and back again."""
    section = {"type": "rectangle", "width": 0.03, "height": 0.004, "joint_hole": 0.002}
    data = model(
        repository,
        "small/01_sinh.json",
        section=section,
        rod_offset=0.004,
        loads=LOADS,
        load_cases=[{"name": "snow", **LOADS}],
        combinations=[{"name": "both", "factors": {"snow": 1.5}, "deflection": {"absolute": 0.1}}],
    )
    new = in_units(data, Units("mm", "kN"))
    assert new["section"] == pytest.approx({**section, "width": 30, "height": 4, "joint_hole": 2})
    assert new["rod_offset"] == pytest.approx(4.0)
    assert new["material"]["young"] == pytest.approx(1e-9 * data["material"]["young"])
    assert new["material"]["density"] == pytest.approx(450e-15)  # of 1e6 kg, per mm³
    assert new["material"]["poisson"] == data["material"]["poisson"]
    for loads in (new["loads"], new["load_cases"][0]):
        assert loads["gravity"] == pytest.approx([0, 0, -9810])
        assert loads["line"] == pytest.approx([0, 0, -0.4e-6])
        assert loads["plan"] == pytest.approx([0, 0, -1.5e-9])
        assert loads["points"][0]["joint"] == 3
        assert loads["points"][0]["force"] == pytest.approx([0, 1e-4, -2e-4])
        assert loads["deflection"] == pytest.approx({"absolute": 50, "span_over": 200})
    assert new["combinations"][0]["deflection"]["absolute"] == pytest.approx(100)
    assert new["combinations"][0]["factors"] == {"snow": 1.5}
    back = in_units(new, Units("m"))
    assert back["units"] == data["units"]
    for was, now in zip(data["curves"], back["curves"]):
        assert np.allclose(was["points"], now["points"], rtol=1e-12, atol=0)
    for name in ("section", "material"):
        assert back[name] == pytest.approx(data[name])


def test_units_agree_after_the_command_that_the_error_names(repository, tmp_path, capsys):
    old = repository / "models" / "small" / "01_sinh.json"
    folder = tmp_path / "designs"
    folder.mkdir()
    (folder / "a.json").write_text(old.read_text())
    told(capsys, "import", old, "--unit", "mm", "--out", folder / "b.json")
    data = json.loads((folder / "b.json").read_text())
    (folder / "b.json").write_text(json.dumps(data | {"name": "other"}))
    assert (
        main(["optimize", str(folder), "--out", str(tmp_path / "run"), "--parts", "linear=4"]) == 2
    )
    said = capsys.readouterr().err
    assert "kop import FILE --unit m --force-unit N --out NEW" in said
    command = ("--unit", "m", "--force-unit", "N", "--out", folder / "b.json", "--overwrite")
    told(capsys, "import", folder / "b.json", *command)
    assert json.loads((folder / "b.json").read_text())["units"] == {"length": "m", "force": "N"}


def test_an_umbrella_mesh_in_metres(repository, tmp_path, capsys):
    """Arms, plates, materials, target and pins: the same state; and back."""
    old = tmp_path / "mm.json"
    data = json.loads((repository / "models" / "umbrellas" / "dome.json").read_text())
    data |= {"pins": {"joints": "corners"}, "least_length": 31.0}
    old.write_text(json.dumps(data))
    new = tmp_path / "m.json"
    told(capsys, "import", old, "--unit", "m", "--out", new)
    a, b = (told(capsys, "simulate", file) for file in (old, new))
    assert b["units"] == {"length": "m", "force": "N"} and b["stable"]
    assert b["elastic_energy"] == pytest.approx(1e-3 * a["elastic_energy"], rel=1e-6)
    assert b["fit"]["max"] == pytest.approx(1e-3 * a["fit"]["max"], rel=1e-4)
    stress = [x["strength"]["deployed"]["equivalent_stress"] for x in (a, b)]
    assert stress[1] == pytest.approx(1e6 * stress[0], rel=1e-5)
    np.testing.assert_allclose(b["joints"], 1e-3 * np.array(a["joints"]), atol=1e-8)
    back = in_units(json.loads(new.read_text()), Units("mm"))
    assert back["materials"]["arms"] == pytest.approx(data["materials"]["arms"])
    assert back["plates"] == pytest.approx(data["plates"])
    assert back["least_length"] == pytest.approx(31.0)
    np.testing.assert_allclose(back["target"]["crossings"], data["target"]["crossings"])


def test_places_that_are_not_known_stay_so():
    data = {"class": "umbrella", "units": {"length": "mm"}, "target": {"plates": [None, [1, 2, 3]]}}
    assert in_units(data, Units("m"))["target"]["plates"] == [None, [1e-3, 2e-3, 3e-3]]


@pytest.mark.parametrize(
    ("option", "value"),
    [("--density", "3"), ("--curves", "polyline"), ("--plates", "rigid"), ("--tolerance", "0.1")],
)
def test_a_design_in_other_units_takes_no_other_options(option, value, repository, capsys):
    """They were passed over without a word."""
    dome = repository / "models" / "umbrellas" / "dome.json"
    assert main(["import", str(dome), "--unit", "m", option, value]) == 2
    assert f"{option}: isn't for this import" in capsys.readouterr().err


def test_what_cannot_be_converted_is_told(repository):
    data = model(repository, "small/01_sinh.json")
    del data["units"]
    with pytest.raises(InputError, match="names no units"):
        in_units(data, Units("mm"))
    grid = model(repository, "grids/06_mesh.json", origin=[1e6, 0.0, 0.0])
    with pytest.raises(InputError, match="drawn far away"):
        in_units(grid, Units("mm"))
