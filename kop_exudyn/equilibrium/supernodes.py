"""Symbolic factorisation by supernodes: what the numeric one needs to know, found once a pattern.

Unknowns with the same neighbours, as the six of a body, are one node of a smaller graph, which
QDLDL's approximate minimum degree orders (Amestoy, Davis, Duff 1996). Neighbours in its elimination
tree are then merged into supernodes where the kernels take less time for both together, zeros
included, than for each by itself (relaxed supernodes: Ashcraft and Grimes 1989).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import qdldl
import scipy.sparse as sp

from ..scene.recent import Recent

LANES = 4  # rows below a supernode's diagonal block are padded to a multiple, as in factor.c
# Time of a supernode in the kernels: nanoseconds, a number to clear, move and add, a multiplication
_PER_SUPERNODE, _PER_NUMBER, _PER_PRODUCT = 300.0, 1.2, 0.12


@dataclass(frozen=True)
class Supernodes:
    """Symbolic L D L^T of a symmetric matrix given by its upper triangle (n, n).

    order : (n,) unknown of each row in the order of the elimination
    first : (S + 1,) first column of each supernode
    row_start : (S + 1,) places of each supernode's rows in `rows` and `in_parent`
    rows : rows below each diagonal block, increasing
    in_parent : their places in the parent's front, its columns first
    children : (S,) numbers of children, which come just before their parent
    panel_start : (S + 1,) places of the dense panels
    entry_start : (S + 1,) places of each supernode's entries in `entry_from` and `entry_to`
    entry_from, entry_to : which value of the upper triangle goes where in the panels
    stack_size : largest number of stacked update entries
    """

    order: np.ndarray
    first: np.ndarray
    row_start: np.ndarray
    rows: np.ndarray
    in_parent: np.ndarray
    children: np.ndarray
    panel_start: np.ndarray
    entry_start: np.ndarray
    entry_from: np.ndarray
    entry_to: np.ndarray
    stack_size: int

    @property
    def widest(self) -> int:
        """Most columns of a supernode."""
        return int(np.diff(self.first).max(initial=0))

    @property
    def tallest(self) -> int:
        """Most rows below a supernode."""
        return int(np.diff(self.row_start).max(initial=0))


def supernodes_of(upper: sp.csc_matrix) -> Supernodes:
    """Analyse a pattern (upper triangle, all diagonal entries present); matrices of one pattern
    share the result."""
    return _recent.get(lambda: _analyse(upper), upper.indptr, upper.indices)


_recent: Recent[Supernodes] = Recent()


def _analyse(upper: sp.csc_matrix) -> Supernodes:
    n = upper.shape[0]
    column = np.repeat(np.arange(n), np.diff(upper.indptr))
    group = _same_neighbours(upper.indices, column, n)
    L, eliminated = _eliminate(group[upper.indices], group[column])
    width = np.bincount(group, minlength=L.shape[0])[eliminated]
    tree = _merged(L, width)

    # all unknowns in the order of the elimination
    members = np.argsort(group, kind="stable")
    member_start = _starts(np.bincount(group))[:-1]
    nodes = np.concatenate(tree.nodes)
    own = width[nodes]
    start = _starts(own)
    order = members[np.repeat(member_start[eliminated[nodes]] - start[:-1], own) + np.arange(n)]
    place = np.empty(n, np.int64)
    place[order] = np.arange(n)
    node_start = np.empty(len(nodes), np.int64)
    node_start[nodes] = start[:-1]
    supernode = np.repeat(np.arange(len(tree.nodes)), [len(some) for some in tree.nodes])
    k = np.bincount(supernode, own).astype(np.int64)
    first = _starts(k)

    # rows below: those of each supernode's last node
    last = np.array([some[-1] for some in tree.nodes])
    counts = np.diff(L.indptr)[last]
    of = np.repeat(np.arange(len(last)), counts)
    below = L.indices[
        np.repeat(L.indptr[last] - _starts(counts)[:-1], counts) + np.arange(counts.sum())
    ]
    below, of = below[(by := np.lexsort((node_start[below], of)))], of[by]
    start = _starts(width[below])
    rows = np.repeat(node_start[below] - start[:-1], width[below]) + np.arange(start[-1])
    m = np.bincount(of, width[below], minlength=len(last)).astype(np.int64)
    row_start = _starts(m)
    of_row = np.repeat(np.arange(len(last)), m)
    keys = of_row * n + rows

    def in_front(of: np.ndarray, row: np.ndarray) -> np.ndarray:
        """Places of rows in supernodes' fronts."""
        listed = k[of] + np.searchsorted(keys, of * n + row) - row_start[of]
        return np.where(row < first[of + 1], row - first[of], listed)

    padded = -(-m // LANES) * LANES
    panel_start = _starts((k + padded) * k)
    a, b = place[upper.indices], place[column]
    low, high = np.minimum(a, b), np.maximum(a, b)
    of = np.repeat(np.arange(len(last)), k)[low]
    to = panel_start[of] + (low - first[of]) * (k + padded)[of] + in_front(of, high)
    by = np.argsort(of, kind="stable")
    return Supernodes(
        order=order,
        first=first,
        row_start=row_start,
        rows=rows.astype(np.int32),
        in_parent=in_front(tree.parents[of_row], rows).astype(np.int32),
        children=tree.children.astype(np.int32),
        panel_start=panel_start,
        entry_start=_starts(np.bincount(of, minlength=len(last))),
        entry_from=by.astype(np.int32),
        entry_to=to[by],
        stack_size=_largest_stack(tree.children, padded * m),
    )


def _same_neighbours(row: np.ndarray, column: np.ndarray, n: int) -> np.ndarray:
    """(n,) number of the group of unknowns that each belongs to: all of a group have the same
    neighbours, themselves included.

    Neighbourhoods are compared by sums of random numbers. Should two sums be the same by chance,
    the group is a little too large, and some zeros are factorised.
    """
    weight = np.random.default_rng(0).integers(1, 2**62, n)  # sums wrap around, which is no harm
    key, apart = weight.copy(), row != column
    np.add.at(key, column[apart], weight[row[apart]])
    np.add.at(key, row[apart], weight[column[apart]])
    return np.unique(key, return_inverse=True)[1]


def _eliminate(a: np.ndarray, b: np.ndarray) -> tuple[sp.csc_matrix, np.ndarray]:
    """Pattern of L, and the order of the elimination, of a graph given by its edges' ends."""
    n = int(max(a.max(), b.max())) + 1
    keys = np.unique(np.concatenate([np.maximum(a, b) * n + np.minimum(a, b)]))
    row, column = keys % n, keys // n
    degree = np.bincount(row, minlength=n) + np.bincount(column, minlength=n)
    # diagonally dominant, so that no pivot vanishes, and without cancellation: all of L's pattern
    values = np.where(row == column, degree[row], -0.5)
    solver = qdldl.Solver(sp.csc_matrix((values, (row, column)), shape=(n, n)), upper=True)
    L, _, order = solver.factors()
    return L, np.asarray(order)


@dataclass(frozen=True)
class _Tree:
    """Supernodes, children before parents: their nodes in the order of the elimination, numbers of
    children (S,), parents (S,; -1: none)."""

    nodes: list[list[int]]
    children: np.ndarray
    parents: np.ndarray


def _merged(L: sp.csc_matrix, width: np.ndarray) -> _Tree:
    """The elimination tree with children merged into their parent where that saves time.

    width : (nodes,) unknowns of each node
    """
    n = L.shape[0]
    counts = np.diff(L.indptr)
    column = np.repeat(np.arange(n), counts)
    m = np.bincount(column, width[L.indices], minlength=n).astype(np.int64).tolist()
    k = width.tolist()
    parent = np.full(n, -1)
    parent[counts > 0] = np.minimum.reduceat(L.indices, L.indptr[:-1][counts > 0]) if n else 0
    up = parent.tolist()
    nodes: list[list[int]] = [[j] for j in range(n)]
    children: list[list[int]] = [[] for _ in range(n)]
    for j in range(n):
        kept = []
        for c in sorted(children[j], key=m.__getitem__, reverse=True):
            if _time(k[c] + k[j], m[j]) < _time(k[c], m[c]) + _time(k[j], m[j]):
                k[j] += k[c]
                nodes[j] = nodes[c] + nodes[j]
                kept += children[c]
            else:
                kept.append(c)
        children[j] = kept
        if up[j] >= 0:
            children[up[j]].append(j)

    # depth first; the largest updates are made first, which keeps the stack small (Liu 1986)
    order: list[int] = []
    ahead = [j for j in range(n) if up[j] < 0]
    while ahead:
        j = ahead.pop()
        order.append(j)
        ahead += sorted(children[j], key=m.__getitem__, reverse=True)
    order.reverse()
    number = np.empty(n, np.int64)
    for t, j in enumerate(order):
        number[nodes[j]] = t
    above = parent[order]
    return _Tree(
        nodes=[nodes[j] for j in order],
        children=np.array([len(children[j]) for j in order]),
        parents=np.where(above >= 0, number[above], -1),
    )


def _time(k: int, m: int) -> float:
    """Nanoseconds that a supernode of k columns with m rows below takes."""
    numbers, products = (k + m) * k + m * m, k * k * k / 3 + k * k * m + k * m * m
    return _PER_SUPERNODE + _PER_NUMBER * numbers + _PER_PRODUCT * products


def _largest_stack(children: np.ndarray, sizes: np.ndarray) -> int:
    """Most that is stacked at once: every supernode's update, on top of those of its children."""
    top, most = 0, 0
    stacked: list[int] = []
    for count, size in zip(children.tolist(), sizes.tolist()):
        most = max(most, top + size)
        for _ in range(count):
            top -= stacked.pop()
        stacked.append(size)
        top += size
    return most


def _starts(counts: np.ndarray) -> np.ndarray:
    """Places of parts after each other, (len + 1,), from how many numbers each has."""
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
