"""Whole folders of files, from a run's result."""

import csv

import numpy as np
import pytest
from support.read_me import assert_explained

import kop_exudyn as kop
from kop_exudyn.drawing.colours import part_colours, to_linear, to_srgb, value_colours
from kop_exudyn.errors import SimulationFailure
from kop_exudyn.exchange.export import export_desk, export_simulation
from kop_exudyn.exchange.result_tables import result_tables
from kop_exudyn.files.files import file_stem
from kop_exudyn.files.tables import csv_text
from kop_exudyn.search.result import KitResult
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings, StageSettings


@pytest.fixture(scope="module")
def result(shells):
    """Two accepted steps a stage: the files don't need more."""
    settings = JobSettings(
        jobs=1,
        baselines=False,
        stages=StageSettings(
            schedule=(1e4,),
            relaxed_steps=2,
            assigned_steps=2,
            reassignments=0,
            path_steps=3,
            effort="quick",
        ),
    )
    events = []
    return optimize_kit(
        shells, {"linear": 3, "angular": 2}, settings=settings, observer=events.append
    )


def test_tables(result):
    tables = {
        name: list(csv.DictReader(csv_text(rows).splitlines()))
        for name, rows in result_tables(result).items()
    }
    final = result.stages["assigned"]
    row = next(r for r in tables["designs"] if r["stage"] == "assigned" and r["design"] == "second")
    assert float(row["max_percent"]) == final.designs[1].fit.max_percent
    assert float(row["deployed_utilisation"]) > float(row["rest_utilisation"]) >= 0
    assert row["deployed_stable"] == "true"
    assert {r["stage"] for r in tables["designs"]} == {
        "input",
        "direct",
        "relaxed",
        "assigned",
        "redeployed",
    }
    steps = [r for r in tables["steps"] if r["stage"] == "relaxed"]
    assert len(steps) == result.stages["relaxed"].steps
    assert float(steps[-1]["value"]) == pytest.approx(
        sum(float(v) for name, v in steps[-1].items() if name.startswith("term_") and v)
    )
    elements = [r for r in tables["elements"] if r["design"] == "first"]
    assert len(elements) == result.designs[0].n_elements
    for r, piece in zip(elements, result.designs[0].groups[0].indices):
        assert float(r["assigned_1"]) == final.designs[0].q[piece[0]]
        assert float(r["input_1"]) == result.designs[0].parameters[piece[0]]
    distances = [
        float(r["distance_percent"])
        for r in tables["joints"]
        if r["stage"] == "assigned" and r["design"] == "first"
    ]
    assert max(distances) == pytest.approx(final.designs[0].fit.max_percent)
    rods = [r for r in tables["rods"] if r["design"] == "first" and r["state"] == "deployed"]
    np.testing.assert_array_equal(
        [float(r["Mz"]) for r in rods], final.designs[0].equilibria["deployed"].stress[:, 5]
    )
    labels = {r["element"]: r["part"] for r in tables["elements"] if r["design"] == "first"}
    assert all(r["part"] == labels[r["element"]] for r in rods)
    fit = result.summary("assigned", 0)["fit"]
    assert max(float(r["deviation"]) for r in rods) == pytest.approx(fit["pieces_max"])


def test_designs_that_failed_are_in_the_tables_and_in_no_file(result, tmp_path):
    from dataclasses import replace

    stage = result.stages["assigned"]
    broken = replace(stage, designs=[SimulationFailure("buckled"), stage.designs[1]])
    partly = KitResult(result.designs, result.references, {**result.stages, "assigned": broken})
    rows = result_tables(partly)["designs"]
    assert [r["failed"] for r in rows if "failed" in r] == ["buckled"]
    assert not [
        p for p in export_desk(partly, tmp_path, formats=["obj"]) if p.name.startswith("first")
    ]


def test_csv_cells():
    text = csv_text(
        [
            {"a": 1.5, "b": np.float64("nan")},
            {"b": True, "c": "=1+1", "a": None},
            {"c": 'two, "three"'},
        ]
    )
    assert text == 'a,b,c\n1.5,,\n,true,\'=1+1\n,,"two, ""three"""\n'


def test_file_names():
    assert file_stem("a b/../c") == "a_b_.._c" and file_stem("//") == "design"


def test_colours():
    shades = part_colours(12)
    gaps = np.linalg.norm(shades[:, None] - shades[None], axis=2) + np.eye(12)
    assert gaps.min() > 0.1 and shades.min() >= 0 and shades.max() <= 1
    np.testing.assert_allclose(
        to_linear(to_srgb(np.linspace(0, 1, 11))), np.linspace(0, 1, 11), atol=1e-6
    )
    brightness = value_colours(np.linspace(0, 1, 20)) @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(brightness) < 0).all()
    np.testing.assert_array_equal(value_colours(np.array([np.nan])), [[0.6, 0.6, 0.6]])


def test_every_file_and_column_is_explained_beside_them(result, repository, tmp_path):
    export_desk(result, tmp_path / "kit")
    assert_explained(tmp_path / "kit")
    design = kop.load_design(repository / "models" / "grids" / "01_dome.json")
    export_simulation(kop.simulate(design), tmp_path / "design", formats=["obj", "csv"])
    assert_explained(tmp_path / "design")
    text = (tmp_path / "design" / "READ_ME.txt").read_text(encoding="utf-8")
    assert "Lengths are in m, forces in N" in text and "_rods.csv" in text
