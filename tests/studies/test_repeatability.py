"""Searches whose inputs differ by rounding: really other inputs, and their spread."""

import numpy as np
import pytest
from support.zigzags import zigzags

from lib.repeated import PERTURBATION, perturbed, spread_percent


def test_inputs_differ_by_rounding_and_by_their_seed():
    design = zigzags()[0]
    first, again, other = (perturbed(design, seed) for seed in (1, 1, 2))
    assert np.array_equal(perturbed(design, 0).parameters, design.parameters)
    assert np.array_equal(first.parameters, again.parameters)
    shares = [one.parameters / design.parameters - 1 for one in (first, other)]
    assert not np.array_equal(*shares)
    for share in shares:
        assert 0 < np.abs(share).max() < 6 * PERTURBATION
    moved = [one.deploy()["deployed"].state.positions for one in (design, first)]
    assert 0 < np.abs(moved[0] - moved[1]).max() < 1e-5


def test_spread_is_that_of_the_extremes():
    assert spread_percent([2.0, 2.5, 2.2]) == pytest.approx(25.0)
    assert spread_percent([2.0, None]) is None and spread_percent([]) is None
