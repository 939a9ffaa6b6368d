"""Fidelity against the size of the kit: what at most so many parts give, and the knee of that
curve."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def envelope(values: Sequence[float | None]) -> np.ndarray:
    """(n,) the smallest value so far: what is to be had with at most so many parts. None counts as
    infinite."""
    return np.minimum.accumulate([np.inf if value is None else value for value in values])


def knee(sizes: Sequence[float], values: Sequence[float | None]) -> int | None:
    """Number of the point at the knee of a falling curve: more parts gain little, fewer cost much.

    The rule of Satopaa, Albrecht, Irwin and Raghavan, "Finding a 'kneedle' in a haystack" (ICDCS
    workshops 2011), for few points without smoothing: with both axes scaled to [0, 1], the point of
    the `envelope` that is farthest below the straight line from its first to its last. None where
    no point is below that line.

    sizes : (n,) rising; values : (n,), None where there is none
    """
    curve = envelope(values)
    places = np.flatnonzero(np.isfinite(curve))
    if len(places) < 3 or curve[places[0]] == curve[places[-1]]:
        return None
    x, y = np.asarray(sizes, float)[places], curve[places]
    x, y = (x - x[0]) / (x[-1] - x[0]), (y - y[-1]) / (y[0] - y[-1])
    below = (1 - x) - y
    best = int(np.argmax(below))
    return int(places[best]) if below[best] > 1e-9 else None
