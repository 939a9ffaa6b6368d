"""Kits whose best one is known: the enumeration leaves nothing out, and the search comes near."""

import itertools

import numpy as np

from lib.small_kits import assignments, compared


def form(part, variant):
    """The same whatever the two parts are called, and whichever of their ends comes first."""
    forms = []
    for swap, first, second in itertools.product((0, 1), repeat=3):
        renamed = part ^ swap
        turned = variant ^ np.where(renamed == 0, first, second)
        forms.append((tuple(renamed.tolist()), tuple(turned.tolist())))
    return min(forms)


def test_every_assignment_that_differs_is_tried_once():
    found = [form(part, variant) for part, variant in assignments(4)]
    assert len(found) == len(set(found)) == 36
    ways = [np.array(way) for way in itertools.product(range(4), repeat=4)]
    assert {form(way // 2, way % 2) for way in ways} == set(found)


def test_the_search_comes_near_the_best():
    (row,) = compared(0)["rows"]
    assert row["assignments"] == 36 and row["J of the best"] <= row["J of the search"]
    assert row["ratio"] <= 1.1 and row["direct"] > 5
