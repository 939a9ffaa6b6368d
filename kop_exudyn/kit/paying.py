"""Elements that pay prices, in plain arrays: what parts earn with them, compiled or by NumPy."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..compiled.library import address, library
from .kinds import Variants

_MOST = 16  # variants times parameters that the compiled kernels have room for
_AT_ONCE = 2_000_000  # numbers that NumPy works on at a time


@dataclass(frozen=True)
class PayingElements:
    """Elements of equally many parameters, in units of the kind's scale.

    values : (n, k_e)
    weights : (n,) how many like elements each row stands for
    V, W : (n_v, k_e, k_p) the variants' matrices, and their reaches (zeros where there is none)
    """

    variants: Variants
    values: np.ndarray
    weights: np.ndarray
    V: np.ndarray
    W: np.ndarray

    def add_served(
        self,
        parts: np.ndarray,
        prices: np.ndarray,
        exact: bool,
        earned: np.ndarray,
        normal: np.ndarray | None = None,
        right: np.ndarray | None = None,
    ) -> None:
        """Add what each of the parts (N, k_p) earns to earned (N,).

        prices : (n,); exact : whether no variant has a reach
        normal, right : (N, k_p, k_p), (N, k_p), which the normal equations of the elements that are
            served at a profit are added to
        """
        kernels = self._kernels()
        if kernels is None:
            for some in self._slices(len(parts)):
                self._add_served(
                    parts[some],
                    prices,
                    earned[some],
                    None if normal is None else normal[some],
                    None if right is None else right[some],
                )
            return
        parts, prices = np.ascontiguousarray(parts), np.ascontiguousarray(prices)
        kernels.served_by_parts(
            len(parts),
            len(self.values),
            *self.V.shape,
            exact,
            address(parts),
            *self._addresses(prices),
            address(earned),
            None if normal is None else address(normal),
            None if right is None else address(right),
        )

    def add_in_boxes(
        self,
        low: np.ndarray,
        high: np.ndarray,
        prices: np.ndarray,
        exact: bool,
        alone: np.ndarray,
        curvature: np.ndarray,
        slope: np.ndarray,
    ) -> None:
        """Add what parts between low and high (N, k_p) earn at most: with elements taken one by one
        to alone (N,), with those taken together as alone + 2 slope.p - curvature.p^2 to all of
        alone, curvature and slope (N, k_p)."""
        kernels = self._kernels()
        if kernels is None:
            for some in self._slices(len(low)):
                self._add_in_boxes(
                    low[some], high[some], prices, exact, alone[some], curvature[some], slope[some]
                )
            return
        low, high = np.ascontiguousarray(low), np.ascontiguousarray(high)
        prices = np.ascontiguousarray(prices)
        kernels.most_in_boxes(
            len(low),
            len(self.values),
            *self.V.shape,
            exact,
            address(low),
            address(high),
            *self._addresses(prices),
            address(alone),
            address(curvature),
            address(slope),
        )

    def _kernels(self) -> ctypes.CDLL | None:
        """Those that are compiled, where they have room for these elements."""
        return library() if self.V.shape[0] * self.V.shape[1] <= _MOST else None

    def _slices(self, count: int) -> Iterator[slice]:
        """Of so many parts or boxes, those that NumPy works on at a time."""
        step = max(1, _AT_ONCE // (len(self.values) * self.V.size))
        return (slice(k, k + step) for k in range(0, count, step))

    def _addresses(self, prices: np.ndarray) -> list[int]:
        return [address(a) for a in (self.values, self.V, self.W, self.weights, prices)]

    def _add_served(
        self,
        parts: np.ndarray,
        prices: np.ndarray,
        earned: np.ndarray,
        normal: np.ndarray | None,
        right: np.ndarray | None,
    ) -> None:
        squared = np.sum(self.variants.residuals(self.values, parts) ** 2, axis=3)
        which, least = squared.argmin(axis=2), squared.min(axis=2)
        pays = self.weights[:, None] * (least < prices[:, None])
        earned += np.sum(pays * (prices[:, None] - least), axis=0)
        if normal is None or right is None:
            return
        for k, part in enumerate(parts):
            served = np.flatnonzero(pays[:, k])
            values, weights = self.values[served], pays[served, k]
            rows, active = self.variants.contact(
                values, which[served, k], np.broadcast_to(part, (len(served), len(part)))
            )
            rows = rows * active[:, :, None]
            normal[k] += np.einsum("n,nek,nel->kl", weights, rows, rows)
            right[k] += np.einsum("n,nek,ne->k", weights, rows, values)

    def _add_in_boxes(
        self,
        low: np.ndarray,
        high: np.ndarray,
        prices: np.ndarray,
        exact: bool,
        alone: np.ndarray,
        curvature: np.ndarray,
        slope: np.ndarray,
    ) -> None:
        plus, minus = np.maximum(self.V, 0), np.minimum(self.V, 0)

        def image(matrices: np.ndarray, parts: np.ndarray) -> np.ndarray:
            return np.einsum("vek,mk->mve", matrices, parts)

        first = image(plus, low) + image(minus, high)
        last = image(plus, high) + image(minus, low)
        below = first[:, None] - self.values[None, :, None]  # (N, n, n_v, k_e)
        above = self.values[None, :, None] - last[:, None]
        longest = image(self.W, high)[:, None]
        near = np.sum(np.maximum(np.maximum(below, above - longest), 0.0) ** 2, axis=3)
        far = np.sum(np.maximum(np.abs(below), np.abs(above)) ** 2, axis=3)
        which = near.argmin(axis=2)[:, :, None]
        nearest = np.take_along_axis(near, which, 2)[:, :, 0]
        farthest = np.take_along_axis(far, which, 2)[:, :, 0]
        np.put_along_axis(near, which, np.inf, 2)
        served = nearest < prices
        together = served & (farthest <= near.min(axis=2)) & (farthest <= prices) & exact
        one_by_one = np.where(served & ~together, prices - nearest, 0.0)
        alone += one_by_one @ self.weights
        for v, V in enumerate(self.V):
            share = self.weights * (together & (which[:, :, 0] == v))
            alone += share @ (prices - np.sum(self.values**2, axis=1))
            curvature += share.sum(axis=1)[:, None] * np.sum(V**2, axis=0)
            slope += share @ self.values @ V
