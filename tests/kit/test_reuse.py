"""Pieces that have to be made, counted anew and kept up to date."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from kop_exudyn.kit.groups import ElementGroup
from kop_exudyn.kit.parts import Assignment, Kit
from kop_exudyn.kit.reuse import PieceCount


@given(st.integers(0, 10**6), st.integers(1, 4), st.integers(1, 5), st.integers(1, 12))
def test_changes_are_what_counting_anew_gives(seed, designs, parts, elements):
    rng = np.random.default_rng(seed)
    kit = Kit({"angular": np.linspace(0, 1, parts)[:, None], "linear": np.ones((2, 2))})
    groups, chosen, owners, first = [], [], [], 0
    for n in range(designs):
        for kind, size, m in (("angular", 1, parts), ("linear", 2, 2)):
            stop = first + size * elements
            groups.append(ElementGroup(kind, np.arange(first, stop).reshape(-1, size)))
            chosen.append(rng.integers(m, size=elements))
            owners.append(n)
            first = stop
    none = tuple(np.zeros(elements, int) for _ in groups)
    assignment = Assignment(tuple(groups), tuple(chosen), none, first)
    count = PieceCount(kit, assignment, owners)
    assert count.elements == 2 * elements * designs
    number, element = rng.integers(len(groups)), rng.integers(elements)
    kind, design = groups[number].kind, owners[number]
    mine = int(chosen[number][element])
    expected = count.changes(kind, design, mine)
    assert expected[mine] == 0
    for other in range(len(kit[kind])):
        chosen[number][element] = other
        again = PieceCount(kit, assignment, owners)
        assert again.fabricated - count.fabricated == expected[other]
    count.move(kind, design, mine, len(kit[kind]) - 1)
    np.testing.assert_array_equal(count.counts[kind], again.counts[kind])
