"""Designs at another size: lengths follow, angles stay, and files that they name are found."""

import json

import numpy as np
import pytest

from kop_exudyn.analysis.simulation import simulate
from kop_exudyn.errors import InputError
from kop_exudyn.files.json_files import read_json
from kop_exudyn.io.designs import load_design
from kop_exudyn.io.rescaling import save_rescaled
from kop_exudyn.kit.kinds import part_kind
from kop_exudyn.structures.base import rescaled


@pytest.mark.parametrize("name", ["small/03_exp", "grids/01_dome", "grids/06_mesh"])
def test_lengths_follow_and_angles_stay(name, repository, tmp_path):
    file = repository / "models" / f"{name}.json"
    (written,) = save_rescaled([file], [1.5], tmp_path / "out")
    first, second = load_design(file), load_design(written)
    assert written.parent == tmp_path / "out" and second.name == first.name
    for group in first.groups:
        factor = 1.0 if part_kind(group.kind).angular else 1.5
        np.testing.assert_allclose(
            second.parameters[group.indices],
            factor * first.parameters[group.indices],
            rtol=1e-6,
            atol=1e-8,
        )
    again = rescaled(rescaled(read_json(file), 1.5), 1 / 1.5)
    assert json.dumps(again).count("size") == json.dumps(read_json(file)).count("size") + (
        "grids" in name
    )
    with pytest.raises(InputError, match="exists"):
        save_rescaled([file], [1.5], tmp_path / "out")


def test_a_larger_shell_opens_into_a_larger_shape(repository, tmp_path):
    file = repository / "models" / "small" / "01_sinh.json"
    (written,) = save_rescaled([file], [0.8], tmp_path)
    results = [simulate(load_design(path)) for path in (file, written)]
    sizes = [np.linalg.norm(np.ptp(result.joints, axis=0)) for result in results]
    assert sizes[1] == pytest.approx(0.8 * sizes[0], rel=1e-3)


def test_umbrella_meshes_share_their_plates(repository, tmp_path):
    file = repository / "models" / "umbrellas" / "hill.json"
    with pytest.raises(InputError, match="hill.json.*class = 'umbrella'.*can't be rescaled"):
        save_rescaled([file], [1.1], tmp_path)
