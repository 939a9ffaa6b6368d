"""Results as objects of other libraries, and as one line of text."""

import numpy as np
import pytest

import kop_exudyn as kop
from kop_exudyn.errors import InputError
from kop_exudyn.structures.loads import LoadCase
from kop_exudyn.structures.strength import design_strength


@pytest.fixture(scope="module")
def design(repository):
    return kop.load_design(repository / "models" / "small" / "01_sinh.json")


@pytest.fixture(scope="module")
def result(design):
    return kop.simulate(design, LoadCase(joints=[5], forces=[[0, 0, -0.05]]))


def test_stress_is_that_of_the_deployed_state(design, result):
    strength = design_strength(design, {"deployed": result.deployed})["deployed"]
    np.testing.assert_array_equal(result.stress, strength.equivalent)
    np.testing.assert_array_equal(result.utilisation, strength.utilisation)
    assert 0 < result.utilisation.max() == result.to_dict()["strength"]["deployed"]["utilisation"]


def test_tables_of_pandas(result):
    pytest.importorskip("pandas")
    tables = kop.to_pandas(result)
    rods, joints = tables["rods"], tables["joints"]
    assert set(rods["state"]) == {"deployed", "rest", "loaded"}
    deployed = rods[rods["state"] == "deployed"]
    np.testing.assert_array_equal(deployed["equivalent_stress"], result.stress)
    np.testing.assert_array_equal(joints[["x", "y", "z"]], result.joints + result.design.origin)
    np.testing.assert_array_equal(joints["distance"], result.fit.distances)


def test_meshes_and_graphs(design, result):
    mesh, loaded = kop.to_meshio(result), kop.to_meshio(result, "loaded")
    assert len(mesh.cells[0].data) == len(result.stress)
    np.testing.assert_array_equal(mesh.cell_data["utilisation"][0], result.utilisation)
    moved = np.linalg.norm(loaded.points - mesh.points, axis=1).max()
    assert moved == pytest.approx(result.loaded.deflections.max(), rel=1e-9) and moved > 0
    pytest.importorskip("compas")
    graph = kop.to_compas(result)["graph"]
    assert graph.number_of_edges() == len(design.scene("deployed").chains)
    with pytest.raises(InputError, match="state = 'flat': unknown .known: deployed, rest"):
        kop.to_meshio(result, "flat")
    with pytest.raises(InputError, match="design = 'other': unknown .known: small sinh"):
        kop.to_meshio(result, design="other")


def test_a_picture_of_each_state(result):
    titles = [ax.get_title() for ax in kop.plot(result).axes]
    assert titles == ["deployed", "loaded: deflections", ""]  # the last one is the scale


def test_one_line_each(design, result):
    """What a prompt shows is short, and names what it is of."""
    group = design.groups[0]
    found = [(repr(thing), word) for thing, word in [
        (design, "small sinh"),
        (result, "small sinh"),
        (result.deployed, "stable"),
        (result.loaded, "deflection"),
        (result.loaded.case, "1 forces"),
        (result.strength, "%"),
        (result.fit, "joints"),
        (group, group.kind),
        (kop.Kit({"linear": np.ones((3, 2))}), "3 linear"),
        (kop.Sensitivities(design.systems["deployed"], result.deployed), "parameters"),
    ]]  # fmt: skip
    for line, word in found:
        assert "\n" not in line and len(line) < 110 and word in line, line
