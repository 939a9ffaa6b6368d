"""The ten designs of models/conformals: what the script writes, and that each is a sound
network."""

import importlib.util
import json

import numpy as np
import pytest
from scipy.spatial.distance import pdist

from kop_exudyn.geometry.network import network_from_dict
from kop_exudyn.io.designs import load_design
from kop_exudyn.structures.c_shell.straightening import straighten

NUMBERS = range(10)


@pytest.fixture(scope="module")
def folder(repository):
    return repository / "models" / "conformals"


@pytest.fixture(scope="module")
def make(folder):
    spec = importlib.util.spec_from_file_location("make_conformals", folder / "make.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def files(folder):
    found = sorted(folder.glob("*.json"))
    assert len(found) == 10
    return found


def test_the_script_writes_these_files(make, files, tmp_path):
    for written, kept in zip(make.write(tmp_path), files, strict=True):
        assert written.name == kept.name
        new, old = json.loads(written.read_text()), json.loads(kept.read_text())
        for a, b in zip(new.pop("curves"), old.pop("curves"), strict=True):
            # other libms round the last digit otherwise
            np.testing.assert_allclose(a["points"], b["points"], atol=2e-9)
        assert new == old


@pytest.mark.parametrize("number", NUMBERS)
def test_each_is_a_conformal_grid_of_the_same_scale(files, number):
    assert files[number].stat().st_size < 100_000
    net = network_from_dict(json.loads(files[number].read_text()))
    assert net.n_joints == 81 and net.opens.all() and len(net.strands) == 18
    lengths = np.concatenate([strand.lengths for strand in net.strands])
    assert lengths.mean() == pytest.approx(0.2, rel=0.02)
    assert lengths.min() > 0.05
    # right angles, but for the natural splines' straight ends
    np.testing.assert_allclose(net.opening_angles, np.pi / 2, atol=0.03)
    straight = [straighten(strand, net.joints) for strand in net.strands]
    assert all(s.exact.all() for s in straight)
    assert sum(s.lengths.size + s.corners.size for s in straight) == 432


@pytest.mark.parametrize("number", NUMBERS)
def test_none_is_stressed_beyond_three_fifths_of_its_limit(make, files, number):
    """What is left is for the kit, whose parts bend a design more than its own elements do."""
    shares = make.utilisations(files[number])
    assert set(shares) == {"deployed", "rest", "opening"}
    assert 0.1 < shares["deployed"] <= shares["opening"] + 0.01 <= 0.61


@pytest.mark.parametrize("number", NUMBERS)
def test_the_steps_of_opening_do_not_choose_the_shape(files, number, monkeypatch):
    """Two modes out of the plane that lie together would give different shapes for other steps."""
    shapes = []
    for step in (0.1, 0.05):
        monkeypatch.setattr("kop_exudyn.structures.c_shell.opening._OPENING_STEP", step)
        design = load_design(files[number])
        final = design.smooth_path[-1]
        shapes.append(pdist(final.state.positions[design.joints]))
    assert shapes[1] == pytest.approx(shapes[0], abs=1e-6)
