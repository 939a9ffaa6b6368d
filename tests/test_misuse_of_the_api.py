"""What scripts hand to the public functions by mistake: one InputError that names the argument."""

from __future__ import annotations

import json

import numpy as np
import pytest

import kop_exudyn as kop
from kop_exudyn.search.tolerance import Tolerance, sample_spread
from kop_exudyn.sqp.constraints import on_elements


@pytest.fixture(scope="module")
def design(repository):
    return kop.load_design(repository / "models" / "small" / "01_sinh.json")


@pytest.fixture(scope="module")
def simulated(design):
    return kop.simulate(design)


def named(field):
    return pytest.raises(kop.InputError, match=rf"^{field}")


@pytest.mark.parametrize("wrong", [None, 3, 2.5, ["a.json"], {}, np.zeros(3)])
@pytest.mark.parametrize("read", [kop.load_design, kop.load_designs, kop.load_kit, kop.load_result])
def test_paths(read, wrong):
    with named("path"):
        read(wrong)


@pytest.mark.parametrize("wrong", [True, 2.5, "01_sinh", {"01_sinh"}])
def test_selections(repository, wrong):
    """True was one design."""
    with named(".*designs"):
        kop.load_designs(repository / "models" / "small", wrong)


@pytest.mark.parametrize("wrong", [None, "models/small/01_sinh.json", 3, [1.0], np.zeros(3)])
def test_designs_and_results(wrong, tmp_path):
    for take in (kop.simulate, kop.fit_input):
        with named("design"):
            take(wrong)
    for take in (kop.plot, kop.to_pandas, kop.to_compas, kop.to_meshio, kop.parts_list_of):
        with named("result"):
            take(wrong)
    for write in (kop.export_desk, kop.export_simulation, kop.write_kit_report):
        with named("result"):
            write(wrong, tmp_path / "out")
    with named("parts"):
        kop.export_workshop(wrong, tmp_path / "out", "mm")
    with named("kit"):
        kop.save_kit(tmp_path / "kit.json", wrong)
    assert not any(tmp_path.iterdir())


def test_arguments_of_simulations(design, simulated, tmp_path):
    with named("loads"):
        kop.simulate(design, {"gravity": [0, 0, -9.81]})
    with named("engine"):
        kop.simulate(design, engine="exudin")
    with named("weights"):
        kop.fit_input(design, {"fit": 1.0})
    with named("fit_input.lower"):
        kop.fit_input(design, lower=[1.0, 2.0])
    with named("fit_input.lower"):
        kop.fit_input(design, lower=2.0, upper=1.0)
    with named("role"):
        design.scene("deployd")
    with named("state"):
        kop.to_meshio(simulated, "deployd")
    for formats in ("obj", ["obi"], 3):
        with named("formats"):
            kop.export_simulation(simulated, tmp_path, formats=formats)


@pytest.mark.parametrize("file", ["small/01_sinh.json", "grids/01_dome.json"])
def test_parameters(repository, file):
    """One too many was no matter."""
    design = kop.load_design(repository / "models" / file)
    q = design.parameters
    for wrong in (q[:-1], np.append(q, 1.0), q[:, None], 3.0, "q", np.where(q == q[3], np.nan, q)):
        with named("q"):
            design.deploy(wrong)


def test_clustering(design):
    q, parts = design.parameters, {"linear": 3, "angular": 2}
    for field, change in (
        ("groups", {"groups": "x"}),
        ("groups", {"groups": [1, 2]}),
        ("q", {"q": q[:5]}),
        ("q", {"q": 3.0}),
        ("parts", {"parts": [3, 2]}),
        ("restarts", {"restarts": -1}),
        ("restarts", {"restarts": 2.5}),
        ("seed", {"seed": None}),
    ):
        with named(field):
            kop.cluster(**{"groups": design.groups, "q": q, "parts": parts} | change)
    with named("indices"):
        kop.ElementGroup("linear", [0.5, 1.5])
    assert kop.ElementGroup("linear", [[0, 1]]).indices.shape == (1, 2)


def test_constraints_and_spreads(design, simulated):
    for designs, statement, field in (
        ([design], lambda q: [q["sinh"][0] == 1.0], "statement"),
        ([design], lambda q: q[design.name][0] == 1.0, "statement"),
        (["x"], lambda q: [], "designs"),
    ):
        with named(field):
            on_elements(designs, statement)
    with named("evaluation"):
        sample_spread(design, simulated, Tolerance(1e-3, 1e-3), 2)


def test_sizes_for_the_workshop():
    assert kop.CutOptions(sheet=[800, 500], stock=[3000.0]).stock == (3000.0,)
    for wrong in (
        {"sheet": 800.0},
        {"sheet": (800.0, 500.0, 3.0)},
        {"sheet": ("a", "b")},
        {"stock": 3000.0},
        {"stock": (-1.0,)},
        {"corners": "yes"},
    ):
        with named(f"options.{next(iter(wrong))}"):
            kop.CutOptions(**wrong)


def test_lists_are_as_good_as_tuples():
    assert kop.StageSettings(schedule=[1.0, 10.0]) == kop.StageSettings(schedule=(1.0, 10.0))
    assert kop.JobSettings(design_weights=np.ones(2)).design_weights == (1.0, 1.0)
    for wrong in ("1", 3, {"a": 1}, [None]):
        with named("schedule"):
            kop.StageSettings(schedule=wrong)
        with named("design_weights"):
            kop.JobSettings(design_weights=wrong)


def test_what_holds_arrays_is_equal_by_value(design):
    """Comparing them raised numpy's error, and so did hashing."""
    loads = [kop.LoadCase(gravity=(0, 0, z), joints=[0], forces=[[1, 0, 0]]) for z in (-9, -9, -8)]
    kits = [kop.Kit({"linear": [[1.0, x]], "angular": [0.5]}) for x in (2.0, 2.0, 3.0)]
    groups = [design.groups[0], design.groups[0].shifted(0), design.groups[0].shifted(1)]
    for same, twin, other in (loads, kits, groups):
        assert same == twin and hash(same) == hash(twin) and same != other and same != "x"
        assert len({same, twin, other}) == 2


def test_contents_of_scripts_are_checked_as_files_are(repository):
    data = json.loads((repository / "models/small/01_sinh.json").read_text())
    curves = [c | {"points": np.array(c["points"])} for c in data["curves"]]
    whole = kop.design_from_dict(data)
    twin = kop.design_from_dict(
        {k: v for k, v in data.items() if k not in ("format",)} | {"curves": tuple(curves)}
    )
    np.testing.assert_array_equal(twin.parameters, whole.parameters)
    for field, wrong in (
        ("sectoin", data | {"sectoin": 1}),
        ("opening", {k: v for k, v in data.items() if k != "opening"}),
        ("curves", data | {"curves": "x"}),
        ("class", {k: v for k, v in data.items() if k != "class"}),
        ("expected a design file", None),
    ):
        with pytest.raises(kop.InputError, match=field):
            kop.design_from_dict(wrong)
