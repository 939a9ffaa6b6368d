"""Optimal clusters of numbers: k-means in one dimension, solved exactly by dynamic programming.

In one dimension every optimal cluster is an interval of the sorted numbers, and the best ends of
the last interval never move left as numbers are added (the cost satisfies the quadrangle
inequality, also where centres are bounded). Divide and conquer then takes O(m n log n). Wang and
Song, "Ckmeans.1d.dp: optimal k-means clustering in one dimension by dynamic programming" (The R
Journal, 2011); Gronlund, Larsen, Mathiasen, Nielsen, Schneider and Song, "Fast exact k-means,
k-medians and Bregman divergence clustering in 1D" (arXiv 1701.07204, 2017).
"""

from __future__ import annotations

import numba as nb
import numpy as np


def optimal_centres(
    values: np.ndarray, m: int, lower: float = -np.inf, upper: float = np.inf
) -> tuple[np.ndarray, float]:
    """The m centres of least sum of squared distances of the values to the nearest of them.

    values : (n,) any order; m : number of centres; lower, upper : what centres have to lie between

    Returns the centres (m,), rising, and the sum. Where there are fewer distinct values than
    centres, the last centre is repeated.
    """
    x, counts = np.unique(np.asarray(values, dtype=float), return_counts=True)
    origin = x.mean()  # squares of small differences lose fewer digits about it
    weights = counts.astype(float)
    ones, first, second = (
        np.append(0.0, np.cumsum(weights * (x - origin) ** power)) for power in range(3)
    )
    groups = min(m, len(x))
    ends = _interval_ends(ones, first, second, lower - origin, upper - origin, groups)
    pieces = [slice(a, b) for a, b in zip(ends, ends[1:])]
    centres = np.array([np.average(x[piece], weights=weights[piece]) for piece in pieces])
    centres = np.clip(centres, lower, upper)
    total = sum(float(weights[piece] @ (x[piece] - c) ** 2) for piece, c in zip(pieces, centres))
    return np.append(centres, np.repeat(centres[-1:], m - groups)), total


@nb.njit(cache=True)
def _cost(start, end, ones, first, second, lower, upper):
    """Of the values from start to end (exclusive), about their best centre between the bounds."""
    weight, moment = ones[end] - ones[start], first[end] - first[start]
    centre = min(max(moment / weight, lower), upper)
    about = second[end] - second[start] - centre * (2 * moment - centre * weight)
    return max(about, 0.0)


@nb.njit(cache=True)
def _interval_ends(ones, first, second, lower, upper, m):
    """(m + 1,) where the optimal intervals of n values begin and end, from running sums of weights,
    of weighted values and of weighted squares (n + 1,)."""
    n = len(ones) - 1
    best = np.empty(n + 1)  # cost of the first j values in the intervals so far
    begins = np.zeros((m, n + 1), dtype=np.int64)
    best[0] = 0.0
    for j in range(1, n + 1):
        best[j] = _cost(0, j, ones, first, second, lower, upper)
    for group in range(1, m):
        last, best = best, np.full(n + 1, np.inf)
        # ranges of j with the range of begins that are optimal there
        stack = [(group + 1, n, group, n - 1)]
        while len(stack) > 0:
            low, high, least, most = stack.pop()
            if low > high:
                continue
            j = (low + high) // 2
            for i in range(max(least, group), min(most, j - 1) + 1):
                value = last[i] + _cost(i, j, ones, first, second, lower, upper)
                if value < best[j]:
                    best[j], begins[group, j] = value, i
            stack.append((low, j - 1, least, begins[group, j]))
            stack.append((j + 1, high, begins[group, j], most))
    ends = np.empty(m + 1, dtype=np.int64)
    ends[m] = n
    for group in range(m - 1, -1, -1):
        ends[group] = begins[group, ends[group + 1]]
    return ends
