"""`kop fit`: designs of all classes brought nearer to their targets, one at a time."""

import json

import numpy as np
import pytest

from kop_exudyn.analysis.refit import refit
from kop_exudyn.analysis.simulation import simulate
from kop_exudyn.cli import main
from kop_exudyn.errors import InputError
from kop_exudyn.io.designs import load_design
from kop_exudyn.structures.base import design_from_dict, rescaled
from kop_exudyn.structures.umbrella.on_mesh import umbrella_on_mesh


def off(path):
    return simulate(load_design(path)).fit.max_percent


def fitted(design, new, capsys, *options):
    """The new file and what was told, as data."""
    assert main(["fit", str(design), "--out", str(new), "--json", "--quiet", *options]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.fixture(scope="module")
def dome(tmp_path_factory):
    """An umbrella mesh on a shallow bowl, as `kop import` lays it out; far from the origin."""
    folder = tmp_path_factory.mktemp("dome")
    x, y = np.meshgrid(np.linspace(-1, 1, 13), np.linspace(-1, 1, 13), indexing="ij")
    points = np.stack([x, y, 0.35 * (1 - x**2 - 0.6 * y**2)], axis=-1).reshape(-1, 3)
    lines = [f"v {a} {b} {c}" for a, b, c in points + [7.0, -3.0, 2.0]]
    lines += [f"f {n} {n + 13} {n + 14} {n + 1}" for n in range(1, 12 * 13) if n % 13]
    (folder / "dome.obj").write_text("\n".join(lines) + "\n")
    data = umbrella_on_mesh("dome", folder / "dome.obj", ("hexagon", [1]), scale=200.0)
    (folder / "dome.json").write_text(json.dumps(data))
    return folder / "dome.json"


def test_an_umbrella_mesh_on_a_surface(dome, tmp_path, capsys):
    told = fitted(dome, tmp_path / "new.json", capsys)
    assert told["changed"] and told["units"] == {"length": "mm", "force": "N"}
    assert told["before"]["max_percent"] == pytest.approx(off(dome))
    # the file has what was told, when it is opened anew
    assert told["after"]["max_percent"] == pytest.approx(off(tmp_path / "new.json"), rel=1e-6)
    assert told["after"]["max_percent"] < 0.2 * told["before"]["max_percent"]
    before, after = (json.loads(path.read_text()) for path in (dome, tmp_path / "new.json"))
    assert before.pop("lengths") != after.pop("lengths") and before == after


def test_pins_keep_their_place_in_the_file(dome):
    data = json.loads(dome.read_text()) | {"pins": {"joints": "corners"}}
    design = design_from_dict(data)
    assert design.middle.any()  # its target is far from the origin
    again = design_from_dict(design.file_with(data, design.parameters))
    np.testing.assert_allclose(again.parameters, design.parameters, atol=1e-9)


@pytest.mark.parametrize("name", ["small/03_exp", "grids/02_saddle"])
def test_drawn_nets(name, repository, tmp_path, capsys):
    """A C-shell and a grid as they are drawn."""
    file = repository / "models" / f"{name}.json"
    data = json.loads(file.read_text())
    data.pop("straightened", None)
    (tmp_path / "drawn.json").write_text(json.dumps(data))
    told = fitted(tmp_path / "drawn.json", tmp_path / "new.json", capsys)
    assert told["after"]["max_percent"] < 0.1 * told["before"]["max_percent"]
    assert told["after"]["max_percent"] == pytest.approx(off(tmp_path / "new.json"), rel=1e-3)
    new = json.loads((tmp_path / "new.json").read_text())
    assert {key: value for key, value in new.items() if key != "straightened"} == data
    # at another size it is the same design
    design = load_design(tmp_path / "new.json")
    larger = design_from_dict(rescaled(new, 3.0), str(file))
    is_length = design.lower > -1e-9
    np.testing.assert_allclose(larger.parameters[is_length], 3 * design.parameters[is_length])


def test_values_that_are_none_of_the_design(repository):
    file = repository / "models" / "small" / "03_exp.json"
    data = json.loads(file.read_text())
    design = design_from_dict(data, str(file))
    values = design.file_with(data, design.parameters)["straightened"]
    assert np.array_equal(
        design_from_dict(data | {"straightened": values}, str(file)).parameters, design.parameters
    )
    values["angles"].pop()
    with pytest.raises(InputError, match=r"straightened.angles.*have \d+ angles"):
        design_from_dict(data | {"straightened": values}, str(file))


def test_what_fits_already_stays_as_it_is(repository, tmp_path, capsys):
    """One step from a fitted design can't better it by much; none is taken that would worsen it."""
    file = repository / "models" / "grids" / "02_saddle.json"
    found = refit(json.loads(file.read_text()), str(file), max_steps=1)
    first, last = (float(np.mean(r.fit.distances**2)) for r in (found.before, found.after))
    assert last < first if found.changed else found.data == json.loads(file.read_text())


def test_files_are_not_replaced_unasked_and_paths_go_along(repository, tmp_path, capsys):
    """A target beside the design is found from the new folder, too."""
    file = repository / "models" / "small" / "03_exp.json"
    new = tmp_path / "new.json"
    new.write_text("mine")
    assert main(["fit", str(file), "--out", str(new)]) == 2
    assert "--overwrite" in capsys.readouterr().err and new.read_text() == "mine"
    file = repository / "models" / "grids" / "06_mesh.json"  # on a mesh in a file
    fitted(file, new, capsys, "--overwrite", "--max-steps", "1")
    named = json.loads(new.read_text())["surface"]["file"]
    assert (tmp_path / named).resolve() == (file.parent / "vault.obj").resolve()


def test_no_design_no_file(tmp_path, capsys):
    (tmp_path / "a.json").write_text('{"format": "kop_exudyn/kit", "version": 1}')
    assert main(["fit", str(tmp_path / "a.json"), "--out", str(tmp_path / "b.json")]) == 2
    assert "a.json" in capsys.readouterr().err
    assert not (tmp_path / "b.json").exists()
