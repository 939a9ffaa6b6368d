"""Many sparse right-hand sides solved together with one sparse L D L^T: what sensitivities spend their time on.

Columns of L with the same pattern (a body's six unknowns) are taken as one panel, so that a row of the work block that
is loaded once serves six columns; right-hand sides go through in blocks that stay in the second-level cache; and the
forward pass leaves out panels that no right-hand side of a block has reached (Gilbert and Peierls 1988).
"""
from __future__ import annotations

import numba as nb
import numpy as np
import scipy.sparse as sp

_PANEL = 6  # most columns of a panel; the inner loops below are written out for it
_BLOCK = 72  # right-hand sides of a block


@nb.njit(cache=True)
def panels_of(indptr: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """First columns (n_panels + 1,) of the panels of L: runs of columns with one pattern below them."""
    n = len(indptr) - 1
    starts = np.empty(n + 1, np.int64)
    count, width = 0, _PANEL
    for j in range(n):
        # a column's first entry is its parent; one entry less there means that nothing else differs
        one_less = indptr[j + 1] - indptr[j] == indptr[j] - indptr[j - 1] - 1
        if width == _PANEL or not one_less or indices[indptr[j - 1]] != j:
            starts[count] = j
            count, width = count + 1, 0
        width += 1
    starts[count] = n
    return starts[: count + 1].copy()


def solve_columns(
    L: sp.csc_matrix, pivots: np.ndarray, order: np.ndarray, panels: np.ndarray, rhs: sp.csc_matrix,
    constraint: np.ndarray | None = None, column: np.ndarray | None = None,
) -> np.ndarray:
    """A^-1 rhs (n, k) with A = P L D L^T P^T and rhs sparse (n, k); with a constraint c (n,) and `column` = A^-1 c,
    the solutions d of A d + c t = rhs, c.d = 0.

    Every t comes from the solution that it corrects: where A is nearly singular, what rounding leaves of its softest
    mode in a solution is then taken out of it again.
    """
    n, k = rhs.shape
    place = np.empty(n, np.int64)
    place[order] = np.arange(n)
    out = np.empty((n, k))
    if constraint is None:
        constrained, shares, column = np.empty(0, np.int64), np.empty(0), np.zeros(n)
    else:
        constrained = np.flatnonzero(constraint)
        shares = constraint[constrained] / (constraint @ column)
    _solve_blocks(panels, L.indptr, L.indices, L.data, 1 / pivots, place, rhs.indptr, rhs.indices, rhs.data,
                  constrained, shares, column, out)
    return out


@nb.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _solve_blocks(panels, indptr, indices, data, inverse, place, rhs_ptr, rhs_rows, rhs_values, constrained, shares,
                  column, out):
    """Blocks of right-hand sides, one after the other: scatter, forward, backward, gather."""
    n, total = out.shape
    work, panel, multiplier = np.empty((n, _BLOCK)), np.empty(_PANEL * _BLOCK), np.empty(_BLOCK)
    reached = np.empty(len(panels), np.bool_)
    panel_of = np.empty(n, np.int64)
    for s in range(len(panels) - 1):
        panel_of[panels[s]: panels[s + 1]] = s
    for first in range(0, total, _BLOCK):
        k = min(_BLOCK, total - first)
        work[:] = 0.0
        reached[:] = False
        for c in range(k):
            for t in range(rhs_ptr[first + c], rhs_ptr[first + c + 1]):
                i = place[rhs_rows[t]]
                work[i, c] += rhs_values[t]
                reached[panel_of[i]] = True
        for s in range(len(panels) - 1):
            if reached[s]:
                _forward(panels[s], panels[s + 1], indptr, indices, data, panel_of, work, panel, reached)
        for s in range(len(panels) - 2, -1, -1):
            _backward(panels[s], panels[s + 1], indptr, indices, data, inverse, work, panel)
        multiplier[:] = 0.0
        for t in range(len(constrained)):
            row, share = work[place[constrained[t]]], shares[t]
            for c in range(k):
                multiplier[c] += share * row[c]
        for i in range(n):
            row, target, factor = work[place[i]], out[i], column[i]
            for c in range(k):
                target[first + c] = row[c] - factor * multiplier[c]


@nb.njit(cache=True, error_model="numpy", fastmath={"contract"}, inline="always")
def _offsets(first, end, indptr):
    """Where each of the panel's columns has its first entry below the panel; absent columns repeat the last one."""
    last, w = end - 1, end - first
    return (indptr[first] + w - 1, indptr[min(first + 1, last)] + max(w - 2, 0),
            indptr[min(first + 2, last)] + max(w - 3, 0), indptr[min(first + 3, last)] + max(w - 4, 0),
            indptr[min(first + 4, last)] + max(w - 5, 0), indptr[min(first + 5, last)])


@nb.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _forward(first, end, indptr, indices, data, panel_of, work, panel, reached):
    """Solve within a panel, then take its columns from all rows below. Absent columns are zero in `panel`."""
    w = end - first
    panel[w * _BLOCK:] = 0.0
    for q in range(w):
        own, row = panel[q * _BLOCK: (q + 1) * _BLOCK], work[first + q]
        for c in range(_BLOCK):
            own[c] = row[c]
        for p in range(q):
            v, other = data[indptr[first + p] + q - p - 1], panel[p * _BLOCK: (p + 1) * _BLOCK]
            for c in range(_BLOCK):
                own[c] -= v * other[c]
        for c in range(_BLOCK):
            row[c] = own[c]
    below = indptr[end - 1]
    a0, a1, a2, a3, a4, a5 = _offsets(first, end, indptr)
    for t in range(indptr[end] - below):
        i = indices[below + t]
        reached[panel_of[i]] = True
        row = work[i]
        v0, v1, v2, v3, v4, v5 = data[a0 + t], data[a1 + t], data[a2 + t], data[a3 + t], data[a4 + t], data[a5 + t]
        for c in range(_BLOCK):
            row[c] -= (v0 * panel[c] + v1 * panel[_BLOCK + c] + v2 * panel[2 * _BLOCK + c]
                       + v3 * panel[3 * _BLOCK + c] + v4 * panel[4 * _BLOCK + c] + v5 * panel[5 * _BLOCK + c])


@nb.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _backward(first, end, indptr, indices, data, inverse, work, panel):
    """Divide a panel by its pivots, take all rows below from it, then solve within it."""
    w = end - first
    for q in range(w):
        own, row, v = panel[q * _BLOCK: (q + 1) * _BLOCK], work[first + q], inverse[first + q]
        for c in range(_BLOCK):
            own[c] = v * row[c]
    below = indptr[end - 1]
    a0, a1, a2, a3, a4, a5 = _offsets(first, end, indptr)
    m = indptr[end] - below
    for t in range(0, m - m % 4, 4):
        # four rows at once, since storing the panel is what takes longest
        w0, w1 = work[indices[below + t]], work[indices[below + t + 1]]
        w2, w3 = work[indices[below + t + 2]], work[indices[below + t + 3]]
        v00, v01, v02, v03 = data[a0 + t], data[a0 + t + 1], data[a0 + t + 2], data[a0 + t + 3]
        v10, v11, v12, v13 = data[a1 + t], data[a1 + t + 1], data[a1 + t + 2], data[a1 + t + 3]
        v20, v21, v22, v23 = data[a2 + t], data[a2 + t + 1], data[a2 + t + 2], data[a2 + t + 3]
        v30, v31, v32, v33 = data[a3 + t], data[a3 + t + 1], data[a3 + t + 2], data[a3 + t + 3]
        v40, v41, v42, v43 = data[a4 + t], data[a4 + t + 1], data[a4 + t + 2], data[a4 + t + 3]
        v50, v51, v52, v53 = data[a5 + t], data[a5 + t + 1], data[a5 + t + 2], data[a5 + t + 3]
        for c in range(_BLOCK):
            r0, r1, r2, r3 = w0[c], w1[c], w2[c], w3[c]
            panel[c] -= v00 * r0 + v01 * r1 + v02 * r2 + v03 * r3
            panel[_BLOCK + c] -= v10 * r0 + v11 * r1 + v12 * r2 + v13 * r3
            panel[2 * _BLOCK + c] -= v20 * r0 + v21 * r1 + v22 * r2 + v23 * r3
            panel[3 * _BLOCK + c] -= v30 * r0 + v31 * r1 + v32 * r2 + v33 * r3
            panel[4 * _BLOCK + c] -= v40 * r0 + v41 * r1 + v42 * r2 + v43 * r3
            panel[5 * _BLOCK + c] -= v50 * r0 + v51 * r1 + v52 * r2 + v53 * r3
    for t in range(m - m % 4, m):
        row = work[indices[below + t]]
        v0, v1, v2, v3, v4, v5 = data[a0 + t], data[a1 + t], data[a2 + t], data[a3 + t], data[a4 + t], data[a5 + t]
        for c in range(_BLOCK):
            panel[c] -= v0 * row[c]
            panel[_BLOCK + c] -= v1 * row[c]
            panel[2 * _BLOCK + c] -= v2 * row[c]
            panel[3 * _BLOCK + c] -= v3 * row[c]
            panel[4 * _BLOCK + c] -= v4 * row[c]
            panel[5 * _BLOCK + c] -= v5 * row[c]
    for q in range(w - 1, -1, -1):
        own, row = panel[q * _BLOCK: (q + 1) * _BLOCK], work[first + q]
        for p in range(q + 1, w):
            v, other = data[indptr[first + q] + p - q - 1], panel[p * _BLOCK: (p + 1) * _BLOCK]
            for c in range(_BLOCK):
                own[c] -= v * other[c]
        for c in range(_BLOCK):
            row[c] = own[c]
