"""Assignment with a limited stock, against brute force."""

import itertools

import numpy as np
import pytest

from kop_exudyn.errors import InputError
from kop_exudyn.kit.assign import assign_with_stock, nearest
from kop_exudyn.kit.groups import ElementGroup
from kop_exudyn.kit.parts import Kit

RNG = np.random.default_rng(5)
Q = np.concatenate([RNG.uniform(1, 3, 10), RNG.uniform(-1, 1, 4)])
GROUPS = [
    ElementGroup("linear", np.arange(8).reshape(4, 2)),
    ElementGroup("linear", np.array([[8], [9]])),
    ElementGroup("angular", np.arange(10, 14)[:, None]),
]
KIT = Kit({"linear": RNG.uniform(1, 3, (3, 2)), "angular": [0.2, 0.7]})


def squared(assignment):
    return np.sum((Q - assignment.realise(KIT, Q)) ** 2)


def test_ample_stock_is_the_nearest_assignment():
    free = nearest(GROUPS, Q, KIT)
    assert (
        assign_with_stock(GROUPS, Q, KIT, {"linear": [6, 6, 6], "angular": [4, 4]}).changes(free)
        == 0
    )
    assert assign_with_stock(GROUPS, Q, KIT, {}).changes(free) == 0


def test_scarce_stock_is_used_best():
    counts = [1, 2, 3]
    found = assign_with_stock(GROUPS, Q, KIT, {"linear": counts, "angular": [2, 2]})
    assert found.pieces(KIT)["linear"].tolist() == counts
    assert found.pieces(KIT)["angular"].tolist() == [2, 2]
    best = np.inf
    for order in set(itertools.permutations([0, 1, 1, 2, 2, 2])):
        total = 0.0
        for element, part in zip([Q[0:2], Q[2:4], Q[4:6], Q[6:8], Q[8:9], Q[9:10]], order):
            l1, l2 = KIT["linear"][part]
            options = ([l1, l2], [l2, l1]) if len(element) == 2 else ([l1], [l2])
            total += min(np.sum((element - option) ** 2) for option in options)
        best = min(best, total)
    linear = np.sum((Q - found.realise(KIT, Q))[:10] ** 2)
    assert linear == pytest.approx(best, rel=1e-12)
    assert squared(found) >= squared(nearest(GROUPS, Q, KIT))


@pytest.mark.parametrize(
    "counts, message",
    [
        ([1, 2, 2], "5 parts for 6 elements"),
        ([9, 9], "3 whole numbers"),
        ([9, 9, -1], "negative"),
        ([9, 9, 0.5], "whole numbers"),
    ],
)
def test_unusable_stock(counts, message):
    with pytest.raises(InputError, match=message):
        assign_with_stock(GROUPS, Q, KIT, {"linear": counts})
