"""The pricing problem of clustering: which part earns most, when every element pays its price?

A part earns sum_j w_j max(0, price_j - d_j^2), less its own penalty; d_j is the distance of
element j in the part's best variant. The earnings have many local maxima; their global maximum is
bounded by branch and bound over boxes of part parameters. Over a box, elements that the part
serves at a profit everywhere and in one variant are taken together: they earn a concave quadratic
with a known maximum; every other element is taken at its own nearest point of the box.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .elements import KindElements
from .kinds import Variants
from .paying import PayingElements

_GOOD = 0.9  # of the largest earnings known: centres of boxes that are worth a cut


@dataclass(frozen=True)
class Pricing:
    """Elements of one kind as the pricing problem sees them; parts are in units of the scale.

    blocks : elements, like ones merged
    displacement : root of the summed squared distances of the elements to what they were merged
        into; the root of a clustering's sum of squares changes by no more than that
    lower, upper : (k_p,) between which optimal parts lie
    penalty : (k_p,) of one part, on its squared parameters
    """

    blocks: tuple[PayingElements, ...]
    displacement: float
    lower: np.ndarray
    upper: np.ndarray
    penalty: np.ndarray
    exact: bool

    @classmethod
    def of(
        cls, elements: KindElements, m: int, limits: tuple[np.ndarray, np.ndarray], most: int = 1500
    ) -> Pricing:
        """For m parts of the elements, with the bounds (k_p,) of parts in the elements' units.

        most : rows at most; elements that differ a little are merged until there are no more
        """
        grain = 1e-9
        while True:
            blocks, moved = [], 0.0
            for block in elements.blocks:
                values, inverse = _merged(block.variants, block.values / elements.scale, grain)
                weights = np.bincount(inverse).astype(float)
                merged = np.stack(
                    [np.bincount(inverse, column) / weights for column in values.T], axis=1
                )
                moved += float(np.sum((values - merged[inverse]) ** 2))
                reach = block.variants.reach
                V = np.ascontiguousarray(block.variants.matrices)
                W = np.zeros_like(V) if reach is None else np.ascontiguousarray(reach)
                blocks.append(PayingElements(block.variants, merged, weights, V, W))
            if sum(len(block.values) for block in blocks) <= most:
                break
            grain = max(4 * grain, 1e-4)
        lower, upper = _hull(blocks, limits[0] / elements.scale, limits[1] / elements.scale)
        penalty = elements.penalty * elements.n / m
        return cls(tuple(blocks), np.sqrt(moved), lower, upper, penalty, elements.exact)

    @property
    def weights(self) -> np.ndarray:
        """(n,) elements that each row stands for."""
        return np.concatenate([block.weights for block in self.blocks])

    def squared(self, parts: np.ndarray) -> np.ndarray:
        """(n, N) squared distance of the rows to each of the parts (N, k_p)."""
        found = [block.variants.residuals(block.values, parts) for block in self.blocks]
        return np.concatenate([np.sum(r**2, axis=3).min(axis=2) for r in found])

    def own_cost(self, parts: np.ndarray) -> np.ndarray:
        """(N,) penalties of the parts (N, k_p)."""
        return parts**2 @ self.penalty

    def earnings(self, prices: np.ndarray, parts: np.ndarray) -> np.ndarray:
        """(N,) of the parts (N, k_p), when the rows pay the prices (n,)."""
        earned = -self.own_cost(parts)
        for block, own in zip(self.blocks, self._split(prices)):
            block.add_served(parts, own, self.exact, earned)
        return earned

    def improved(
        self, prices: np.ndarray, parts: np.ndarray, steps: int = 20
    ) -> tuple[np.ndarray, np.ndarray]:
        """Parts (N, k_p) moved to what suits the elements that they serve at a profit, while that
        earns more; and what they earn (N,)."""
        parts, earned = parts.copy(), self.earnings(prices, parts)
        going = np.arange(len(parts))
        for _ in range(steps):
            if not len(going):
                break
            here = parts[going]
            normal, right, _ = self._served(prices, here)
            slope = right - np.einsum("mkl,ml->mk", normal, here)
            step = np.einsum("mkl,ml->mk", np.linalg.pinv(normal, hermitian=True), slope)
            moved = np.clip(here + step, self.lower, self.upper)
            now = self.earnings(prices, moved)
            up = now > earned[going] + 1e-12 * np.abs(earned[going])
            going = going[up]
            parts[going], earned[going] = moved[up], now[up]
        return parts, earned

    def most_earned(
        self, prices: np.ndarray, known: float, tolerance: float, most: int = 100_000
    ) -> tuple[float, np.ndarray]:
        """A proven upper bound on what any part earns at these prices, and good parts (N, k_p).

        known : what some part earns; tolerance : relative, of the bound; most : boxes looked at,
        after which the bound is what has been proven until then
        """
        low, high = self.lower[None].copy(), self.upper[None].copy()
        proven, looked, good = known, 0, [np.empty((0, len(self.lower)))]
        while len(low):
            bounds = self._most_in_boxes(prices, low, high)
            looked += len(low)
            if looked > most:
                return max(proven, known, float(bounds.max())), np.concatenate(good)
            # only what may earn more is looked at closely
            for _ in range(2):
                closed = bounds <= known + tolerance * abs(known)
                proven = max(proven, float(bounds[closed].max(initial=-np.inf)))
                low, high, bounds = low[~closed], high[~closed], bounds[~closed]
                if not len(low):
                    break
                centres = 0.5 * (low + high)
                earned = self.earnings(prices, centres)
                known = max(known, float(earned.max()))
            else:
                good.append(centres[earned > _GOOD * known])
                low, high = _halved(low, high)
        return max(proven, known), np.concatenate(good)

    def _served(
        self, prices: np.ndarray, parts: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Normal equations (N, k_p, k_p), (N, k_p) of the rows that each part serves at a profit,
        and its earnings (N,)."""
        normal = np.tile(np.diag(self.penalty), (len(parts), 1, 1))
        right, earned = np.zeros(parts.shape), -self.own_cost(parts)
        for block, own in zip(self.blocks, self._split(prices)):
            block.add_served(parts, own, self.exact, earned, normal, right)
        return normal, right, earned

    def _most_in_boxes(self, prices: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """(N,) upper bounds on the earnings of the parts between low and high (N, k_p)."""
        alone = np.zeros(len(low))
        curvature, slope = np.zeros(low.shape) + self.penalty, np.zeros(low.shape)
        for block, own in zip(self.blocks, self._split(prices)):
            block.add_in_boxes(low, high, own, self.exact, alone, curvature, slope)
        used = curvature > 0
        best = np.clip(np.where(used, slope / np.where(used, curvature, 1.0), low), low, high)
        return alone + np.sum((2 * slope - curvature * best) * best, axis=1)

    def _split(self, prices: np.ndarray) -> list[np.ndarray]:
        return np.split(prices, np.cumsum([len(block.values) for block in self.blocks])[:-1])


def _merged(variants: Variants, values: np.ndarray, grain: float) -> tuple[np.ndarray, np.ndarray]:
    """The elements, each as the one of its like in other variants that comes first, and the row
    (n,) of merged ones that each belongs to."""
    turns = _symmetries(variants)
    if len(turns) > 1:
        orbit = np.stack([values @ turn.T for turn in turns], axis=1)
        rank = np.lexsort(np.round(orbit / grain).transpose(2, 0, 1)[::-1], axis=1)
        values = orbit[np.arange(len(values)), rank[:, -1]]
    keys = np.unique(np.round(values / grain), axis=0, return_inverse=True)[1]
    return values, keys.ravel()


def _symmetries(variants: Variants) -> list[np.ndarray]:
    """(k_e, k_e) maps of elements that every part realises equally well: from variant to variant,
    where these are a group; otherwise none."""
    V = variants.matrices
    if variants.reach is not None or V.shape[1] != V.shape[2]:
        return []
    turns = [a @ V[0].T for a in V]  # entries are 0 and +-1, one a row: V^-1 = V^T
    closed = all(any(np.array_equal(t @ a, b) for b in V) for t in turns for a in V)
    return turns if closed else []


def _hull(
    blocks: list[PayingElements], lower: np.ndarray, upper: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Between which parameters of optimal parts lie: averages of what they realise, or reaches no
    longer than these differ."""
    k = len(lower)
    low, high = np.full(k, np.inf), np.full(k, -np.inf)
    for block in blocks:
        for matrix in block.V:
            for row, column in np.argwhere(matrix):
                seen = matrix[row, column] * block.values[:, row]
                low[column] = min(low[column], seen.min())
                high[column] = max(high[column], seen.max())
    unseen = ~np.isfinite(low)
    low[unseen], high[unseen] = 0.0, (high[~unseen] - low[~unseen]).max(initial=0.0)
    return np.clip(low, lower, upper), np.clip(high, lower, upper)


def _halved(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Boxes halved across their longest edges."""
    rows = np.arange(len(low))
    edge = (high - low).argmax(axis=1)
    middle = 0.5 * (low[rows, edge] + high[rows, edge])
    left, right = high.copy(), low.copy()
    left[rows, edge] = right[rows, edge] = middle
    return np.concatenate([low, right]), np.concatenate([left, high])
