"""Knees of trade-off curves."""

from __future__ import annotations

import numpy as np
import pytest

from kop_exudyn.analysis.tradeoff import envelope, knee


def test_the_envelope_is_what_at_most_so_many_parts_give():
    assert envelope([None, 5.0, 2.0, 3.0, 1.0]).tolist() == [np.inf, 5, 2, 2, 1]


def test_a_corner_is_the_knee_in_any_units():
    sizes, values = [2, 4, 6, 8, 10], [9.0, 5.0, 1.0, 0.9, 0.8]
    assert knee(sizes, values) == 2
    assert knee([30 * s for s in sizes], [7 + 0.01 * v for v in values]) == 2
    assert knee([1, *sizes], [None, *values]) == 3


@pytest.mark.parametrize(
    "values", [[4.0, 3.0, 2.0], [1.0, 1.0, 1.0], [None, None, 2.0], [4.0, 3.9, 1.0]]
)
def test_curves_without_a_knee(values):
    assert knee([1, 2, 3], values) is None
