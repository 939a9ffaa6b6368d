"""Assign parts to elements: the nearest ones, or the best ones of which there are enough pieces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from ..errors import InputError
from ..wording import counted
from .elements import KindElements, Labels, collect
from .groups import ElementGroup
from .parts import Assignment, Kit


def nearest(groups: Sequence[ElementGroup], q: np.ndarray, kit: Kit) -> Assignment:
    """Each element's nearest part and variant; q (n_q,). Of equally near ones the first.

    Raises InputError when the kit lacks a kind that the elements need.
    """
    elements = collect(groups, q)
    return to_assignment(
        groups, len(q), elements, {name: e.nearest(kit[name]) for name, e in elements.items()}
    )


def to_assignment(
    groups: Sequence[ElementGroup],
    n_q: int,
    elements: Mapping[str, KindElements],
    labels: Mapping[str, Labels],
) -> Assignment:
    """Labels by kind, sorted back into the groups."""
    part, variant = ([np.empty(0, dtype=np.intp)] * len(groups) for _ in range(2))
    for name, e in elements.items():
        start = 0
        for number in (number for block in e.groups for number in block):
            span = slice(start, start + len(groups[number].indices))
            part[number], variant[number] = labels[name].part[span], labels[name].variant[span]
            start = span.stop
    return Assignment(tuple(groups), tuple(part), tuple(variant), n_q)


def element_owners(
    groups: Sequence[ElementGroup], elements: KindElements, owner_of: np.ndarray
) -> np.ndarray:
    """(n,) the owner of each element, from those of the groups (n_groups,)."""
    numbers = [number for block in elements.groups for number in block]
    return np.repeat(owner_of[numbers], [len(groups[number].indices) for number in numbers])


def transport(
    elements: KindElements,
    parts: np.ndarray,
    counts: np.ndarray,
    owner: np.ndarray,
    surcharge: np.ndarray | None = None,
) -> Labels:
    """Parts of least total squared distance, of which each owner's elements use part i at most
    counts[i] times.

    parts : (m, k_p); counts : (m,); owner : (n,) of each element
    surcharge : (m,) added to the squared distances

    An end element uses up a whole part. Raises InputError where there are fewer pieces than
    elements of an owner.
    """
    costs, variants = elements.costs(parts)
    priced = costs if surcharge is None else costs + surcharge
    part = priced.argmin(axis=1)
    for number in np.unique(owner):
        own = np.flatnonzero(owner == number)
        if np.all(np.bincount(part[own], minlength=len(parts)) <= counts):
            continue  # the nearest ones suffice
        if counts.sum() < len(own):
            raise InputError(
                f"the stock has {counted(counts.sum(), f'{elements.kind.name} piece')} for "
                f"{counted(len(own), 'element')}",
                field=f"counts.{elements.kind.name}",
            )
        pieces = np.repeat(np.arange(len(parts)), np.minimum(counts, len(own)))
        part[own] = pieces[linear_sum_assignment(priced[np.ix_(own, pieces)])[1]]
    rows = np.arange(len(part))
    return Labels(part, variants[rows, part], costs[rows, part])
