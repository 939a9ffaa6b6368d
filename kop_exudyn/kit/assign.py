"""Assign parts to elements: the nearest ones, or the best ones that a stock of parts has enough
of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import scipy.sparse as sp

from ..errors import InputError, SimulationFailure
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


def assign_with_stock(
    groups: Sequence[ElementGroup], q: np.ndarray, kit: Kit, counts: Mapping[str, Sequence[int]]
) -> Assignment:
    """The assignment of least total squared distance that uses part i of each kind at most
    counts[kind][i] times.

    A transport problem a kind, solved as a mixed-integer program by HiGHS; an end element uses up a
    whole part. Kinds without counts are not limited. Raises InputError when the stock is too small
    or doesn't fit the kit.
    """
    elements = collect(groups, q)
    labels = {}
    for name, e in elements.items():
        parts = kit[name]
        labels[name] = (
            _transport(e, parts, _stock(name, counts[name], len(parts), e.n))
            if name in counts
            else e.nearest(parts)
        )
    return to_assignment(groups, len(q), elements, labels)


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


def _stock(name: str, counts: Sequence[int], n_parts: int, n_elements: int) -> np.ndarray:
    stock = np.asarray(counts)
    if stock.shape != (n_parts,) or not np.issubdtype(stock.dtype, np.integer) or np.any(stock < 0):
        raise InputError(
            f"expected {n_parts} whole numbers, not negative", field=f"counts.{name}", value=counts
        )
    if stock.sum() < n_elements:
        raise InputError(
            f"the stock has {stock.sum()} parts for {n_elements} elements", field=f"counts.{name}"
        )
    return stock


def _transport(elements: KindElements, parts: np.ndarray, stock: np.ndarray) -> Labels:
    """min sum c_ij x_ij, sum_j x_ij = 1, sum_i x_ij <= stock_j, x binary. Its matrix is totally
    unimodular."""
    from scipy.optimize import LinearConstraint, milp

    costs, variants = elements.costs(parts)
    n, m = costs.shape
    each_element = sp.kron(sp.eye_array(n), np.ones((1, m)), format="csr")
    each_part = sp.kron(np.ones((1, n)), sp.eye_array(m), format="csr")
    scale = max(costs.max(), np.finfo(float).tiny)
    solution = milp(
        costs.ravel() / scale,
        integrality=np.ones(n * m),
        bounds=(0, 1),
        options={"mip_rel_gap": 0.0},
        constraints=[LinearConstraint(each_element, 1, 1), LinearConstraint(each_part, 0, stock)],
    )
    if solution.x is None:
        raise SimulationFailure(
            solution.message, where=f"stock assignment of {elements.kind.name} parts"
        )
    part = solution.x.reshape(n, m).argmax(axis=1)
    rows = np.arange(n)
    return Labels(part, variants[rows, part], costs[rows, part])
