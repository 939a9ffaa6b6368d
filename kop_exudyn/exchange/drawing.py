"""What is drawn in a file: curves in space, as points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

# of a drawing's size: how far points of arcs and splines may leave them between each other
SAG = 1e-4


@dataclass(frozen=True)
class DrawnCurve:
    """One curve of a drawing.

    points (n, 3) : at least two, in order
    closed : whether the last one is joined to the first
    label : what messages call it, as "line 12" or "SPLINE 2F"
    layer : that it is on, where the file has layers
    """

    points: np.ndarray
    closed: bool
    label: str
    layer: str | None = None


@dataclass(frozen=True)
class Drawing:
    """The content of a file.

    curves : in the order of the file
    unit : name of its unit of length, where the file says so
    metres : of one unit of length, where the file says so
    skipped : what was left out, in words
    doubts : what looks wrong with the file, in words
    """

    curves: list[DrawnCurve]
    unit: str | None = None
    metres: float | None = None
    skipped: Sequence[str] = field(default_factory=list)
    doubts: Sequence[str] = field(default_factory=list)


@dataclass(frozen=True)
class Finding:
    """Something that a reader of the drawing should know.

    kind : "skipped", "cleaned", "joined", "hinged" or "suspicious"
    text : a sentence without its end
    places (k, 3) : where, in the drawing
    """

    kind: str
    text: str
    places: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))


def size_of(curves: Sequence[DrawnCurve]) -> float:
    """Diagonal of the curves' bounding box."""
    return float(np.linalg.norm(np.ptp(np.concatenate([c.points for c in curves]), axis=0)))
