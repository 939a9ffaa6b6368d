"""Many sparse right-hand sides solved together with one sparse L D L^T: what sensitivities spend
their time on.

Columns of L with the same pattern (a body's six unknowns) are taken as one panel, so that a row of
the work block that is loaded once serves six columns; what is left over, hinge angles mostly, goes
column by column. Right-hand sides go through in blocks that stay in the second-level cache, and the
forward pass leaves out panels that no right-hand side of a block has reached (Gilbert and Peierls
1988).
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np
import scipy.sparse as sp

_PANEL = 6  # most columns of a panel; the inner loops below are written out for it
_BLOCK = 88  # right-hand sides of a block


@nb.njit(cache=True)
def panels_of(indptr: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """First columns (n_panels + 1,) of the panels of L: runs of columns with one pattern below
    them."""
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


@dataclass(frozen=True)
class Solutions:
    """Solutions (n, count) as the solver leaves them: to copy them into one array would take a
    quarter of its time.

    blocks : (n_blocks, n, _BLOCK) some columns a block, rows in the order of the elimination
    place : (n,) where each row is in a block
    count : number of solutions; what the last block has beyond them is zero
    """

    blocks: np.ndarray
    place: np.ndarray
    count: int

    def rows(self, numbers: np.ndarray) -> np.ndarray:
        """Some rows (m, count) of the solutions."""
        out = np.empty((len(numbers), self.count))
        _gather(self.blocks, self.place[numbers], out)
        return out

    def product(self, matrix: sp.csr_matrix) -> np.ndarray:
        """A sparse matrix (m, n) times the solutions, (m, count)."""
        out = np.zeros((matrix.shape[0], self.count))
        _multiply(matrix.indptr, self.place[matrix.indices], matrix.data, self.blocks, out)
        return out


def solve_columns(
    L: sp.csc_matrix,
    pivots: np.ndarray,
    order: np.ndarray,
    panels: np.ndarray,
    rhs: sp.csc_matrix,
    constraint: np.ndarray | None = None,
    column: np.ndarray | None = None,
) -> Solutions:
    """A^-1 rhs with A = P L D L^T P^T and rhs sparse (n, k); with a constraint c (n,) and `column`
    = A^-1 c (n,), the solutions d of A d + c t = rhs, c.d = 0.

    Every t comes from the solution that it corrects: where A is nearly singular, what rounding
    leaves of its softest mode in a solution is then taken out of it again.
    """
    n, k = rhs.shape
    place = np.empty(n, np.int64)
    place[order] = np.arange(n)
    blocks = np.empty((-(-k // _BLOCK), n, _BLOCK))
    if constraint is None or column is None:
        constrained, shares, column = np.empty(0, np.int64), np.empty(0), np.empty(0)
    else:
        constrained = np.flatnonzero(constraint)
        shares = constraint[constrained] / (constraint @ column)
    _solve_blocks(
        panels,
        L.indptr,
        L.indices,
        L.data,
        1 / pivots,
        place,
        rhs.indptr,
        rhs.indices,
        rhs.data,
        constrained,
        shares,
        column,
        blocks,
    )
    return Solutions(blocks, place, k)


@nb.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _solve_blocks(
    panels,
    indptr,
    indices,
    data,
    inverse,
    place,
    rhs_ptr,
    rhs_rows,
    rhs_values,
    constrained,
    shares,
    column,
    blocks,
):
    """Blocks of right-hand sides, one after the other: scatter, forward, backward, and what the
    constraint asks for."""
    n, total = len(place), len(rhs_ptr) - 1
    panel, multiplier = np.empty(_PANEL * _BLOCK), np.empty(_BLOCK)
    reached = np.empty(len(panels), np.bool_)
    panel_of = np.empty(n, np.int64)
    for s in range(len(panels) - 1):
        panel_of[panels[s] : panels[s + 1]] = s
    for b in range(len(blocks)):
        work, first = blocks[b], b * _BLOCK
        work[:] = 0.0
        reached[:] = False
        for c in range(min(_BLOCK, total - first)):
            for t in range(rhs_ptr[first + c], rhs_ptr[first + c + 1]):
                i = place[rhs_rows[t]]
                work[i, c] += rhs_values[t]
                reached[panel_of[i]] = True
        for s in range(len(panels) - 1):
            if reached[s]:
                if panels[s + 1] - panels[s] == _PANEL:
                    _forward_panel(panels[s], indptr, indices, data, work, panel)
                else:
                    _forward_columns(panels[s], panels[s + 1], indptr, indices, data, work)
                for t in range(indptr[panels[s + 1] - 1], indptr[panels[s + 1]]):
                    reached[panel_of[indices[t]]] = True
        for s in range(len(panels) - 2, -1, -1):
            if panels[s + 1] - panels[s] == _PANEL:
                _backward_panel(panels[s], indptr, indices, data, inverse, work, panel)
            else:
                _backward_columns(panels[s], panels[s + 1], indptr, indices, data, inverse, work)
        if len(constrained) == 0:
            continue
        multiplier[:] = 0.0
        for t in range(len(constrained)):
            row, share = work[place[constrained[t]]], shares[t]
            for c in range(_BLOCK):
                multiplier[c] += share * row[c]
        for i in range(n):
            row, factor = work[place[i]], column[i]
            for c in range(_BLOCK):
                row[c] -= factor * multiplier[c]


@nb.njit(cache=True, error_model="numpy")
def _multiply(indptr, places, data, blocks, out):
    """out (m, k) += a sparse matrix (m, n), its columns as places in the blocks, times the
    solutions."""
    for b in range(len(blocks)):
        first = b * _BLOCK
        k = min(_BLOCK, out.shape[1] - first)
        for i in range(len(indptr) - 1):
            target = out[i]
            for t in range(indptr[i], indptr[i + 1]):
                row, v = blocks[b, places[t]], data[t]
                for c in range(k):
                    target[first + c] += v * row[c]


@nb.njit(cache=True, error_model="numpy")
def _gather(blocks, places, out):
    """out (m, k) = the rows at some places of the blocks."""
    for b in range(len(blocks)):
        first = b * _BLOCK
        k = min(_BLOCK, out.shape[1] - first)
        for i in range(len(places)):
            row, target = blocks[b, places[i]], out[i]
            for c in range(k):
                target[first + c] = row[c]


@nb.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _forward_columns(first, end, indptr, indices, data, work):
    """Take what each solved row contributes from all rows below, one column of L after the
    other."""
    for q in range(first, end):
        own = work[q]
        for t in range(indptr[q], indptr[q + 1]):
            row, v = work[indices[t]], data[t]
            for c in range(_BLOCK):
                row[c] -= v * own[c]


@nb.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _backward_columns(first, end, indptr, indices, data, inverse, work):
    """Divide rows by their pivots and take what the solved rows below contribute, one column of L
    after the other."""
    for q in range(end - 1, first - 1, -1):
        own, pivot = work[q], inverse[q]
        for c in range(_BLOCK):
            own[c] *= pivot
        for t in range(indptr[q], indptr[q + 1]):
            row, v = work[indices[t]], data[t]
            for c in range(_BLOCK):
                own[c] -= v * row[c]


@nb.njit(cache=True, error_model="numpy", inline="always")
def _within(first, indptr, data):
    """L's entries within a panel, column by column."""
    a, b, c, d, e = (
        indptr[first],
        indptr[first + 1],
        indptr[first + 2],
        indptr[first + 3],
        indptr[first + 4],
    )
    return (
        data[a],
        data[a + 1],
        data[a + 2],
        data[a + 3],
        data[a + 4],
        data[b],
        data[b + 1],
        data[b + 2],
        data[b + 3],
        data[c],
        data[c + 1],
        data[c + 2],
        data[d],
        data[d + 1],
        data[e],
    )


