"""Released umbrella meshes as design files of our own; skipped where the released files are
absent."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.distance import pdist

from kop_exudyn.errors import InputError
from kop_exudyn.files.documents import check_schema
from kop_exudyn.files.json_files import read_json
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.umbrella.bodies import joint_bodies
from kop_exudyn.structures.umbrella.design import Umbrella
from kop_exudyn.structures.umbrella.importer import import_release
from kop_exudyn.structures.umbrella.release import release_mesh
from kop_exudyn.units import Units


@pytest.fixture(scope="module")
def content(shared_data):
    return read_json(shared_data / "umbrella" / "sphere_cap_0.3.json.gz")


def test_imported_design_is_the_same_structure_in_millimetres(content):
    data = import_release(content, "cap")
    check_schema(data, "umbrella")
    own, released = design_from_dict(data), Umbrella.from_release(content)
    assert own.units == released.units == Units("mm", "N") and released.mesh.unit == 1.0
    unit = content["bbox_diagonal"]
    assert own.parameters == pytest.approx(unit * release_mesh(content).lengths.ravel())
    assert own.lower == pytest.approx(released.lower)
    a, b = own.deploy()["deployed"], released.deploy()["deployed"]
    assert a.elastic_energy == pytest.approx(b.elastic_energy, rel=1e-6)
    distances = [
        np.sort(pdist(eq.state.positions[d.joints])) for eq, d in ((a, own), (b, released))
    ]
    assert distances[0] == pytest.approx(distances[1], rel=1e-4)


def test_imported_plates_may_be_rigid(content):
    data = import_release(content, "cap", plate_model="rigid")
    check_schema(data, "umbrella")
    assert design_from_dict(data).plate_model == "rigid" and "plate_model" not in import_release(
        content, "cap"
    )


def test_rigid_plates_lie_on_side_a_of_their_joints(content):
    mesh = Umbrella.from_release(content).mesh
    behind = mesh.rods.behind.copy()
    behind[~mesh.rods.arms, 0] = True
    with pytest.raises(InputError, match="side A"):
        joint_bodies(replace(mesh, rods=replace(mesh.rods, behind=behind)), "rigid")


def test_a_mesh_with_other_arms_is_refused(content):
    data = copy.deepcopy(content)
    data["flip_bits"] = [not bit for bit in data["flip_bits"]]
    with pytest.raises(InputError, match="base mesh"):
        import_release(data, "cap", "file.json")
