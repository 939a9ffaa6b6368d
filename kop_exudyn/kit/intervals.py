"""Optimal clusters of numbers: k-means in one dimension, solved exactly by dynamic programming.

In one dimension every optimal cluster is an interval of the sorted numbers, also where centres are
bounded. The best last interval of the first j numbers is found among all, for one cluster after
another: O(m n^2) for n distinct numbers. Wang and Song, "Ckmeans.1d.dp: optimal k-means clustering
in one dimension by dynamic programming" (The R Journal, 2011).
"""

from __future__ import annotations

import numpy as np

_AT_ONCE = 2_000_000  # numbers worked on at a time


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


def _interval_ends(
    ones: np.ndarray,
    first: np.ndarray,
    second: np.ndarray,
    lower: float,
    upper: float,
    m: int,
) -> list[int]:
    """(m + 1,) where the optimal intervals of n values begin and end, from running sums of weights,
    of weighted values and of weighted squares (n + 1,)."""
    n = len(ones) - 1
    best = np.full(n + 1, np.inf)  # cost of the first j values in the intervals so far
    best[0] = 0.0
    begins = np.zeros((m, n + 1), dtype=int)
    for group in range(m):
        last, best = best, np.full(n + 1, np.inf)
        for some in _pieces(n):
            start = np.arange(some.stop)[:, None]
            end = np.arange(some.start, some.stop)[None] + 1
            weight = ones[end] - ones[start]
            moment = first[end] - first[start]
            valid = start < end
            mean = moment / np.where(valid, weight, 1.0)
            centre = np.clip(mean, lower, upper)
            about = second[end] - second[start] - centre * (2 * moment - centre * weight)
            total = last[start] + np.where(valid, np.maximum(about, 0.0), np.inf)
            chosen = total.argmin(axis=0)
            begins[group, end[0]] = chosen
            best[end[0]] = total[chosen, np.arange(end.size)]
    ends = [n]
    for group in range(m - 1, -1, -1):
        ends.append(int(begins[group, ends[-1]]))
    return ends[::-1]


def _pieces(n: int) -> list[slice]:
    """Columns that are worked on at a time, of n."""
    width = max(1, _AT_ONCE // max(n, 1))
    return [slice(start, min(start + width, n)) for start in range(0, n, width)]
