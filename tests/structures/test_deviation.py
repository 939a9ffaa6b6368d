"""Deviation of what is built: a vault whose corners stand off it by a known height."""

import numpy as np
import pytest
from support.settings import ONE_STEP

import kop_exudyn as kop
from kop_exudyn.analysis.simulation import simulate
from kop_exudyn.exchange.result_tables import result_tables
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.deviation import deviation
from kop_exudyn.structures.fitting import TargetFitting

R = 5.0


def barrel():
    """Lamellas on a cylinder of 5 m: with joints every 1.2 m its corners stand off the surface."""
    return design_from_dict(
        {
            "class": "grid",
            "name": "barrel",
            "units": {"length": "m"},
            "held": "corners",
            "material": {"young": 1.1e10, "poisson": 0.3},
            "section": {"type": "rectangle", "width": 0.01, "height": 0.06},
            "surface": {"type": "analytic", "name": "cylinder", "radius": R},
            "network": {"type": "isolines", "u": [0.0, 1.2, 2.4], "v": [0.0, 1.2, 2.4]},
        }
    )


def test_corners_stand_off_where_tangents_meet():
    """A corner over an arc of the angle a stands R (1 / cos(a / 2) - 1) off the cylinder."""
    design = barrel()
    state = design.scene().initial
    target = design.target
    fit = TargetFitting(target)(state.positions[design.joints])
    found = deviation(design, target, fit, state)
    assert found.joints.max() < 2e-3
    height = R * (1 / np.cos(0.12) - 1)
    assert found.pieces.max() == pytest.approx(height, rel=0.05)
    figures = found.to_dict()
    assert figures["pieces_max_percent"] == 100 * found.pieces.max() / fit.size
    assert figures["max"] == fit.distances.max()


def test_the_simulation_says_both(capsys, tmp_path):
    result = simulate(barrel()).to_dict()["fit"]
    assert result["pieces_max"] > 10 * result["max"]
    assert result["pieces_max_percent"] > 10 * result["max_percent"]


def test_distances_are_taken_where_the_joints_fit_best():
    """The same state, moved and turned as a whole, has the same deviation."""
    design = barrel()
    state = design.scene().initial
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    moved = state.transformed(turn, np.array([30.0, -20.0, 5.0]))
    found = []
    for each in (state, moved):
        fit = TargetFitting(design.target)(each.positions[design.joints])
        found.append(deviation(design, design.target, fit, each).pieces)
    np.testing.assert_allclose(found[0], found[1], atol=1e-7)


def test_umbrella_meshes_are_judged_by_their_joints(repository):
    design = kop.load_design(repository / "models" / "umbrellas" / "hill.json")
    assert design.beside_target
    state = design.scene().initial
    fit = TargetFitting(design.target)(state.positions[design.joints])
    found = deviation(design, design.target, fit, state)
    np.testing.assert_array_equal(found.joints, found.pieces)


def test_result_and_tables_have_the_same_numbers(shells):
    settings = JobSettings(jobs=1, baselines=False, stages=ONE_STEP)
    result = optimize_kit(shells, {"linear": 3, "angular": 2}, settings=settings)
    rows = result_tables(result)["designs"]
    for n, design in enumerate(shells):
        row = next(r for r in rows if r["design"] == design.name and r["stage"] == "assigned")
        fit = result.summary("assigned", n)["fit"]
        assert fit["pieces_max"] >= fit["max"] > 0
        assert {name: row[name] for name in fit} == fit
