"""Bars for straight pieces, against plans that are known to be best."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.errors import InputError
from kop_exudyn.fabrication.blanks import Blanks
from kop_exudyn.fabrication.options import CutOptions
from kop_exudyn.fabrication.stock import cut_from_bars, stock_plan


def sawn(plan):
    found = {}
    for bar in plan.bars:
        for label, _ in bar.pieces:
            found[label] = found.get(label, 0) + 1
    return found


def test_a_problem_of_gilmore_and_gomory_kind():
    """Widths 3, 5 and 9 from rolls of 17, 25, 20 and 15 of them: seven rolls are needed."""
    plan = cut_from_bars("abc", [3, 5, 9], [25, 20, 15], [17])
    # the total width is 310 of 17 each: 18.2, so at least 19
    assert plan.least <= plan.length and len(plan.bars) == 19
    assert sawn(plan) == {"a": 25, "b": 20, "c": 15}


def test_the_kerf_is_lost_between_pieces_only():
    assert len(cut_from_bars("a", [100.0], [10], [1000.0], 0.0).bars) == 1
    assert len(cut_from_bars("a", [100.0], [10], [1000.0], 3.0).bars) == 2
    (bar,) = cut_from_bars("a", [100.0], [10], [1027.0], 3.0).bars
    assert bar.left == pytest.approx(0.0, abs=1e-9)


def test_of_several_lengths_the_least_total_is_bought():
    plan = cut_from_bars("ab", [1.9, 1.1], [3, 1], [2.0, 4.0], 0.0)
    assert plan.length == pytest.approx(8.0)
    assert sawn(plan) == {"a": 3, "b": 1}


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    st.lists(st.integers(2, 9), min_size=1, max_size=4, unique=True),
    st.data(),
)
def test_never_more_than_the_best_plan_found_by_trying_all(lengths, data):
    counts = data.draw(st.lists(st.integers(1, 2), min_size=len(lengths), max_size=len(lengths)))
    plan = cut_from_bars([str(n) for n in lengths], lengths, counts, [10], 1.0)
    pieces = [n for n, count in zip(lengths, counts) for _ in range(count)]
    assert plan.least <= plan.length + 1e-9
    assert sorted(length for bar in plan.bars for _, length in bar.pieces) == sorted(pieces)
    for bar in plan.bars:
        used = sum(length for _, length in bar.pieces) + len(bar.pieces) - 1
        assert used + bar.left == pytest.approx(bar.length) and bar.left >= -1e-9
    if len(pieces) <= 6:
        assert len(plan.bars) == fewest(pieces)


def fewest(pieces):
    """Bars of 10 with a kerf of 1, by trying every way to share the pieces out."""
    best = len(pieces)
    for places in itertools.product(range(len(pieces)), repeat=len(pieces)):
        loads = np.zeros(len(pieces))
        for piece, place in zip(pieces, places):
            loads[place] += piece + 1
        if (loads <= 11).all():
            best = min(best, np.count_nonzero(loads))
    return best


def test_a_kit_from_bars(parts):
    plan = stock_plan(Blanks(parts, "m", CutOptions(stock=(1500.0, 2400.0))))
    needed = dict(zip(parts.labels["linear"], parts.needed()["linear"].tolist()))
    assert sawn(plan) == needed
    assert stock_plan(Blanks(parts, "m", CutOptions(stock=()))) is None
    with pytest.raises(InputError, match="longer than every bar"):
        stock_plan(Blanks(parts, "m", CutOptions(sheet=(500.0, 600.0), stock=(500.0,))))
    with pytest.raises(InputError, match="nothing is left of part S2"):
        cut_from_bars(["S1", "S2"], [30.0, -4.0], [2, 1], [100.0])
