"""Designs that lie far from the origin, as CAD models and map coordinates do, are worked on around
their own middle.

Coordinates x at a distance d have a spacing of eps d in double precision. A rod's strain is a
difference of coordinates over its length L, so that rounding leaves forces of eps d EA / L; beside
the small forces that bend slender rods these are soon too large. The difference to the middle of
what is far away is exact (Sterbenz), so nothing is lost by moving; what was lost before, when the
coordinates were written, bounds what can be asked: beyond `FARTHEST` sizes designs are refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import InputError

NEAR = 2.0  # sizes: what lies as near to the origin as this stays where it is
FARTHEST = 1e7  # sizes, where coordinates are rounded to 1e-9 of the size


class TooFarError(InputError):
    """A design lies further from the origin than `FARTHEST` of its sizes."""


def middle_of(points: Any, field: str) -> np.ndarray:
    """The point (k,) around which to work on points (n, k): the middle of their bounding box, zero
    where that is near the origin.

    Raises InputError, naming the field, where they lie too far away. What isn't points at all is
    left for others to refuse.
    """
    try:
        x = np.array(points, float)
    except (TypeError, ValueError):
        return np.zeros(3)
    if x.ndim != 2 or not len(x) or not np.isfinite(x).all():
        return np.zeros(x.shape[1] if x.ndim == 2 else 3)
    low, high = x.min(axis=0), x.max(axis=0)
    middle, size = low + 0.5 * (high - low), float(np.linalg.norm(high - low))
    distance = float(np.linalg.norm(middle))
    if distance <= NEAR * size:
        return np.zeros(x.shape[1])
    if distance > FARTHEST * size:
        raise TooFarError(
            f"lies {distance / size:.2g} times its own size from the origin, where numbers of "
            f"double precision are too coarse for it (at most {FARTHEST:.0e}): move it nearer",
            field=field,
            value=middle.tolist(),
        )
    return middle


def moved(points: Sequence[Any], middle: np.ndarray) -> list[Any]:
    """Points as a file has them, seen from the middle (k,); further numbers of a point stay, as do
    points that are None."""
    k = len(middle)
    return [
        None if point is None else [*(np.array(point[:k], float) - middle).tolist(), *point[k:]]
        for point in points
    ]
