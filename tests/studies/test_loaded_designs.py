"""Copies of design files with a load that suits each."""

from __future__ import annotations

import json

import numpy as np
import pytest

from kop_exudyn.io.datasets import select_files
from kop_exudyn.io.designs import load_design
from lib.loaded_designs import FACTOR, SPAN_OVER, with_snow


@pytest.mark.parametrize("file", ["grids/06_mesh.json", "small/03_exp.json"])
def test_copies_find_what_their_files_refer_to(repository, tmp_path, file):
    """A target in a file beside the design is found from the copy as well, and nothing but the
    load differs."""
    given = repository / "models" / file
    [copied] = select_files(with_snow([given], tmp_path / "copies"))
    before, after = load_design(given), load_design(copied)
    np.testing.assert_array_equal(before.parameters, after.parameters)
    np.testing.assert_array_equal(before.target.positions, after.target.positions)
    [case] = after.load_cases
    assert case.factor == FACTOR and case.deflection.span_over == SPAN_OVER
    assert case.gravity[2] < 0 and not before.load_cases
    written = json.loads(copied.read_text(encoding="utf-8"))
    assert set(written) - set(json.loads(given.read_text(encoding="utf-8"))) == {"load_cases"}
