"""Units: what numbers mean, how they are shown, and files that don't go together."""

import json
import logging
import re

import numpy as np
import pytest

from kop_exudyn.cli import main
from kop_exudyn.errors import InputError
from kop_exudyn.io.designs import load_all
from kop_exudyn.io.kits import load_kit, save_kit
from kop_exudyn.kit.parts import Kit
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.units import FORCES, LENGTHS, Units, common_units, plain_number, unit_of, with_unit

NEWTON_METRES = Units("m", "N")


@pytest.mark.parametrize("length", LENGTHS)
@pytest.mark.parametrize("force", FORCES)
def test_gravity_and_densities_are_the_same_in_all_units(length, force):
    """Steel of 7850 kg/m^3: a cube of one metre weighs 76.98 kN, whatever it is measured in."""
    units = Units(length, force)
    density = 7850 / units.density_si(1.0)
    side = 1.0 / units.metres
    assert density * side**3 * units.gravity * units.newtons == pytest.approx(7850 * 9.80665)
    modulus = 2.1e11 / units.stress_si(1.0)
    assert modulus * side**2 * units.newtons == pytest.approx(2.1e11)


@pytest.mark.parametrize(
    "units, names",
    [
        (NEWTON_METRES, ("m", "N", "Pa", "J", "kg/m³", "m/s²")),
        (Units("mm", "N"), ("mm", "N", "MPa", "mJ", "t/mm³", "mm/s²")),
        (Units("mm", "kN"), ("mm", "kN", "kN/mm²", "J", "kt/mm³", "mm/s²")),
        (Units("ft", "lbf"), ("ft", "lbf", "lbf/ft²", "lbf ft", "(lbf s²/ft)/ft³", "ft/s²")),
    ],
)
def test_names(units, names):
    quantities = ("length", "force", "stress", "energy", "density", "acceleration")
    assert tuple(unit_of(quantity, units) for quantity in quantities) == names
    assert unit_of("angle", units) == unit_of("angle", None) == "rad"


def test_named_units_are_what_they_say():
    """A joule is a newton metre, a pascal a newton on a square metre."""
    assert Units("mm", "kN").newtons * Units("mm", "kN").metres == pytest.approx(1.0)  # J
    assert Units("mm", "N").stress_si(1.0) == pytest.approx(1e6)  # MPa
    assert Units("mm", "N").kilograms == pytest.approx(1000.0)  # t


def test_numbers_without_units_say_so():
    assert with_unit(0.123456, "length", None) == "0.1235 units of length"
    assert with_unit(1.5e10, "stress", NEWTON_METRES) == "1.5e+10 Pa"


@pytest.mark.parametrize(
    "value, digits, text",
    [
        (2500.0, 3, "2500"),
        (13346.9, 4, "13350"),
        (2499.96, 4, "2500"),
        (-56789.0, 3, "-56800"),
        (9999999.0, 4, "1e+07"),
        (2.345e8, 4, "2.345e+08"),
        (12.345, 4, "12.35"),
        (0.000012, 4, "1.2e-05"),
        (0.0, 4, "0"),
    ],
)
def test_lengths_in_millimetres_are_written_out(value, digits, text):
    """Nobody reads a span of "2.5e+03 mm" off a drawing."""
    assert plain_number(value, digits) == text


def test_unknown_units():
    with pytest.raises(InputError, match="units.length = 'parsec': unknown unit"):
        Units("parsec")
    with pytest.raises(InputError, match="units.force = 'dyn': unknown unit"):
        Units("m", "dyn")


def test_common_units():
    assert common_units({"a": None, "b": None}) is None
    assert common_units({"a": None, "b": NEWTON_METRES, "c": Units("m")}) == NEWTON_METRES
    with pytest.raises(InputError, match="b in m, N, c in mm, N"):
        common_units({"a": None, "b": NEWTON_METRES, "c": Units("mm")})


def test_designs_of_different_units_make_no_kit(c_shell_data, write_json_file):
    files = [
        write_json_file(
            f"{unit}.json", c_shell_data | {"name": unit, "units": {"length": unit, "force": "N"}}
        )
        for unit in ("m", "mm")
    ]
    with pytest.raises(InputError, match="need the same units: m in m, N, mm in mm, N .*--unit"):
        load_all(files, "folder")
    assert [design.units for design in load_all(files[:1], "folder")] == [NEWTON_METRES]


