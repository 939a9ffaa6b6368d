"""What a released umbrella mesh says of its target is kept, however much of it there is."""

import numpy as np
import pytest

from kop_exudyn.errors import InputError
from kop_exudyn.structures.umbrella.design import Umbrella, umbrella_from_dict
from kop_exudyn.structures.umbrella.generator import design_on_surface, height_field, hexagon_patch
from kop_exudyn.structures.umbrella.layout import BaseMesh, Plates
from kop_exudyn.structures.umbrella.mesh import UmbrellaTarget
from kop_exudyn.structures.umbrella.release import REQUIRED, is_release, release_mesh


@pytest.fixture(scope="module")
def data():
    vertices, faces = height_field(lambda x, y: -(x**2 + y**2) / 700, 900.0, 12)
    base = BaseMesh(*hexagon_patch(1, 30 + np.sqrt(3) * Plates().thickness))
    return design_on_surface("cap", base, vertices, faces, plates=Plates())


def test_a_target_without_correspondences_stays_the_target(data):
    target = {key: data["target"][key] for key in ("vertices", "faces")}
    design = umbrella_from_dict(data | {"target": target})
    assert design.attractions() == ()
    np.testing.assert_array_equal(design.target.vertices, target["vertices"])


def test_places_that_are_known_pull(data):
    target = dict(data["target"])
    target["plates"] = [None, *target["plates"][1:]]
    target["crossings"] = [*target["crossings"][:-1], None]
    design = umbrella_from_dict(data | {"target": target})
    assert [len(term.bodies) for term in design.attractions()] == [5, 5]
    assert [len(term.bodies) for term in umbrella_from_dict(data).attractions()] == [6, 6]


def test_pins_need_places(data):
    target = {key: data["target"][key] for key in ("vertices", "faces")}
    with pytest.raises(InputError, match="pins.positions: the target doesn't say where"):
        umbrella_from_dict(data | {"target": target, "pins": {"joints": [0, 2, 4]}})


def test_scaled_meshes_are_the_same_in_other_units(data):
    mesh = umbrella_from_dict(data).mesh
    twice = mesh.scaled(2.0)
    assert isinstance(twice.target, UmbrellaTarget) and twice.unit == 0.5
    for name in ("positions", "lengths", "spacing", "thickness", "plate_edge", "size"):
        np.testing.assert_allclose(getattr(twice, name), 2 * np.array(getattr(mesh, name)))
    q = twice.lengths.ravel() + 3.0
    np.testing.assert_allclose(
        twice.compact_positions(q), 2 * mesh.compact_positions(q / 2), atol=1e-9
    )
    energies = [Umbrella("cap", m).deploy()["deployed"].elastic_energy for m in (mesh, twice)]
    assert energies[1] == pytest.approx(8 * energies[0], rel=1e-5)


def test_a_release_that_lacks_a_field_is_told_so():
    found = dict.fromkeys(REQUIRED - {"segment_normals"}, [])
    assert is_release(found)
    with pytest.raises(InputError, match="segment_normals: is missing in this released umbrella"):
        release_mesh(found)
    assert not is_release({"vertices": [], "faces": []})
    assert not is_release(found | {"format": "kop_exudyn/design"})
