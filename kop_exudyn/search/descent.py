"""Coordinate descent over the elements of one group: each gets the part, in the variant, by which a
quadratic model gains most, until none gains."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..compiled.library import address, library
from .sliding import Counting


@dataclass
class Descent:
    """The elements of one group under a design's model, and the parts that they may get. What is
    sought, q, slope and choice, is brought up to date by the methods; each returns how many
    elements changed.

    q, slope, hessian : (n_q,), (n_q,), (n_q, n_q) the design's parameters, and its model there
    indices : (e, k) of the elements in q
    candidates : (m n_ways, k) what an element may be, those of one part after each other
    choice : (e,) which of them each is
    least : gain that counts; without one, two elements might swap forever
    n_ways : candidates of one part
    """

    q: np.ndarray
    slope: np.ndarray
    hessian: np.ndarray
    indices: np.ndarray
    candidates: np.ndarray
    choice: np.ndarray
    least: float
    n_ways: int

    def descend(self, left: np.ndarray) -> int:
        """Until none gains.

        left : (m,) int64, pieces of each part that may still be taken; brought up to date
        """
        kernels = library()
        if kernels is None:
            return self._descend_numpy(left)
        hessian = np.ascontiguousarray(self.hessian)
        indices = np.ascontiguousarray(self.indices, np.int64)
        candidates = np.ascontiguousarray(self.candidates, float)
        elements, k, n = *indices.shape, len(self.q)
        if indices.size and not (indices.min() >= 0 and indices.max() < n):
            raise ValueError(f"elements name parameters that don't exist (there are {n})")
        return kernels.descend(
            elements,
            k,
            len(candidates),
            n,
            address(self.q),
            address(self.slope, np.float64, (n,)),
            address(hessian, np.float64, (n, n)),
            address(indices, np.int64),
            address(candidates, np.float64, (len(candidates), k)),
            address(self.choice, np.int64, (elements,)),
            self.least,
            self.n_ways,
            address(left, np.int64),
        )

    def descend_counted(self, counting: Counting, cost: float) -> int:
        """Until none gains, without a stock, where each piece that has to be made costs; the count
        of pieces is brought up to date as well."""

        def prices(mine: int) -> np.ndarray:
            return cost * counting.changes(mine)

        return self._descend_priced(prices, counting.move)

    def exchange(self) -> int:
        """Let elements exchange their parts (in any variants) with the partner by which most is
        gained, each once."""
        q, slope, hessian = self.q, self.slope, self.hessian
        choice, n_ways = self.choice, self.n_ways
        changed = 0
        ways = np.arange(n_ways)
        for e, own in enumerate(self.indices):
            mine, theirs = choice[e] // n_ways, choice // n_ways
            others = np.flatnonzero(theirs != mine)
            if not len(others):
                continue
            at = self.indices[others]
            # what the element would be by each partner's part, and each partner by the element's
            d = self.candidates[theirs[others, None] * n_ways + ways] - q[own]
            d_other = self.candidates[mine * n_ways + ways][None] - q[at][:, None]
            block = hessian[np.ix_(own, own)]
            alone = d @ slope[own] + 0.5 * np.einsum("ova,ab,ovb->ov", d, block, d)
            blocks = hessian[at[:, :, None], at[:, None, :]]
            partner = np.einsum("ova,oa->ov", d_other, slope[at])
            partner += 0.5 * np.einsum("ova,oab,ovb->ov", d_other, blocks, d_other)
            coupling = np.einsum("ova,aob,owb->ovw", d, hessian[own][:, at], d_other)
            gains = alone[:, :, None] + partner[:, None, :] + coupling
            best = int(gains.argmin())
            if gains.flat[best] >= -self.least:
                continue
            o, v, w = np.unravel_index(best, gains.shape)
            f = int(others[o])
            for index, step in ((own, d[o, v]), (self.indices[f], d_other[o, w])):
                slope += step @ hessian[index]
                q[index] += step
            choice[e], choice[f] = choice[f] // n_ways * n_ways + v, mine * n_ways + w
            for number in (e, f):  # exactly, not but for rounding
                q[self.indices[number]] = self.candidates[choice[number]]
            changed += 1
        return changed

    def _descend_numpy(self, left: np.ndarray) -> int:
        """`descend` where there are no compiled kernels."""

        def prices(mine: int) -> np.ndarray:
            return np.where((left <= 0) & (np.arange(len(left)) != mine), np.inf, 0.0)

        def moved(mine: int, other: int) -> None:
            left[mine] += 1
            left[other] -= 1

        return self._descend_priced(prices, moved)

    def _descend_priced(
        self, prices: Callable[[int], np.ndarray], moved: Callable[[int, int], None]
    ) -> int:
        """Until none gains.

        prices : an element's part -> (m,) what each part costs besides, infinite where there is
            none
        moved : is told every change, from which part to which
        """
        total, changed, n_ways = 0, 1, self.n_ways
        while changed:
            changed = 0
            for e, own in enumerate(self.indices):
                mine = int(self.choice[e]) // n_ways
                d = self.candidates - self.q[own]
                block = self.hessian[np.ix_(own, own)]
                gains = d @ self.slope[own] + 0.5 * np.einsum("ci,ij,cj->c", d, block, d)
                gains += np.repeat(prices(mine), n_ways)
                which = int(np.argmin(gains))
                if gains[which] < -self.least and which != self.choice[e]:
                    self.slope += d[which] @ self.hessian[own]
                    self.q[own] = self.candidates[which]
                    moved(mine, which // n_ways)
                    self.choice[e] = which
                    changed += 1
            total += changed
        return total
