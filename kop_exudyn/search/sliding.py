"""Elements that slide in their parts: kept within what these realise, and moved there.

A part p in variant v realises every element q with V p <= q <= (V + W) p (see kit/kinds.py). While
the assignment is fixed these are linear rows over parts and elements, like the parts' own limits.
Under a quadratic model an element's best place in such a box is found by trying all sets of
coordinates that may lie at an end: for one or two coordinates that is quicker than any solver.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import scipy.sparse as sp

from ..kit.kinds import Bounds, Variants, part_kind
from ..kit.parts import Assignment, Kit
from ..kit.reuse import PieceCount
from ..sqp.constraints import LinearConstraints

_FLAT = 1e-12  # of the curvature: below, a coordinate has no minimum of its own
_SWEEPS = 20  # over elements, before the parts are moved


def limit_rows(
    assignment: Assignment,
    kit: Kit,
    sliding: np.ndarray,
    n: int,
    parts_move: bool,
    bounds: Bounds | None = None,
) -> LinearConstraints:
    """The rows that keep elements within their parts, and parts within their limits.

    sliding : (k,) places of the elements in q; they are the last k of the n variables, the parts'
        parameters the first
    parts_move : False: the parts' own limits are left out
    bounds : of the parts: where they ask for a shortest side, it is what the longest slit of the
        kit has to leave of it, as that decides how far pieces are sawn off
    """
    k, n_p = len(sliding), len(kit.vector)
    blocks, names = [], []
    own = sp.eye_array(k, format="csr")
    between = sp.csr_array((k, n - n_p - k))
    for upper in (False, True):
        ends = sp.csr_array(assignment.matrix(kit, upper=upper))[sliding]
        sign = -1.0 if upper else 1.0
        blocks.append(sp.hstack([-sign * ends, between, sign * own]))
        names += [f"{'far' if upper else 'near'} end of the slit of parameter {i}" for i in sliding]
    lower = [np.zeros(2 * k)]
    if parts_move:
        for name, parts in kit.parts.items():
            rows, least = _part_rows(name, len(parts), bounds)
            at = kit.offsets[name]
            wide = sp.csr_array((len(rows), n)).tolil()
            wide[:, at : at + rows.shape[1]] = rows
            blocks.append(wide)
            names += [f"limit of {name} parts"] * len(rows)
            lower.append(least)
    matrix = sp.csr_matrix(sp.vstack(blocks))
    at_least = np.concatenate(lower)
    return LinearConstraints(matrix, at_least, np.full(len(at_least), np.inf), tuple(names))


def _part_rows(name: str, m: int, bounds: Bounds | None) -> tuple[np.ndarray, np.ndarray]:
    """(r, m k_p) rows and (r,) what they are at least, of all parts of a kind."""
    kind = part_kind(name)
    k = kind.n_parameters
    rows, least = [np.zeros((0, m * k))], [np.zeros(0)]
    if kind.limits is not None:
        rows.append(np.kron(np.eye(m), -kind.limits))
        least.append(np.zeros(m * len(kind.limits)))
        slit = int(kind.limits[0].argmax())
        lower = kind.bounds(bounds)[0]
        for column in np.flatnonzero((np.arange(k) != slit) & (lower > kind.lower)):
            for a, b in product(range(m), range(m)):
                row = np.zeros((1, m * k))
                row[0, a * k + column] += 1.0
                row[0, b * k + slit] -= 1.0
                rows.append(row)
                least.append(np.array([lower[column]]))
    return np.concatenate(rows), np.concatenate(least)


def stacked(first: LinearConstraints, second: LinearConstraints) -> LinearConstraints:
    """Both sets of rows, on the same variables."""
    return LinearConstraints(
        sp.csr_matrix(sp.vstack([first.A, second.A])),
        np.concatenate([first.lower, second.lower]),
        np.concatenate([first.upper, second.upper]),
        first.names + second.names,
    )


def best_in_boxes(
    low: np.ndarray, high: np.ndarray, slope: np.ndarray, block: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The steps d in [low, high] that minimise g.d + 1/2 d.B d, and what they change it by.

    low, high : (c, k), one box a row; slope : (k,) g; block : (k, k) B, which may be indefinite

    Returns (c, k) and (c,).
    """
    c, k = low.shape
    best, least = low.copy(), np.full(c, np.inf)
    floor = _FLAT * max(float(np.abs(block).max()), np.finfo(float).tiny)
    for pattern in product((0, 1, 2), repeat=k):
        ends = np.array(pattern)
        d = np.where(ends == 1, high, low)
        free = np.flatnonzero(ends == 2)
        if len(free):
            inner = block[np.ix_(free, free)]
            if np.linalg.eigvalsh(inner).min() <= floor:
                continue
            held = np.flatnonzero(ends != 2)
            right = -(slope[free] + d[:, held] @ block[np.ix_(held, free)])
            d[:, free] = np.clip(np.linalg.solve(inner, right.T).T, low[:, free], high[:, free])
        gains = d @ slope + 0.5 * np.einsum("ci,ij,cj->c", d, block, d)
        better = gains < least
        best[better], least[better] = d[better], gains[better]
    return best, least


@dataclass(frozen=True)
class Counting:
    """Where pieces cost: their count, and which kind and design elements are of."""

    count: PieceCount
    kind: str
    design: int

    def changes(self, part: int) -> np.ndarray:
        """(m,) how many pieces more have to be made when an element gets each of the parts instead
        of its own, `part`."""
        return self.count.changes(self.kind, self.design, part)

    def move(self, part: int, other: int) -> None:
        """An element gets another part."""
        self.count.move(self.kind, self.design, part, other)


def descend_in_boxes(
    state: tuple[np.ndarray, np.ndarray, np.ndarray],
    indices: np.ndarray,
    parts: tuple[Variants, np.ndarray],
    choice: np.ndarray,
    prices: tuple[float, float],
    counting: Counting | None = None,
) -> tuple[np.ndarray, np.ndarray, int]:
    """Coordinate descent over one group of elements that slide in their parts: each is given the
    part in which its best place is best, and moved there, until none gets another.

    state : q, slope and hessian of the design, the first two brought up to date
    indices : (n, k_e) of the elements in q;  parts : the variants, and the parts (m, k_p)
    choice : (n,) part times the number of variants, plus the variant
    prices : gain that counts, and what a piece to be made costs
    counting : the pieces where these cost; brought up to date

    Returns parts and variants (n,), and how many changed.
    """
    q, slope, hessian = state
    ways, values = parts
    n_ways = len(ways.names)
    assert ways.reach is not None
    low, high = (
        np.einsum("vek,mk->mve", maps, values).reshape(-1, indices.shape[1])
        for maps in (ways.matrices, ways.matrices + ways.reach)
    )
    least, piece = prices
    total, choice = 0, choice.copy()
    for _ in range(_SWEEPS):
        changed = 0
        for e, own in enumerate(indices):
            steps, gains = best_in_boxes(
                low - q[own], high - q[own], slope[own], hessian[np.ix_(own, own)]
            )
            mine = int(choice[e]) // n_ways
            if counting is not None:
                gains += piece * np.repeat(counting.changes(mine), n_ways)
            which = int(np.argmin(gains))
            if gains[which] >= gains[choice[e]] - least:
                which = int(choice[e])
            if gains[which] < -least or which != choice[e]:
                slope += steps[which] @ hessian[own]
                q[own] += steps[which]
            if which != choice[e]:
                if counting is not None:
                    counting.move(mine, which // n_ways)
                choice[e] = which
                changed += 1
        total += changed
        if not changed:
            break
    return choice // n_ways, choice % n_ways, total
