"""The small designs: written by their script, and usable, the one with straight outer curves
included."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest

from kop_exudyn.io.datasets import load_designs


@pytest.fixture
def folder(repository):
    return repository / "models" / "small"


def test_the_script_writes_these_files(folder, tmp_path):
    spec = importlib.util.spec_from_file_location("make_small", folder / "make.py")
    make = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(make)
    files = make.write(tmp_path)
    assert {path.name: path.read_text() for path in files} == {
        path.name: path.read_text() for path in folder.glob("*.json")
    }


def test_targets_are_whole_and_pass_through_the_joints(folder):
    designs = load_designs(folder)
    assert [design.n_elements for design in designs] == [56, 56, 56]
    for design in designs:
        target = design.target
        # shells, not plane nets
        assert np.ptp(target.positions[:, 2]) > 0.07 * target.size
        edges = target.vertices[target.faces] - target.vertices[np.roll(target.faces, 1, axis=1)]
        assert np.linalg.norm(edges, axis=2).max() < 0.2 * target.size
        nearest = np.linalg.norm(target.vertices[None] - target.positions[:, None], axis=2).min(
            axis=1
        )
        assert nearest.max() < 1e-12
