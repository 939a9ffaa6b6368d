"""Rows and knees of trade-off curves."""

from __future__ import annotations

import numpy as np
import pytest

from kop_exudyn.analysis.tradeoff import envelope, knee, tradeoff_row

FOUND = {
    "pieces": [{"linear": [4, 2]}, {"linear": [2, 4]}],
    "objective": 1.5,
    "equilibria": 20,
    "designs": [
        {"fit": {"max_percent": 2.0, "mean_percent": 0.5}, "energy_ratio": 1.1},
        {"fit": {"max_percent": 3.0, "mean_percent": 1.0}, "energy_ratio": 0.9},
    ],
}


def test_a_row_sums_up_all_designs():
    row = tradeoff_row({"linear": 2}, FOUND, 7.0)
    assert row == {
        "linear": 2,
        "pieces": 8,
        "kit size %": pytest.approx(100 * 8 / 12),
        "max %": 3.0,
        "mean %": 0.75,
        "energy ratio": 1.0,
        "largest energy ratio": 1.1,
        "failed designs": 0,
        "J": 1.5,
        "equilibria": 20,
        "seconds": 7.0,
    }


def test_a_failed_design_leaves_no_deviation():
    row = tradeoff_row(
        {"linear": 2}, FOUND | {"designs": [FOUND["designs"][0], {"failed": "buckled"}]}, 7.0
    )
    assert row["failed designs"] == 1 and row["max %"] is None and row["energy ratio"] is None


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
