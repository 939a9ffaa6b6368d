"""Reuse of parts, on cases counted by hand and on random ones."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from kop_exudyn.analysis.reuse import (
    average_reuse,
    counts_of,
    disconnected,
    fabricated,
    jaccard_matrix,
    kit_size_percent,
    part_users,
    reuse,
    reuse_figures,
    subset_reuse,
)

# three parts: both designs use the first, each has one of its own
PAIR = np.array([[4, 2, 0], [2, 0, 2]])
tables = hnp.arrays(
    int, st.tuples(st.integers(2, 5), st.integers(1, 6)), elements=st.integers(0, 9)
).filter(lambda counts: (counts.sum(axis=1) > 0).all())


def test_two_designs_by_hand():
    assert fabricated(PAIR) == 8
    assert kit_size_percent(PAIR) == 80
    assert reuse(PAIR) == 2 / 8
    assert jaccard_matrix(PAIR).tolist() == [[1, 0.25], [0.25, 1]]
    assert average_reuse(PAIR) == 0.25
    assert part_users(PAIR).tolist() == [2, 1, 1]


def test_three_designs_by_hand():
    counts = np.array([[2, 1], [2, 3], [0, 1]])
    found = {subset.designs: subset.reuse for subset in subset_reuse(counts)}
    assert found == {(0, 1): 3 / 5, (0, 2): 1 / 3, (1, 2): 1 / 5, (0, 1, 2): 1 / 5}
    assert average_reuse(counts) == pytest.approx((3 / 5 + 1 / 3 + 1 / 5 + 1 / 5) / 4)


def test_designs_that_share_nothing_are_found():
    counts = np.array([[1, 0, 0, 2], [0, 3, 0, 0], [1, 0, 0, 0], [0, 1, 1, 0]])
    assert disconnected(counts) == [(0, 2), (1, 3)]
    assert disconnected(PAIR) == [(0, 1)]


def test_pieces_by_kind_make_one_table():
    designs = [{"linear": [3, 0], "angular": [1]}, {"linear": [1, 1], "angular": [0]}]
    assert counts_of(designs).tolist() == [[1, 3, 0], [0, 1, 1]]
    assert counts_of(designs, "linear").tolist() == [[3, 0], [1, 1]]
    figures = reuse_figures(designs)
    assert (
        figures["pieces"] == 5
        and figures["elements"] == 6
        and figures["by_kind"] == {"angular": 0, "linear": 1 / 4}
    )
    assert figures["parts_of_one_design"] == 2 and figures["groups"] == [[0, 1]]


@given(tables)
def test_bounds_and_symmetry(counts):
    matrix = jaccard_matrix(counts)
    assert ((matrix >= 0) & (matrix <= 1)).all() and np.array_equal(matrix, matrix.T)
    assert 100 / len(counts) - 1e-9 <= kit_size_percent(counts) <= 100
    for subset in subset_reuse(counts):  # more designs never share more
        pairs = [matrix[i, j] for i in subset.designs for j in subset.designs]
        assert subset.reuse <= min(pairs) + 1e-12
    members = sorted(n for group in disconnected(counts) for n in group)
    assert members == list(range(len(counts)))


@given(tables)
def test_the_same_design_twice_shares_everything(counts):
    assert reuse(counts[[0, 0]]) == 1
    assert kit_size_percent(counts[[0, 0]]) == 50
