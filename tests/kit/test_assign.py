"""Assignment to limited numbers of pieces, against brute force."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.errors import InputError
from kop_exudyn.kit.assign import nearest
from kop_exudyn.kit.groups import ElementGroup
from kop_exudyn.kit.parts import Kit
from kop_exudyn.kit.stock import Stock

RNG = np.random.default_rng(5)
Q = np.concatenate([RNG.uniform(1, 3, 10), RNG.uniform(-1, 1, 4)])
GROUPS = [
    ElementGroup("linear", np.arange(8).reshape(4, 2)),
    ElementGroup("linear", np.array([[8], [9]])),
    ElementGroup("angular", np.arange(10, 14)[:, None]),
]
DESIGN_OF = [0, 0, 0]
KIT = Kit({"linear": RNG.uniform(1, 3, (3, 2)), "angular": [0.2, 0.7]})


def stock(linear, angular=(4, 4), together=False):
    return Stock(KIT, {"linear": linear, "angular": angular}, together)


def squared(assignment):
    return np.sum((Q - assignment.realise(KIT, Q)) ** 2)


def brute_force(counts):
    """Least squared distance of the linear elements that uses no part more often than counted."""
    elements = [Q[0:2], Q[2:4], Q[4:6], Q[6:8], Q[8:9], Q[9:10]]
    best = np.inf
    for parts in itertools.product(range(3), repeat=6):
        if np.any(np.bincount(parts, minlength=3) > counts):
            continue
        total = 0.0
        for element, part in zip(elements, parts):
            l1, l2 = KIT["linear"][part]
            options = ([l1, l2], [l2, l1]) if len(element) == 2 else ([l1], [l2])
            total += min(np.sum((element - option) ** 2) for option in options)
        best = min(best, total)
    return best


def test_ample_stock_is_the_nearest_assignment():
    free = nearest(GROUPS, Q, KIT)
    assert stock([6, 6, 6]).assign(GROUPS, Q, DESIGN_OF).changes(free) == 0
    assert stock([6, 6, 6]).missing(GROUPS, Q, DESIGN_OF) == []


@settings(deadline=None, max_examples=12)
@given(st.tuples(*[st.integers(0, 6)] * 3).filter(lambda counts: sum(counts) >= 6))
def test_scarce_stock_is_used_best(counts):
    found = stock(list(counts), [2, 2]).assign(GROUPS, Q, DESIGN_OF)
    assert np.all(found.pieces(KIT)["linear"] <= counts)
    assert found.pieces(KIT)["angular"].tolist() == [2, 2]
    linear = np.sum((Q - found.realise(KIT, Q))[:10] ** 2)
    assert linear == pytest.approx(brute_force(counts), rel=1e-12)
    assert squared(found) >= squared(nearest(GROUPS, Q, KIT)) * (1 - 1e-12)


def test_designs_share_pieces_only_when_they_stand_together():
    design_of = [0, 1, 1]  # the four whole beams; the two ends and the corners
    apart = stock([2, 1, 1]).assign(GROUPS, Q, design_of)
    counts = [np.bincount(part, minlength=3) for part in apart.part[:2]]
    assert all(np.all(own <= [2, 1, 1]) for own in counts) and sum(counts).sum() == 6
    with pytest.raises(InputError, match="4 linear pieces for 6 elements"):
        stock([2, 1, 1], together=True).assign(GROUPS, Q, design_of)
    together = stock([2, 2, 2], together=True).assign(GROUPS, Q, design_of)
    assert together.pieces(KIT)["linear"].tolist() == [2, 2, 2]


def test_missing_pieces_are_counted_and_named():
    (one,) = stock([1, 0, 2]).missing(GROUPS, Q, DESIGN_OF)
    assert (one.kind, one.number, one.design) == ("linear", 3, 0)
    assert one.copies.sum() == 3
    enough = np.array([1, 0, 2]) + one.copies
    best = squared(stock(enough).assign(GROUPS, Q, DESIGN_OF))
    for more in itertools.product(range(4), repeat=3):  # no other three pieces would fit better
        if sum(more) == 3:
            other = stock(np.array([1, 0, 2]) + more).assign(GROUPS, Q, DESIGN_OF)
            assert squared(other) >= best * (1 - 1e-12)
    lacking = Stock(Kit({"linear": KIT["linear"]}), {"linear": np.array([6, 6, 6])})
    (one,) = lacking.missing(GROUPS, Q, DESIGN_OF)
    assert (one.kind, one.number, one.copies) == ("angular", 4, None)
    both = stock([2, 1, 1], together=True).missing(GROUPS, Q, [0, 1, 1])
    assert [(m.kind, m.number, m.design) for m in both] == [("linear", 2, None)]
    assert stock([2, 1, 1]).missing(GROUPS, Q, [0, 1, 1]) == []


def test_what_designs_may_take_besides_what_they_have():
    found = nearest(GROUPS, Q, KIT)
    ample = stock([9, 9, 9])
    spare = ample.spare(found, DESIGN_OF)
    assert spare[0] is spare[1] and spare[2] is not spare[0]
    np.testing.assert_array_equal(spare[0], 9 - found.pieces(KIT)["linear"])
    apart = ample.spare(found, [0, 1, 1])
    assert apart[0].sum() == 27 - 4 and apart[1].sum() == 27 - 2
    assert not stock([9, 9, 9], together=True).spare(found, DESIGN_OF)[0].any()


@pytest.mark.parametrize(
    "counts, message",
    [([9, 9], "3 whole numbers"), ([9, 9, -1], "negative"), ([9, 9, 0.5], "whole numbers")],
)
def test_unusable_counts(counts, message):
    with pytest.raises(InputError, match=message):
        stock(counts)