def test_what_names_no_units_beside_what_does_is_said(
    c_shell_data, write_json_file, monkeypatch, caplog
):
    caplog.set_level(logging.WARNING, "kop_exudyn")
    metres = {"units": {"length": "m", "force": "N"}}
    files = [
        write_json_file("a.json", c_shell_data | {"name": "a"} | metres),
        write_json_file("b.json", c_shell_data | {"name": "b"}),
    ]
    load_all(files[:1], "folder")
    load_all(files[1:], "folder")
    assert not caplog.records
    both = load_all(files, "folder")
    assert caplog.messages == ["folder: b names no units: taken for m, N, as the rest is in"]

    class Reached(Exception):
        """The search has begun."""

    def begin(*arguments):
        raise Reached

    monkeypatch.setattr("kop_exudyn.search.run.DesignPool", begin)
    parts = {"linear": np.array([[1.0, 1.0]]), "angular": np.array([0.1])}
    for units, designs, said in (
        (None, both[:1], ["the kit names no units: taken for m, N, as the rest is in"]),
        (Units("mm"), both[1:], ["the designs name no units: taken for mm, N, as the rest is in"]),
        (Units("m"), both[:1], []),
        (None, both[1:], []),
    ):
        caplog.clear()
        with pytest.raises(Reached):
            optimize_kit(designs, kit=Kit(parts, units))
        assert caplog.messages == said
    with pytest.raises(InputError, match="the kit in mm, N, the designs in m, N"):
        optimize_kit(both[:1], kit=Kit(parts, Units("mm")))


def test_a_design_file_with_unknown_units(c_shell_data, write_json_file, capsys):
    path = write_json_file("a.json", c_shell_data | {"units": {"length": "parsec"}})
    assert main(["simulate", str(path)]) == 2
    assert "units.length = 'parsec': must be one of" in capsys.readouterr().err


def test_kits_keep_their_units(tmp_path):
    kit = Kit({"angular": np.array([0.1, 0.2])}, Units("mm"))
    assert load_kit(save_kit(tmp_path / "kit.json", kit)).units == Units("mm")
    plain = save_kit(tmp_path / "plain.json", Kit({"angular": np.array([0.1])}))
    assert load_kit(plain).units is None


def test_gravity_follows_the_units(repository, tmp_path, write_json_file, capsys):
    """The same net in metres and in millimetres carries the same weight and moves by the same
    share; without units the amount has to be given."""
    data = json.loads((repository / "models" / "small" / "01_sinh.json").read_text())
    in_mm = json.loads(json.dumps(data))
    in_mm["units"] = {"length": "mm", "force": "N"}
    for curve in in_mm["curves"]:
        curve["points"] = (1000 * np.array(curve["points"])).tolist()
    for name in ("width", "height"):
        in_mm["section"][name] *= 1000
    in_mm["material"] |= {"young": 2.1e3, "density": 900e-12, "elastic_limit": 40.0}
    found = []
    for name, content in (("m", data), ("mm", in_mm)):
        path = write_json_file(f"{name}.json", content)
        assert main(["simulate", str(path), "--gravity", "--json"]) == 0
        found.append(json.loads(capsys.readouterr().out))
    force = [result["loaded"]["total_force"][2] for result in found]
    assert force[1] == pytest.approx(force[0], rel=1e-9) and force[0] < -1.0
    moved = [result["loaded"]["deflection"]["max_percent"] for result in found]
    assert moved[1] == pytest.approx(moved[0], rel=1e-5)
    assert found[1]["units"] == {"length": "mm", "force": "N"}
    del data["units"]
    assert main(["simulate", str(write_json_file("none.json", data)), "--gravity"]) == 2
    assert "names no units: say how much" in capsys.readouterr().err


def test_the_summary_shows_units(repository, capsys):
    path = repository / "models" / "small" / "01_sinh.json"
    assert main(["simulate", str(path), "--gravity"]) == 0
    text = capsys.readouterr().out
    rows = dict(re.split(r"  +", line, maxsplit=1) for line in text.splitlines() if "  " in line)
    assert rows["elastic energy"].endswith(" J") and " m (" in rows["deflection"]
    assert " N in all" in rows["load"] and " Pa, " in text and "°" in rows["opening angle"]