@nb.njit(cache=True, error_model="numpy", inline="always")
def _below(first, indptr):
    """Where each of the panel's columns has its first entry below the panel."""
    return (
        indptr[first] + 5,
        indptr[first + 1] + 4,
        indptr[first + 2] + 3,
        indptr[first + 3] + 2,
        indptr[first + 4] + 1,
        indptr[first + 5],
    )


@nb.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _forward_panel(first, indptr, indices, data, work, panel):
    """Solve within a panel, then take its six columns from all rows below."""
    for q in range(_PANEL):
        row, own = work[first + q], panel[q * _BLOCK : (q + 1) * _BLOCK]
        for c in range(_BLOCK):
            own[c] = row[c]
    l10, l20, l30, l40, l50, l21, l31, l41, l51, l32, l42, l52, l43, l53, l54 = _within(
        first, indptr, data
    )
    for c in range(_BLOCK):
        x0 = panel[c]
        x1 = panel[_BLOCK + c] - l10 * x0
        x2 = panel[2 * _BLOCK + c] - l20 * x0 - l21 * x1
        x3 = panel[3 * _BLOCK + c] - l30 * x0 - l31 * x1 - l32 * x2
        x4 = panel[4 * _BLOCK + c] - l40 * x0 - l41 * x1 - l42 * x2 - l43 * x3
        x5 = panel[5 * _BLOCK + c] - l50 * x0 - l51 * x1 - l52 * x2 - l53 * x3 - l54 * x4
        panel[_BLOCK + c], panel[2 * _BLOCK + c], panel[3 * _BLOCK + c] = x1, x2, x3
        panel[4 * _BLOCK + c], panel[5 * _BLOCK + c] = x4, x5
    for q in range(1, _PANEL):
        row, own = work[first + q], panel[q * _BLOCK : (q + 1) * _BLOCK]
        for c in range(_BLOCK):
            row[c] = own[c]
    a0, a1, a2, a3, a4, a5 = _below(first, indptr)
    for t in range(indptr[first + _PANEL] - a5):
        row = work[indices[a5 + t]]
        v0, v1, v2, v3, v4, v5 = (
            data[a0 + t],
            data[a1 + t],
            data[a2 + t],
            data[a3 + t],
            data[a4 + t],
            data[a5 + t],
        )
        for c in range(_BLOCK):
            row[c] -= (
                v0 * panel[c]
                + v1 * panel[_BLOCK + c]
                + v2 * panel[2 * _BLOCK + c]
                + v3 * panel[3 * _BLOCK + c]
                + v4 * panel[4 * _BLOCK + c]
                + v5 * panel[5 * _BLOCK + c]
            )


