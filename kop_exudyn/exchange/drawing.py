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

    @property
    def path(self) -> np.ndarray:
        """The points, the first one once more at the end of a closed curve."""
        return path_of(self.points, self.closed)


def path_of(points: np.ndarray, closed: bool) -> np.ndarray:
    """Points (n, d) of a curve, those of a closed one back to the first."""
    return np.concatenate([points, points[:1]]) if closed else points


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
    cause : a name for it, where what comes of it later is explained by it
    labels : of the curves that it is about, where there is a cause
    """

    kind: str
    text: str
    places: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    cause: str | None = None
    labels: tuple[str, ...] = ()


def size_of(curves: Sequence[DrawnCurve]) -> float:
    """Diagonal of the curves' bounding box."""
    return float(np.linalg.norm(np.ptp(np.concatenate([c.points for c in curves]), axis=0)))
