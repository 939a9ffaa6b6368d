"""Random changes of an assignment, from which iterated local search goes on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..kit.kinds import part_kind
from ..kit.parts import Assignment, Kit

_SHAKEN = 0.05  # of the elements get any other part


def shaken(
    assignment: Assignment,
    kit: Kit,
    rng: np.random.Generator,
    groups: Sequence[int] | None = None,
    share: float = _SHAKEN,
) -> Assignment:
    """Some elements with any other part, in any variant.

    groups : of elements, by their numbers, that are shaken; default: all
    share : of these elements, two at least
    """
    chosen = range(len(assignment.part)) if groups is None else groups
    n = sum(len(assignment.part[g]) for g in chosen)
    wanted = max(2, round(share * n))
    parts, variants = (
        [a.copy() for a in arrays] for arrays in (assignment.part, assignment.variant)
    )
    sizes = np.array([len(parts[g]) for g in chosen])
    ends = np.cumsum(sizes)
    for element in rng.choice(n, size=min(wanted, n), replace=False):
        place = int(np.searchsorted(ends, element, side="right"))
        k = int(element - (ends[place] - sizes[place]))
        number = chosen[place]
        group = assignment.groups[number]
        ways = part_kind(group.kind).variants_of(group.indices.shape[1])
        parts[number][k] = rng.integers(len(kit[group.kind]))
        variants[number][k] = rng.integers(len(ways.names))
    return Assignment(assignment.groups, tuple(parts), tuple(variants), assignment.n_q)