@nb.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _backward_panel(first, indptr, indices, data, inverse, work, panel):
    """Divide a panel by its pivots, take all rows below from it, then solve within it."""
    for q in range(_PANEL):
        row, own, pivot = work[first + q], panel[q * _BLOCK : (q + 1) * _BLOCK], inverse[first + q]
        for c in range(_BLOCK):
            own[c] = pivot * row[c]
    a0, a1, a2, a3, a4, a5 = _below(first, indptr)
    m = indptr[first + _PANEL] - a5
    for t in range(0, m - m % 4, 4):
        # four rows at once, since storing the panel is what takes longest
        w0, w1 = work[indices[a5 + t]], work[indices[a5 + t + 1]]
        w2, w3 = work[indices[a5 + t + 2]], work[indices[a5 + t + 3]]
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
        row = work[indices[a5 + t]]
        v0, v1, v2, v3, v4, v5 = (
            data[a0 + t],
            data[a1 + t],
            data[a2 + t],
            data[a3 + t],
            data[a4 + t],
            data[a5 + t],
        )
        for c in range(_BLOCK):
            r = row[c]
            panel[c] -= v0 * r
            panel[_BLOCK + c] -= v1 * r
            panel[2 * _BLOCK + c] -= v2 * r
            panel[3 * _BLOCK + c] -= v3 * r
            panel[4 * _BLOCK + c] -= v4 * r
            panel[5 * _BLOCK + c] -= v5 * r
    l10, l20, l30, l40, l50, l21, l31, l41, l51, l32, l42, l52, l43, l53, l54 = _within(
        first, indptr, data
    )
    for c in range(_BLOCK):
        x5 = panel[5 * _BLOCK + c]
        x4 = panel[4 * _BLOCK + c] - l54 * x5
        x3 = panel[3 * _BLOCK + c] - l43 * x4 - l53 * x5
        x2 = panel[2 * _BLOCK + c] - l32 * x3 - l42 * x4 - l52 * x5
        x1 = panel[_BLOCK + c] - l21 * x2 - l31 * x3 - l41 * x4 - l51 * x5
        x0 = panel[c] - l10 * x1 - l20 * x2 - l30 * x3 - l40 * x4 - l50 * x5
        panel[c], panel[_BLOCK + c], panel[2 * _BLOCK + c] = x0, x1, x2
        panel[3 * _BLOCK + c], panel[4 * _BLOCK + c] = x3, x4
    for q in range(_PANEL):
        row, own = work[first + q], panel[q * _BLOCK : (q + 1) * _BLOCK]
        for c in range(_BLOCK):
            row[c] = own[c]
